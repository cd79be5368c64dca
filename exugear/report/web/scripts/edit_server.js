// Requests to the server of the page `edit`: results of the text as a stream, the file, and long computations.

/** @param {string} path @param {object} [content] @returns {Promise<Response>} */
export function ask(path, content) {
  if (!content) return fetch(path);
  return fetch(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(content) });
}

/** Name of this tab. */
const TAB = crypto.randomUUID();

/**
 * Yield the results of a text, each as soon as it is known.
 * @param {string} text @param {string} geometry name of the bodies that the page has
 */
export async function* results(text, geometry) {
  const response = await ask("state", { text, geometry, tab: TAB });
  if (!response.ok || !response.body) throw new Error((await response.json()).error);
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = "";
  try {
    for (;;) {
      const { value, done } = await reader.read();
      if (done) return;
      const lines = (rest + value).split("\n");
      rest = lines.pop() ?? "";
      for (const line of lines) yield JSON.parse(line);
    }
  } finally {
    void reader.cancel();
  }
}

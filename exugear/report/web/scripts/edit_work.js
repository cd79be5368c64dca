// Long computations of the page `edit`: buttons, progress, time left, cancelling; and the file that others may change.
import { make, need, say } from "./dom.js";
import { ask } from "./edit_server.js";

/** @typedef {{kind: string, name: string, state: string, digest: string, seconds: number, message: string, progress: {words?: string, done?: number, total?: number | null, left?: number | null}, lines: string[]}} Told */
/** @typedef {{digest: string, missing: boolean, results: Record<string, string>}} FileState */

const PERIOD = 1000;
const REPORT_STATES = /** @type {Record<string, string>} */ ({ current: "Open report", old: "Open report of an earlier state" });

/**
 * @param {() => boolean} isSaved
 * @param {(file: FileState) => void} noticeFile
 */
export function beginWork(isSaved, noticeFile) {
  for (const button of document.querySelectorAll("button[data-work]")) {
    button.addEventListener("click", () => void start(/** @type {HTMLElement} */ (button).dataset.work ?? "", isSaved));
  }
  need("cancel").addEventListener("click", () => void ask("cancel", {}));
  const poll = async () => {
    try {
      const response = await ask("poll");
      if (!response.ok) throw new Error();
      const { file, work } = await response.json();
      noticeFile(file);
      showWork(work, isSaved() ? file.digest : "");
      showStored(file.results, isSaved());
      need("ended").hidden = true;
    } catch {
      need("ended").hidden = false;
    }
    setTimeout(poll, PERIOD);
  };
  void poll();
}

/** @param {string} kind @param {() => boolean} isSaved */
async function start(kind, isSaved) {
  if (!isSaved()) return say("Save the file first: long computations read the saved file.");
  const response = await ask("start", { kind });
  const content = await response.json();
  if (response.ok) showWork(content.work, content.work.digest);
  else say(content.error);
}

/** @param {Told | null} work @param {string} digest of the text, if it is saved */
function showWork(work, digest) {
  need("work").hidden = !work;
  if (!work) return;
  const running = work.state === "running";
  const earlier = !running && work.digest !== digest;
  need("work").classList.toggle("old", earlier);
  const { words = "", done = 0, total = null, left = null } = work.progress;
  const told = running ? [work.lines.at(-1), words, clockText(work.seconds), left ? `${clockText(Math.ceil(left))} left` : ""] : [`${work.state} after ${timeText(work.seconds)}`];
  need("work-words").textContent = `${work.name}: ${told.filter(Boolean).join(", ")}${earlier ? "; for an earlier state of the file" : ""}${work.message && `. ${work.message}`}`;
  const bar = /** @type {HTMLProgressElement} */ (need("progress"));
  bar.hidden = !running;
  if (total) Object.assign(bar, { max: total, value: done });
  else bar.removeAttribute("value");
  need("cancel").hidden = !running;
  need("work-lines").textContent = work.lines.join("\n");
  need("work-output").hidden = !work.lines.length;
}

/** Say which results are in the folder, and for which state. @param {Record<string, string>} results @param {boolean} saved */
function showStored(results, saved) {
  const place = need("stored");
  const told = JSON.stringify([results, saved]);
  if (place.dataset.told === told) return;
  place.dataset.told = told;
  const items = Object.entries(results).map(([kind, state]) => {
    const current = saved && state === "current";
    const words = current ? "for this text" : state === "current" ? "for the saved file, not for this text" : "for an earlier state of the file";
    const name = document.querySelector(`[data-work=${kind}]`)?.textContent ?? kind;
    return make("li", { class: current ? "current" : "old" }, `${name}: ${words}`);
  });
  place.hidden = !items.length;
  need("stored-results").replaceChildren(...items);
  const state = results.report && (saved ? results.report : "old");
  need("report").replaceChildren(...(state ? [make("a", { href: "report.html", target: "_blank", class: state }, REPORT_STATES[state])] : []));
}

/** Time as the command line shows it. @param {number} seconds */
function clockText(seconds) {
  const whole = Math.floor(seconds);
  const two = (/** @type {number} */ number) => String(number % 60).padStart(2, "0");
  return `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60))}:${two(whole)}`;
}

/** @param {number} seconds */
function timeText(seconds) {
  const whole = Math.round(seconds);
  return whole < 60 ? `${whole} s` : `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")} min`;
}

// Elements of the page: found by name, made with text that is never taken for HTML.

/** @param {string} id @returns {HTMLElement | null} */
export const find = (id) => document.getElementById(id);

/**
 * An element that must be there.
 * @param {string} id
 * @returns {HTMLElement}
 */
export function need(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page lacks ${id}`);
  return element;
}

/**
 * Make an element.
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {Record<string, string | boolean | (() => void)>} [attributes] functions become handlers of clicks
 * @param {(Node | string)[]} content texts stay texts
 * @returns {HTMLElementTagNameMap[K]}
 */
export function make(tag, attributes = {}, ...content) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener("click", value);
    else if (typeof value === "string") element.setAttribute(name, value);
    else if (value) element.setAttribute(name, "");
  }
  element.append(...content);
  return element;
}

/**
 * Fill a row of buttons of which one is pressed.
 * @param {HTMLElement} box
 * @param {[string, string][]} choices values and words
 * @param {string} current
 * @param {(value: string) => void} choose
 */
export function fillChoices(box, choices, current, choose) {
  const focused = box.contains(document.activeElement);
  const buttons = choices.map(([value, words]) =>
    make("button", { type: "button", "aria-pressed": String(value === current), "data-value": value }, words),
  );
  for (const button of buttons) button.addEventListener("click", () => choose(button.dataset.value ?? ""));
  box.replaceChildren(...buttons);
  // Filling anew must not take the keyboard away.
  if (focused) buttons.find((button) => button.dataset.value === current)?.focus();
}

/** @param {string} words shown for a moment, and read aloud */
export function say(words) {
  const place = need("said");
  place.textContent = words;
  place.classList.add("on");
  setTimeout(() => place.classList.remove("on"), 2500);
}

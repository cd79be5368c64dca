// A slider for the number at the cursor: the text follows the slider, and everything else follows the text.
import { need } from "./dom.js";
import { described, keyAtCursor, numberAtCursor } from "./edit_text.js";

/** Number of steps over the range of the slider. */
const STEPS = 200;

/** @type {{from: number, to: number, text: string} | null} */
let held = null;
let sliding = false;

/** @param {Editor} editor */
export function beginSlider(editor) {
  const slider = /** @type {HTMLInputElement} */ (need("slider"));
  slider.addEventListener("input", () => {
    if (!held) return;
    const text = written(held.text, Number(slider.value));
    const { from } = held;
    sliding = true;
    editor.dispatch({ changes: { from, to: held.to, insert: text }, selection: { anchor: from }, userEvent: "input.slide" });
    sliding = false;
    held = { from, to: from + text.length, text };
    need("slider-value").textContent = text;
  });
  // The next range is around the new value.
  slider.addEventListener("change", () => followCursor(editor));
}

/** Offer the slider for the number at the cursor. @param {Editor} editor */
export function followCursor(editor) {
  if (sliding) return;
  held = numberAtCursor(editor);
  const key = keyAtCursor(editor);
  const about = described(key);
  if (key) {
    need("key-name").textContent = key;
    need("key-about").textContent = about ? `${about.about}. ${about.meaning}` : "";
  }
  need("slider-row").hidden = !held;
  if (!held) return;
  const value = Number(held.text.replaceAll("_", ""));
  const [low, high] = rangeOf(held.text, value);
  const slider = /** @type {HTMLInputElement} */ (need("slider"));
  Object.assign(slider, { min: String(low), max: String(high), step: String(isWhole(held.text) ? 1 : "any") });
  slider.value = String(value);
  slider.setAttribute("aria-label", key);
  need("slider-value").textContent = held.text;
}

/** @param {string} text */
const isWhole = (text) => /^[-+]?[\d_]+$/.test(text);

/** Range of the slider: half to one and a half times the value. @param {string} text @param {number} value @returns {[number, number]} */
function rangeOf(text, value) {
  const reach = 0.5 * Math.abs(value);
  if (isWhole(text)) return [Math.floor(value - Math.max(reach, 2)), Math.ceil(value + Math.max(reach, 2))];
  return value ? [value - reach, value + reach] : [-1, 1];
}

/** Value in the notation of the text before: whole, decimal or exponential. @param {string} text @param {number} value */
function written(text, value) {
  if (isWhole(text)) return String(Math.round(value));
  if (/[eE]/.test(text)) return value.toExponential(3);
  const fine = Math.ceil(Math.log10(STEPS / Math.max(Math.abs(value), 1e-9)));
  return value.toFixed(Math.min(Math.max(text.split(".")[1]?.length ?? 0, fine, 1), 9));
}

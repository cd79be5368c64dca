// The cursor that all diagrams over speed share: a line in the drawings, one in the plots, and the amplitudes there.
import { find } from "./dom.js";
import { figureText } from "./numbers.js";
import { pageData, unpack } from "./page_data.js";
import { plotIn } from "./plots.js";

/** Figures whose plots follow. */
const PLOTS = ["waterfall", "cuts"];

/** @typedef {{left: number, right: number, low: number, high: number}} SpeedAxis */

/** @param {Element} drawing @returns {SpeedAxis} */
function axisOf(drawing) {
  const [left, right, low, high] = (drawing.getAttribute("data-speeds") ?? "").split(" ").map(Number);
  return { left, right, low, high };
}

/** Follow the pointer in the drawings. */
export function beginSpeedCursor() {
  for (const drawing of /** @type {NodeListOf<SVGSVGElement>} */ (document.querySelectorAll("svg[data-speeds]"))) {
    drawing.addEventListener("pointermove", (event) => {
      const matrix = drawing.getScreenCTM();
      if (!matrix) return;
      const { left, right, low, high } = axisOf(drawing);
      const share = (new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse()).x - left) / (right - left);
      const inside = share >= 0 && share <= 1;
      showSpeed(inside ? low + share * (high - low) : null);
      for (const name of PLOTS) movePlot(name, inside ? low + share * (high - low) : null);
    });
    drawing.addEventListener("pointerleave", () => {
      showSpeed(null);
      for (const name of PLOTS) movePlot(name, null);
    });
  }
}

/** @param {string} name @param {number | null} speed rpm */
function movePlot(name, speed) {
  const box = find(name)?.querySelector(".plot");
  const plot = box ? plotIn(box)?.plot : undefined;
  if (!plot) return;
  const left = speed === null ? -10 : plot.valToPos(speed, "x");
  plot.setCursor({ left, top: -10 }, false);
}

/** Show a speed in all drawings, and the amplitudes there. @param {number | null} speed rpm; null for none */
export function showSpeed(speed) {
  for (const drawing of document.querySelectorAll("svg[data-speeds]")) {
    const { left, right, low, high } = axisOf(drawing);
    const line = drawing.querySelector(".cursor");
    if (!line) continue;
    const seen = speed !== null && speed >= low && speed <= high;
    line.setAttribute("visibility", seen ? "visible" : "hidden");
    if (!seen) continue;
    const x = String(left + ((speed - low) / (high - low)) * (right - left));
    line.setAttribute("x1", x);
    line.setAttribute("x2", x);
  }
  void readOut(speed);
}

let asked = 0;

/** @param {number | null} speed rpm */
async function readOut(speed) {
  const place = find("speed-readout");
  if (!place) return;
  const mine = ++asked;
  if (speed === null) {
    place.textContent = "";
    return;
  }
  const texts = [];
  for (const curve of pageData.curves ?? []) {
    const value = interpolated(await unpack(curve.speeds), await unpack(curve.values), speed);
    if (value !== null) texts.push(`${curve.label} ±${figureText(value)} ${curve.unit}`);
  }
  if (mine === asked) place.textContent = `${figureText(speed, 4)} rpm: ${texts.join(", ")}`;
}

/**
 * @param {ArrayLike<number>} x rising @param {ArrayLike<number>} y @param {number} at
 * @returns {number | null} null outside
 */
function interpolated(x, y, at) {
  if (!x.length || at < x[0] || at > x[x.length - 1]) return null;
  let [low, high] = [0, x.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (x[middle] <= at) low = middle;
    else high = middle;
  }
  const share = (at - x[low]) / Math.max(x[high] - x[low], 1e-12);
  return y[low] + share * (y[high] - y[low]);
}

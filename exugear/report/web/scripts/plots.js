// Plots: uPlot with zoom by box, wheel, pinch, keys and buttons.
import { make } from "./dom.js";
import { within } from "./numbers.js";
import { pageColour } from "./colours.js";

/** @typedef {{x: [number, number], y: [number, number]}} Bounds */
/** @typedef {{plot: Plot, bounds: Bounds, home: Bounds}} Framed */

/** @type {WeakMap<Element, Framed>} */
const framedPlots = new WeakMap();

/** @param {Element} box @returns {Framed | undefined} */
export const plotIn = (box) => framedPlots.get(box);

/** @param {string} label @returns {PlotAxis} */
export function axisOf(label) {
  const font = "12px system-ui, sans-serif";
  const line = pageColour("--line");
  return {
    label,
    labelSize: 18,
    size: 34,
    labelFont: font,
    font,
    stroke: pageColour("--soft"),
    grid: { stroke: line, width: 1 },
    ticks: { stroke: line, width: 1, size: 5 },
  };
}

/**
 * Draw a plot in a box in place of the one before.
 * @param {HTMLElement} box
 * @param {PlotOptions} options
 * @param {PlotData} data
 * @param {Bounds} bounds how far one can zoom out
 * @param {Bounds} home what is shown first
 * @returns {Plot}
 */
export function drawPlot(box, options, data, bounds, home = bounds) {
  const before = framedPlots.get(box);
  if (before) before.plot.destroy();
  else steer(box);
  box.replaceChildren();
  const width = Math.max(200, box.clientWidth);
  const plot = new uPlot({ ...options, width, legend: { show: false } }, data, box);
  framedPlots.set(box, { plot, bounds, home });
  show(plot, home);
  return plot;
}

/** @param {Plot} plot @param {Bounds} part */
function show(plot, part) {
  plot.batch(() => {
    plot.setScale("x", { min: part.x[0], max: part.x[1] });
    plot.setScale("y", { min: part.y[0], max: part.y[1] });
  });
}

/** @param {Element} box */
export function showWhole(box) {
  const framed = framedPlots.get(box);
  if (framed) show(framed.plot, framed.home);
}

/**
 * @param {Element} box
 * @param {number} factor of what is shown
 * @param {[number, number]} [at] share of width and height that stays
 */
export function zoom(box, factor, at = [0.5, 0.5]) {
  const framed = framedPlots.get(box);
  if (framed) show(framed.plot, { x: part(framed, "x", factor, at[0], 0), y: part(framed, "y", factor, at[1], 0) });
}

/** @param {Element} box @param {number} dx shares of what is shown @param {number} dy */
export function pan(box, dx, dy) {
  const framed = framedPlots.get(box);
  if (framed) show(framed.plot, { x: part(framed, "x", 1, 0.5, dx), y: part(framed, "y", 1, 0.5, dy) });
}

/**
 * @param {Framed} framed @param {"x" | "y"} key @param {number} factor @param {number} at @param {number} shift
 * @returns {[number, number]}
 */
function part({ plot, bounds }, key, factor, at, shift) {
  const scale = plot.scales[key];
  const [low, high] = bounds[key];
  const min = scale.min ?? low;
  const span = (scale.max ?? high) - min;
  const width = Math.min(span * factor, high - low);
  const start = within(min + span * at + shift * span - width * at, low, high - width);
  return [start, start + width];
}

/** @param {HTMLElement} box */
function steer(box) {
  /** @param {{clientX: number, clientY: number}} event @returns {[number, number]} */
  const place = (event) => {
    const over = framedPlots.get(box)?.plot.over.getBoundingClientRect() ?? box.getBoundingClientRect();
    return [(event.clientX - over.left) / over.width, 1 - (event.clientY - over.top) / over.height];
  };
  box.addEventListener(
    "wheel",
    (event) => {
      // The wheel alone scrolls the page.
      if (!(event.ctrlKey || event.metaKey || event.shiftKey)) return;
      event.preventDefault();
      zoom(box, Math.exp(0.002 * (event.deltaY || event.deltaX)), place(event));
    },
    { passive: false },
  );
  box.addEventListener("dblclick", () => showWhole(box));
  box.addEventListener("keydown", (event) => steerByKey(box, event));
  steerByFingers(box, place);
  new ResizeObserver(() => {
    const plot = framedPlots.get(box)?.plot;
    if (plot && box.clientWidth > 50 && Math.abs(plot.width - box.clientWidth) > 1) {
      plot.setSize({ width: box.clientWidth, height: plot.height });
    }
  }).observe(box);
}

/** @param {HTMLElement} box @param {KeyboardEvent} event */
function steerByKey(box, event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  /** @type {Record<string, () => void>} */
  const keys = {
    ArrowLeft: () => pan(box, -0.15, 0),
    ArrowRight: () => pan(box, 0.15, 0),
    ArrowUp: () => pan(box, 0, 0.15),
    ArrowDown: () => pan(box, 0, -0.15),
    "+": () => zoom(box, 0.7),
    "=": () => zoom(box, 0.7),
    "-": () => zoom(box, 1 / 0.7),
    0: () => showWhole(box),
  };
  const act = keys[event.key];
  if (!act) return;
  event.preventDefault();
  act();
}

/**
 * @param {HTMLElement} box
 * @param {(event: {clientX: number, clientY: number}) => [number, number]} place
 */
function steerByFingers(box, place) {
  let before = 0;
  /** @param {TouchEvent} event */
  const move = (event) => {
    if (event.touches.length !== 2) return;
    event.preventDefault();
    const [one, two] = event.touches;
    const apart = Math.hypot(one.clientX - two.clientX, one.clientY - two.clientY);
    const middle = { clientX: (one.clientX + two.clientX) / 2, clientY: (one.clientY + two.clientY) / 2 };
    if (before) zoom(box, before / apart, place(middle));
    before = apart;
  };
  box.addEventListener("touchmove", move, { passive: false });
  box.addEventListener("touchend", () => (before = 0));
}

/** @param {Element} box @returns {HTMLButtonElement[]} */
export function zoomButtons(box) {
  /** @type {[string, string, () => void][]} */
  const listed = [
    ["−", "Zoom out", () => zoom(box, 1 / 0.7)],
    ["+", "Zoom in", () => zoom(box, 0.7)],
    ["⤢", "Show all", () => showWhole(box)],
  ];
  return listed.map(([shown, label, act]) =>
    make("button", { type: "button", "aria-label": label, title: label, click: act }, shown),
  );
}

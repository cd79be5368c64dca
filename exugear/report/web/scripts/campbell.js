// Campbell diagram of a model: modes across, orders aslant, dots where they meet.
import { pageColour } from "./colours.js";
import { find, make, need } from "./dom.js";
import { addTools } from "./downloads.js";
import { figureText } from "./numbers.js";
import { lineColour } from "./order_lines.js";
import { pageData } from "./page_data.js";
import { axisOf, drawPlot, zoomButtons } from "./plots.js";
import { choose, state } from "./state.js";

/** @typedef {{line: number, mode: number, speed: number, frequency: number, size: number}} Crossing */

/** Let the reader choose a model. */
export function beginCampbell() {
  const select = /** @type {HTMLSelectElement | null} */ (find("model"));
  if (!select) return;
  select.replaceChildren(
    ...Object.entries(pageData.models).map(([name, model]) => make("option", { value: name }, model.words)),
  );
  select.addEventListener("change", () => choose({ model: select.value, mode: -1, resonance: -1 }));
}

/** @param {import("./page_data.js").ModelData} model @returns {Crossing[]} */
function crossingsOf(model) {
  const strongest = Math.max(1e-12, ...model.modes.filter((mode) => mode.seen).map((mode) => mode.amplification));
  return pageData.lines.flatMap((line, place) =>
    model.modes.flatMap((mode, number) => {
      const speed = (60 * mode.frequency) / line.order;
      if (!mode.seen || !(mode.frequency > 0) || speed > model.fastest) return [];
      return [{ line: place, mode: number, speed, frequency: mode.frequency, size: mode.amplification / strongest }];
    }),
  );
}

/**
 * Frequencies to show where no order meets a mode: how far the orders reach, and the first mode beyond.
 * @param {import("./page_data.js").ModelData} model
 */
function outOfReach(model) {
  const seen = model.modes.filter((mode) => mode.seen && mode.frequency > 0).map((mode) => mode.frequency);
  const reached = pageData.lines.map((line) => (line.order * model.fastest) / 60);
  return [...reached, ...(seen.length ? [Math.min(...seen)] : [])];
}

/** Draw the diagram of the chosen model. */
export function drawCampbell() {
  const figure = find("campbell");
  const model = pageData.models[state.model];
  const box = /** @type {HTMLElement | null} */ (figure?.querySelector(".plot"));
  if (!figure || !model || !box) return;
  /** @type {HTMLSelectElement} */ (need("model")).value = state.model;
  const crossings = crossingsOf(model);
  const loud = crossings.filter((crossing) => crossing.size > 0.02);
  const met = (loud.length ? loud : crossings).map((crossing) => crossing.frequency);
  const highest = 1.2 * Math.max(100, ...(met.length ? met : outOfReach(model)));
  /** @type {import("./plots.js").Bounds} */
  const bounds = { x: [0, model.fastest], y: [0, highest] };
  const plot = drawPlot(box, optionsOf(model, crossings), [[0, model.fastest], [0, highest]], bounds);
  plot.over.addEventListener("click", (event) => {
    if (plot.select.width > 4) return;
    const over = plot.over.getBoundingClientRect();
    const near = nearest(plot, crossings, event.clientX - over.left, event.clientY - over.top);
    if (!near) return;
    choose({ model: state.model, mode: near.mode, resonance: -1, lines: [near.line] });
    find("mode")?.scrollIntoView({ block: "nearest" });
  });
  addTools(figure.querySelector(".tools"), () => `Campbell diagram, ${model.words}`, {
    rows: () => rowsOf(model, crossings),
    canvas: () => /** @type {HTMLCanvasElement} */ (box.querySelector("canvas")),
    extra: zoomButtons(box),
  });
}

/** @param {import("./page_data.js").ModelData} model @param {Crossing[]} crossings */
function rowsOf(model, crossings) {
  const head = ["order", "speed / rpm", "frequency / Hz", "amplification", "mode shape"];
  const rows = crossings.map(({ line, mode, speed, frequency }) => {
    const own = model.modes[mode];
    return [pageData.lines[line].short, Number(speed.toPrecision(6)), frequency, own.amplification, own.words];
  });
  return [head, ...rows];
}

/** @param {import("./page_data.js").ModelData} model @param {Crossing[]} crossings @returns {PlotOptions} */
function optionsOf(model, crossings) {
  return {
    height: window.innerWidth < 620 ? 330 : 420,
    padding: [12, 14, 0, 0],
    cursor: { drag: { x: true, y: true, uni: 20 }, points: { show: false } },
    scales: { x: { time: false, range: (_, low, high) => [low, high] }, y: { range: (_, low, high) => [low, high] } },
    axes: [axisOf(`${pageData.input} speed / rpm`), { ...axisOf("frequency / Hz"), size: 58 }],
    series: [{}, { paths: () => null, points: { show: false } }],
    hooks: {
      draw: [(plot) => paint(plot, model, crossings)],
      setCursor: [(plot) => hovered(plot, model, crossings)],
    },
  };
}

/** @param {Plot} plot @param {import("./page_data.js").ModelData} model @param {Crossing[]} crossings */
function paint(plot, model, crossings) {
  const { left, top, width, height } = plot.bbox;
  const ratio = window.devicePixelRatio || 1;
  const drawing = plot.ctx;
  drawing.save();
  drawing.beginPath();
  drawing.rect(left, top, width, height);
  drawing.clip();
  model.modes.forEach((mode, number) => {
    if (!mode.seen) return;
    const y = plot.valToPos(mode.frequency, "y", true);
    drawing.strokeStyle = pageColour(number === state.mode ? "--mark" : "--soft");
    drawing.globalAlpha = number === state.mode ? 1 : 0.4;
    drawing.lineWidth = (number === state.mode ? 2 : 1) * ratio;
    segment(drawing, left, y, left + width, y);
  });
  drawing.globalAlpha = 1;
  pageData.lines.forEach((line, place) => {
    drawing.strokeStyle = lineColour(place);
    drawing.lineWidth = 1.2 * ratio;
    drawing.setLineDash([[], [7, 4], [2, 4]][line.harmonic - 1]?.map((dash) => dash * ratio) ?? []);
    const end = plot.valToPos((line.order / 60) * model.fastest, "y", true);
    segment(drawing, plot.valToPos(0, "x", true), plot.valToPos(0, "y", true), plot.valToPos(model.fastest, "x", true), end);
  });
  drawing.setLineDash([]);
  for (const { line, mode, speed, frequency, size } of crossings) {
    drawing.beginPath();
    drawing.arc(plot.valToPos(speed, "x", true), plot.valToPos(frequency, "y", true), (2 + 7 * Math.sqrt(size)) * ratio, 0, 7);
    drawing.fillStyle = lineColour(line);
    drawing.fill();
    drawing.lineWidth = (mode === state.mode ? 2.5 : 1) * ratio;
    drawing.strokeStyle = pageColour(mode === state.mode ? "--mark" : "--panel");
    drawing.stroke();
  }
  drawing.restore();
}

/** @param {CanvasRenderingContext2D} drawing @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 */
function segment(drawing, x0, y0, x1, y1) {
  drawing.beginPath();
  drawing.moveTo(x0, y0);
  drawing.lineTo(x1, y1);
  drawing.stroke();
}

/** @param {Plot} plot @param {Crossing[]} crossings @param {number} left @param {number} top @returns {Crossing | null} */
function nearest(plot, crossings, left, top) {
  let best = null;
  let distance = 14;
  for (const crossing of crossings) {
    const apart = Math.hypot(plot.valToPos(crossing.speed, "x") - left, plot.valToPos(crossing.frequency, "y") - top);
    if (apart < distance) [best, distance] = [crossing, apart];
  }
  return best;
}

/** @param {Plot} plot @param {import("./page_data.js").ModelData} model @param {Crossing[]} crossings */
function hovered(plot, model, crossings) {
  const { left = -1, top = -1 } = plot.cursor;
  const tip = find("tip");
  const near = left < 0 ? null : nearest(plot, crossings, left, top);
  if (!tip) return;
  tip.hidden = !near;
  if (!near) return;
  const mode = model.modes[near.mode];
  const where = `${figureText(mode.frequency, 5)} Hz at ${figureText(near.speed, 4)} rpm`;
  tip.textContent = `${where}: ${pageData.lines[near.line].sentence}; ${mode.words}`;
  const over = plot.over.getBoundingClientRect();
  tip.style.left = `${Math.min(over.left + left + 14, window.innerWidth - 280)}px`;
  tip.style.top = `${over.top + top + 14}px`;
}

// The waterfall: cells in colour, order lines, circles around resonances, all linked with the rest of the page.
import { mapColours, pageColour } from "./colours.js";
import { find, make, need } from "./dom.js";
import { addTools } from "./downloads.js";
import { columnOf, DIFFERENCE, fieldOf, frequencyOf, heatOf, levelAt, loudestIn, rowOf, SPAN, speedOf } from "./heat.js";
import { amplitudeOf, figureText } from "./numbers.js";
import { clipped, paintLines, toggleLine } from "./order_lines.js";
import { pageData } from "./page_data.js";
import { axisOf, drawPlot, plotIn, zoomButtons } from "./plots.js";
import { showSpeed } from "./speed_cursor.js";
import { allSpeeds, choose, chosenGroup, chosenResonance, chosenVariant, firstHarmonics, firstSpeeds, shownResonances, state } from "./state.js";

const HINT = "Drag to zoom. Click a circle or an order line.";

/** @type {import("./heat.js").Heat | null} */
let heat = null;
let asked = 0;

/** @returns {HTMLElement} */
const box = () => /** @type {HTMLElement} */ (need("waterfall").querySelector(".plot"));

/** Draw what is chosen; of several calls the last one wins. */
export async function drawWaterfall() {
  const group = chosenGroup();
  const variant = chosenVariant();
  if (!group || !variant) return;
  const mine = ++asked;
  const channel = variant.channels.find((one) => one.name === state.channel) ?? variant.channels[0];
  const reference = Object.keys(group.variants).find((name) => name !== state.variant);
  const field = await fieldOf(channel);
  const other =
    state.view === "difference" && reference ? await fieldOf(group.variants[reference].channels[0]) : null;
  if (mine !== asked) return;
  heat = heatOf(field, other);
  drawFrame();
  tell(channel.words, variant.words, other && reference ? group.variants[reference].words : "");
}

function drawFrame() {
  const group = chosenGroup();
  if (!heat || !group) return;
  const { field } = heat;
  const highest = frequencyOf(field, field.rows - 1);
  /** @type {import("./plots.js").Bounds} */
  const bounds = { x: [0, allSpeeds(group)[1]], y: [0, highest] };
  const speeds = firstSpeeds(group);
  // The listed resonances, and the first harmonic of every mesh up to the highest speed.
  const peaks = shownResonances().map(({ own }) => 1.15 * own.peak);
  const orders = firstHarmonics().map((line) => (pageData.lines[line].order * speeds[1]) / 60);
  const home = { x: speeds, y: /** @type {[number, number]} */ ([0, Math.min(highest, Math.max(10, ...peaks, ...orders))]) };
  const before = plotIn(box());
  const same = before && JSON.stringify([before.home.x, before.bounds]) === JSON.stringify([home.x, bounds]);
  const kept = before && same ? shownPart(before.plot) : null;
  const plot = drawPlot(box(), frameOptions(), [bounds.x, [0, highest]], bounds, home);
  if (kept) {
    plot.setScale("x", { min: kept.x[0], max: kept.x[1] });
    plot.setScale("y", { min: kept.y[0], max: Math.min(kept.y[1], highest) });
  }
  plot.over.addEventListener("click", (event) => clicked(plot, event));
}

/** @param {Plot} plot @returns {import("./plots.js").Bounds} */
function shownPart(plot) {
  const { x, y } = plot.scales;
  return { x: [x.min ?? 0, x.max ?? 1], y: [y.min ?? 0, y.max ?? 1] };
}

/** @returns {PlotOptions} */
function frameOptions() {
  return {
    height: window.innerWidth < 620 ? 330 : 440,
    padding: [20, 14, 0, 0],
    cursor: {
      drag: { x: true, y: true, uni: 20 },
      points: { show: false },
      sync: { key: "speed", scales: ["x", null] },
    },
    scales: { x: { time: false, range: (_, low, high) => [low, high] }, y: { range: (_, low, high) => [low, high] } },
    axes: [axisOf(`${pageData.input} speed / rpm`), { ...axisOf("frequency / Hz"), size: 58 }],
    series: [{}, { paths: () => null, points: { show: false } }],
    hooks: {
      drawClear: [paintCells],
      draw: [paintLines, paintResonances],
      setCursor: [hovered],
    },
  };
}

/** @param {Plot} plot */
function paintCells(plot) {
  clipped(plot, (drawing) => {
    if (!heat) return;
    const { field, canvas } = heat;
    const [speeds, columns] = field.channel.knots;
    const edge = 0.5 * field.channel.spacing;
    const y = [frequencyOf(field, 0) - edge, frequencyOf(field, field.rows - 1) + edge].map((frequency) =>
      plot.valToPos(frequency, "y", true),
    );
    for (let piece = 0; piece < columns.length - 1; piece++) {
      const x = [plot.valToPos(speeds[piece], "x", true), plot.valToPos(speeds[piece + 1], "x", true)];
      const count = columns[piece + 1] - columns[piece];
      drawing.imageSmoothingEnabled = (x[1] - x[0]) / count < 6;
      drawing.drawImage(canvas, columns[piece], 0, count, field.rows, x[0], y[1], x[1] - x[0], y[0] - y[1]);
    }
  });
}

/** @param {Plot} plot */
function paintResonances(plot) {
  if (state.channel !== "overall") return;
  clipped(plot, (drawing, ratio) => {
    for (const { own, place } of shownResonances()) {
      const on = own === chosenResonance();
      const [x, y] = [plot.valToPos(own.speed, "x", true), plot.valToPos(own.peak, "y", true)];
      for (const [colour, width] of /** @type {[string, number][]} */ ([["--panel", 4.5], ["--mark", on ? 2.6 : 1.5]])) {
        drawing.beginPath();
        drawing.setLineDash(own.steady ? [] : [3 * ratio, 2 * ratio]);
        drawing.arc(x, y, (on ? 10 : 6.5) * ratio, 0, 7);
        drawing.lineWidth = width * ratio;
        drawing.strokeStyle = pageColour(colour);
        drawing.stroke();
      }
      drawing.font = `700 ${12 * ratio}px system-ui, sans-serif`;
      drawing.textAlign = "left";
      drawing.lineWidth = 3 * ratio;
      drawing.setLineDash([]);
      drawing.strokeStyle = pageColour("--panel");
      drawing.strokeText(String(place + 1), x + 10 * ratio, y - 8 * ratio);
      drawing.fillStyle = pageColour("--mark");
      drawing.fillText(String(place + 1), x + 10 * ratio, y - 8 * ratio);
    }
  });
}

/**
 * Resonance or order line near a place, resonances first.
 * @param {Plot} plot @param {number} left @param {number} top in pixels of the page
 * @returns {{place: number} | {line: number} | null}
 */
function nearest(plot, left, top) {
  let best = null;
  let distance = 15;
  for (const { own, place } of state.channel === "overall" ? shownResonances() : []) {
    const apart = Math.hypot(plot.valToPos(own.speed, "x") - left, plot.valToPos(own.peak, "y") - top);
    if (apart < distance) [best, distance] = [{ place }, apart];
  }
  if (best) return best;
  distance = 7;
  const speed = plot.posToVal(left, "x");
  state.lines.forEach((line) => {
    const own = pageData.lines[line];
    const here = plot.valToPos((own.order / 60) * speed, "y") - top;
    const further = plot.valToPos((own.order / 60) * plot.posToVal(left + 1, "x"), "y") - top;
    const apart = Math.abs(here) / Math.hypot(1, further - here);
    if (apart < distance) [best, distance] = [{ line }, apart];
  });
  return best;
}

/** @param {Plot} plot @param {MouseEvent} event */
function clicked(plot, event) {
  // The end of a drag is no click.
  if (plot.select.width > 4 || plot.select.height > 4) return;
  const over = plot.over.getBoundingClientRect();
  const near = nearest(plot, event.clientX - over.left, event.clientY - over.top);
  if (near && "place" in near) choose({ resonance: near.place });
  else if (near) toggleLine(near.line);
}

/** @param {Plot} plot */
function hovered(plot) {
  const { left = -1, top = -1 } = plot.cursor;
  const tip = find("tip");
  if (!tip || !heat) return;
  if (left < 0 || top < 0) {
    tip.hidden = true;
    return;
  }
  showSpeed(plot.posToVal(left, "x"));
  const { field, other } = heat;
  const speed = plot.posToVal(left, "x");
  const frequency = plot.posToVal(top, "y");
  const found = loudestIn(
    heat,
    [columnOf(field, plot.posToVal(left - 1.5, "x")), columnOf(field, plot.posToVal(left + 1.5, "x"))],
    [rowOf(field, plot.posToVal(top + 1.5, "y")), rowOf(field, plot.posToVal(top - 1.5, "y"))],
  );
  const order = `order ${figureText((60 * frequency) / speed, 4)}`;
  const level = found ? levelWords(found.level, other ? found.other : null) : "outside";
  need("readout").textContent = `${figureText(speed, 4)} rpm, ${figureText(frequency, 4)} Hz, ${order}: ${level}`;
  const near = nearest(plot, left, top);
  plot.over.style.cursor = near ? "pointer" : "crosshair";
  tip.hidden = !near;
  if (!near) return;
  tip.textContent = "place" in near ? resonanceWords(near.place) : pageData.lines[near.line].sentence;
  const over = plot.over.getBoundingClientRect();
  tip.style.left = `${Math.min(over.left + left + 14, window.innerWidth - 280)}px`;
  tip.style.top = `${over.top + top + 14}px`;
}

/** @param {number} level @param {number | null} other @returns {string} */
function levelWords(level, other) {
  if (other !== null) return `${figureText(level - other, 3)} dB (${figureText(level)} against ${figureText(other)} dB)`;
  return `${figureText(level)} dB = ${figureText(amplitudeOf(level), 2)} ${heat?.field.channel.unit}`;
}

/** @param {number} place @returns {string} */
function resonanceWords(place) {
  const own = chosenVariant()?.resonances[place];
  if (!own) return "";
  const where = `${figureText(own.frequency, 4)} Hz at ${figureText(own.speed, 4)} rpm`;
  return `No. ${place + 1}: ${where}, ${figureText(own.level)} dB, ${own.short}`;
}

/** @param {string} channel @param {string} variant @param {string} other */
function tell(channel, variant, other) {
  if (!heat) return;
  const title = other ? `${channel}: ${variant} against ${other}` : `${channel}, ${variant}`;
  const source = chosenGroup()?.source ?? "";
  const named = need("waterfall").querySelector("figcaption strong");
  if (named) named.textContent = title;
  const hint = need("waterfall").querySelector(".hint");
  if (hint) hint.textContent = `Source: ${source}. ${HINT}`;
  const loudest = shownResonances().slice(0, 3).map(({ place }) => resonanceWords(place)).join("; ");
  box().setAttribute("aria-label", `${title}, ${source}. ${loudest}. Arrow keys move, plus and minus zoom, 0 shows all.`);
  const { top, field } = heat;
  const bar = make("i", { class: "bar" });
  bar.style.background = `linear-gradient(to right, ${mapColours(Boolean(other)).join(",")})`;
  const ends = other
    ? [`${other} higher by ${DIFFERENCE} dB`, `${variant} higher`]
    : [`${top - SPAN} dB`, `${top} dB re 1 ${field.channel.unit}`];
  need("waterfall-scale").replaceChildren(ends[0], bar, ends[1]);
  addTools(need("waterfall").querySelector(".tools"), () => title, {
    rows: cellRows,
    canvas: () => /** @type {HTMLCanvasElement} */ (box().querySelector("canvas")),
    extra: zoomButtons(box()),
  });
}

/** Rows of all cells: frequencies down, speeds across. */
function cellRows() {
  if (!heat) return [];
  const { field } = heat;
  const columns = Array.from({ length: field.columns }, (_, column) => column);
  const head = ["frequency / Hz", ...columns.map((column) => `${figureText(speedOf(field, column), 5)} rpm`)];
  const rows = Array.from({ length: field.rows }, (_, row) => [
    Number(frequencyOf(field, row).toPrecision(6)),
    ...columns.map((column) => levelAt(field, column, row)),
  ]);
  return [head, ...rows];
}

// Levels along the chosen orders, over the same speeds as the waterfall.
import { curveColour, pageColour } from "./colours.js";
import { make, need } from "./dom.js";
import { addTools } from "./downloads.js";
import { dashOf, lineColour, toggleLine } from "./order_lines.js";
import { pageData, unpack } from "./page_data.js";
import { axisOf, drawPlot, zoomButtons } from "./plots.js";
import { chosenGroup, chosenResonance, state } from "./state.js";

const NO_LEVEL = -32768;
/** dB below the highest level at which the diagram ends. */
const DEPTH = 70;
let asked = 0;

/** @typedef {{label: string, line: number, main: boolean, speeds: number[], levels: (number | null)[]}} Cut */

/** @returns {HTMLElement} */
const box = () => /** @type {HTMLElement} */ (need("cuts").querySelector(".plot"));

/** Draw the chosen orders of all variants. */
export async function drawCuts() {
  const group = chosenGroup();
  if (!group) return;
  const mine = ++asked;
  /** @type {Cut[]} */
  const cuts = [];
  for (const [name, variant] of Object.entries(group.variants)) {
    const channel = variant.channels.find((one) => one.name === state.channel);
    // Another channel may be one that only the chosen variant has.
    if (!channel) continue;
    const speeds = Array.from(await unpack(channel.speeds));
    const levels = await unpack(channel.cuts);
    for (const line of state.lines) {
      const along = speeds.map((_, frame) => {
        const level = levels[frame * pageData.lines.length + line];
        return level === NO_LEVEL ? null : level / 10;
      });
      const label = `${pageData.lines[line].short}, ${variant.words}`;
      cuts.push({ label, line, main: name === state.variant, speeds, levels: along });
    }
  }
  if (mine !== asked) return;
  draw(cuts);
  drawChips();
}

/** @param {Cut[]} cuts */
function draw(cuts) {
  const known = cuts.flatMap((cut) => cut.levels.filter((level) => level !== null));
  const highest = known.length ? Math.max(...known) : 0;
  const lowest = known.length ? Math.max(Math.min(...known), highest - DEPTH) : -1;
  /** @type {import("./plots.js").Bounds} */
  const bounds = { x: [0, state.limit], y: [lowest - 3, highest + 5] };
  const unit = state.channel === "overall" ? "µm" : "N";
  const single = state.lines.length === 1;
  const tables = cuts.map((cut) => /** @type {PlotData} */ ([cut.speeds, cut.levels]));
  const joined = tables.length ? uPlot.join(tables) : /** @type {PlotData} */ ([[0, 1]]);
  drawPlot(
    box(),
    {
      height: 230,
      padding: [12, 14, 0, 0],
      cursor: { drag: { x: true, y: true, uni: 20 }, sync: { key: "speed", scales: ["x", null] } },
      scales: { x: { time: false, range: (_, low, high) => [low, high] }, y: { range: (_, low, high) => [low, high] } },
      axes: [axisOf(`${pageData.input} speed / rpm`), { ...axisOf(`level / dB re 1 ${unit}`), size: 58 }],
      series: [
        {},
        ...cuts.map((cut, number) => ({
          label: cut.label,
          stroke: single ? curveColour(cut.main ? 0 : number + 1) : lineColour(cut.line),
          width: cut.main ? 2 : 1.2,
          dash: cut.main ? (single ? [] : dashOf(cut.line)) : [5, 4],
          spanGaps: true,
          points: { show: false },
        })),
      ],
      hooks: { draw: [paintMarks] },
    },
    joined,
    bounds,
  );
  const caption = need("cuts").querySelector(".hint");
  if (caption) caption.textContent = cuts.map((cut) => `${cut.main ? "Thick" : "Dashed"}: ${cut.label}`).join(". ");
  addTools(need("cuts").querySelector(".tools"), () => "Level along the orders", {
    rows: () => cutRows(cuts, joined),
    canvas: () => /** @type {HTMLCanvasElement} */ (box().querySelector("canvas")),
    extra: zoomButtons(box()),
  });
}

/** @param {Cut[]} cuts @param {PlotData} joined */
function cutRows(cuts, joined) {
  const head = [`${pageData.input} speed / rpm`, ...cuts.map((cut) => `${cut.label} / dB`)];
  return [head, ...Array.from(joined[0], (_, row) => joined.map((column) => column[row]))];
}

/** Rated speed and the chosen resonance. @param {Plot} plot */
function paintMarks(plot) {
  const { left, top, width, height } = plot.bbox;
  const ratio = window.devicePixelRatio || 1;
  const drawing = plot.ctx;
  drawing.save();
  drawing.beginPath();
  drawing.rect(left, top, width, height);
  drawing.clip();
  if (pageData.rated !== null) {
    const x = plot.valToPos(pageData.rated, "x", true);
    drawing.strokeStyle = pageColour("--soft");
    drawing.setLineDash([2 * ratio, 3 * ratio]);
    drawing.beginPath();
    drawing.moveTo(x, top);
    drawing.lineTo(x, top + height);
    drawing.stroke();
    drawing.fillStyle = pageColour("--soft");
    drawing.textAlign = "left";
    drawing.font = `${11 * ratio}px system-ui, sans-serif`;
    drawing.fillText("rated", x + 4 * ratio, top + height - 6 * ratio);
  }
  const own = chosenResonance();
  if (own && state.lines.includes(own.line) && state.channel === "overall") {
    drawing.setLineDash([]);
    drawing.beginPath();
    drawing.arc(plot.valToPos(own.speed, "x", true), plot.valToPos(own.level, "y", true), 5 * ratio, 0, 7);
    drawing.fillStyle = pageColour("--mark");
    drawing.fill();
  }
  drawing.restore();
}

function drawChips() {
  const chips = pageData.lines.map((line, number) => {
    const dot = make("i", { class: "dot" });
    dot.style.background = lineColour(number);
    const pressed = String(state.lines.includes(number));
    return make("button", { type: "button", "aria-pressed": pressed, click: () => toggleLine(number) }, dot, line.short);
  });
  const place = need("orders");
  const focused = [...place.children].indexOf(/** @type {Element} */ (document.activeElement));
  place.replaceChildren(...chips);
  if (focused >= 0) chips[focused]?.focus();
}

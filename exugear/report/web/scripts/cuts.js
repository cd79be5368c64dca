// Levels along the chosen orders, over the same speeds as the waterfall.
import { curveColour, pageColour } from "./colours.js";
import { make, need } from "./dom.js";
import { addTools } from "./downloads.js";
import { clipped, dashOf, lineColour, toggleLine } from "./order_lines.js";
import { pageData, unpack } from "./page_data.js";
import { axisOf, drawPlot, zoomButtons } from "./plots.js";
import { showSpeed } from "./speed_cursor.js";
import { allSpeeds, chosenGroup, chosenResonance, firstSpeeds, state } from "./state.js";

const NO_LEVEL = -32768;
/** dB below the highest level at which the diagram ends. */
const DEPTH = 70;
let asked = 0;

/** @typedef {{kind: string, label: string, line: number, main: boolean, constant: boolean, speeds: number[], levels: (number | null)[]}} Cut */
/** @typedef {{cuts: ArrayReference, speeds: ArrayReference}} Source */
/** @typedef {import("./page_data.js").ArrayReference} ArrayReference */

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
    const main = name === state.variant;
    cuts.push(...(await cutsOf(channel, { words: variant.words, main, constant: false })));
    if (main && variant.constant && state.channel === "overall")
      cuts.push(...(await cutsOf(variant.constant, { words: "constant speed", main, constant: true })));
  }
  if (mine !== asked) return;
  draw(cuts);
  drawChips();
}

/**
 * Cuts of the chosen orders from what holds levels of all.
 * @param {Source} source @param {{words: string, main: boolean, constant: boolean}} kind @returns {Promise<Cut[]>}
 */
async function cutsOf(source, kind) {
  const { words, main, constant } = kind;
  const speeds = Array.from(await unpack(source.speeds));
  const levels = await unpack(source.cuts);
  // Of the other variants only the order of the resonance, or else the first.
  const lines = kind.main ? state.lines : [chosenResonance()?.line ?? -1].filter((line) => state.lines.includes(line));
  return (lines.length ? lines : state.lines.slice(0, 1)).map((line) => {
    const along = speeds.map((_, frame) => {
      const level = levels[frame * pageData.lines.length + line];
      return level === NO_LEVEL ? null : level / 10;
    });
    return { kind: words, label: `${pageData.lines[line].short}, ${words}`, line, main, constant, speeds, levels: along };
  });
}

/** How a cut is drawn, in words and in dashes. @param {Cut} cut @returns {string} */
const styleOf = (cut) => (cut.constant ? "Dotted" : cut.main ? "Thick" : "Dashed");

/** @param {Cut} cut @param {boolean} single @returns {number[]} */
function dashesOf(cut, single) {
  if (cut.constant) return [2, 2];
  if (!cut.main) return [5, 4];
  return single ? [] : dashOf(cut.line);
}

/** @param {Cut[]} cuts */
function draw(cuts) {
  const group = chosenGroup();
  if (!group) return;
  const speeds = firstSpeeds(group);
  const inside = (/** @type {Cut} */ cut) =>
    cut.levels.filter((level, place) => level !== null && cut.speeds[place] >= speeds[0] && cut.speeds[place] <= speeds[1]);
  const known = /** @type {number[]} */ (cuts.flatMap(inside));
  const highest = known.length ? Math.max(...known) : 0;
  const lowest = known.length ? Math.max(Math.min(...known), highest - DEPTH) : -1;
  /** @type {import("./plots.js").Bounds} */
  const bounds = { x: [0, allSpeeds(group)[1]], y: [lowest - 3, highest + 5] };
  const unit = group.variants[group.main].channels.find((one) => one.name === state.channel)?.unit ?? "µm";
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
          stroke: single ? curveColour(cut.main && !cut.constant ? 0 : number + 1) : lineColour(cut.line),
          width: cut.main && !cut.constant ? 2 : 1.2,
          dash: dashesOf(cut, single),
          spanGaps: true,
          points: { show: false },
        })),
      ],
      hooks: {
        draw: [(plot) => paintLabels(plot, cuts), paintMarks],
        setCursor: [(plot) => void ((plot.cursor.left ?? -1) >= 0 && showSpeed(plot.posToVal(plot.cursor.left ?? 0, "x")))],
      },
    },
    joined,
    bounds,
    { x: speeds, y: bounds.y },
  );
  const caption = need("cuts").querySelector(".hint");
  const kinds = new Set(cuts.map((cut) => `${styleOf(cut)}: ${cut.kind}`));
  if (caption) caption.textContent = [...kinds].join(". ");
  addTools(need("cuts").querySelector(".tools"), () => "Order cuts", {
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

/** The name of each curve at its highest visible point. @param {Plot} plot @param {Cut[]} cuts */
function paintLabels(plot, cuts) {
  const { min = 0, max = 1 } = plot.scales.x;
  /** @type {[number, number, number][]} */
  const taken = [];
  clipped(plot, (drawing, ratio) => {
    drawing.font = `600 ${11 * ratio}px system-ui, sans-serif`;
    drawing.lineWidth = 3 * ratio;
    drawing.strokeStyle = pageColour("--panel");
    for (const cut of cuts.filter((own) => own.main && !own.constant)) {
      let best = -1;
      cut.levels.forEach((level, place) => {
        const seen = level !== null && cut.speeds[place] >= (min ?? 0) && cut.speeds[place] <= (max ?? 1);
        if (seen && (best < 0 || level > (cut.levels[best] ?? -Infinity))) best = place;
      });
      if (best < 0) continue;
      const words = pageData.lines[cut.line].short;
      const x = plot.valToPos(cut.speeds[best], "x", true);
      let y = plot.valToPos(cut.levels[best] ?? 0, "y", true) - 5 * ratio;
      const size = drawing.measureText(words).width;
      const left = Math.min(Math.max(x - size / 2, plot.bbox.left + 4), plot.bbox.left + plot.bbox.width - size - 4);
      y = Math.max(y, plot.bbox.top + 12 * ratio);
      while (taken.some(([a, b, w]) => left < a + w + 8 && a < left + size + 8 && Math.abs(b - y) < 13 * ratio)) y += 13 * ratio;
      taken.push([left, y, size]);
      drawing.fillStyle = state.lines.length === 1 ? curveColour(0) : lineColour(cut.line);
      drawing.textAlign = "left";
      drawing.strokeText(words, left, y);
      drawing.fillText(words, left, y);
    }
  });
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

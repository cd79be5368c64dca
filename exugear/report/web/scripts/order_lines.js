// Order lines in diagrams of speed and frequency: their colours, how they are drawn, and which are chosen.
import { familyColour, pageColour } from "./colours.js";
import { pageData } from "./page_data.js";
import { choose, chosenResonance, state } from "./state.js";

const families = [...new Set(pageData.lines.map((line) => line.family))];

/** @param {number} line @returns {string} */
export const lineColour = (line) => familyColour(families.indexOf(pageData.lines[line].family));

/** @param {number} line @returns {number[]} */
export const dashOf = (line) => [[], [7, 4], [2, 4]][pageData.lines[line].harmonic - 1] ?? [2, 6];

/** @param {Plot} plot @param {(drawing: CanvasRenderingContext2D, ratio: number) => void} paint */
export function clipped(plot, paint) {
  const { left, top, width, height } = plot.bbox;
  plot.ctx.save();
  plot.ctx.beginPath();
  plot.ctx.rect(left, top, width, height);
  plot.ctx.clip();
  paint(plot.ctx, window.devicePixelRatio || 1);
  plot.ctx.restore();
}

/** @param {Plot} plot */
export function paintLines(plot) {
  const { x: sx, y: sy } = plot.scales;
  const [low, high, top] = [sx.min ?? 0, sx.max ?? 1, sy.max ?? 1];
  /** @type {[number, number, number][]} */
  const taken = [];
  const own = chosenResonance()?.line;
  for (const line of [...state.lines].sort((a, b) => Number(b === own) - Number(a === own))) {
    const perRpm = pageData.lines[line].order / 60;
    const end = Math.min(high, top / perRpm);
    clipped(plot, (drawing, ratio) => {
      drawing.strokeStyle = lineColour(line);
      drawing.lineWidth = (line === own ? 2.2 : 1.1) * ratio;
      drawing.setLineDash(dashOf(line).map((dash) => dash * ratio));
      drawing.beginPath();
      drawing.moveTo(plot.valToPos(low, "x", true), plot.valToPos(perRpm * low, "y", true));
      drawing.lineTo(plot.valToPos(end, "x", true), plot.valToPos(perRpm * end, "y", true));
      drawing.stroke();
    });
    if (end > low && perRpm * end >= (sy.min ?? 0)) labelLine(plot, line, end, end === high, taken);
  }
}

/** @param {number} line @returns {boolean} whether it is chosen */
export const isOn = (line) => state.lines.includes(line);

/**
 * @param {Plot} plot @param {number} line @param {number} end speed at which it leaves the diagram
 * @param {boolean} atSide @param {[number, number, number][]} taken
 */
function labelLine(plot, line, end, atSide, taken) {
  const drawing = plot.ctx;
  const ratio = window.devicePixelRatio || 1;
  const { left, top, width } = plot.bbox;
  drawing.save();
  drawing.font = `${line === chosenResonance()?.line ? 700 : 500} ${11 * ratio}px system-ui, sans-serif`;
  drawing.textAlign = "left";
  drawing.textBaseline = "alphabetic";
  const words = pageData.lines[line].short;
  const size = drawing.measureText(words).width;
  const reach = left + width - size - 4 * ratio;
  const x = Math.max(left, atSide ? reach : Math.min(plot.valToPos(end, "x", true) - size / 2, reach));
  const y = atSide ? plot.valToPos((pageData.lines[line].order / 60) * end, "y", true) - 5 * ratio : top - 5 * ratio;
  const free = taken.every(([a, b, w]) => x > a + w || x + size < a || Math.abs(y - b) > 13 * ratio);
  if (free && y > 8 * ratio) {
    taken.push([x - 6 * ratio, y, size + 12 * ratio]);
    drawing.strokeStyle = pageColour("--panel");
    drawing.lineWidth = 3 * ratio;
    drawing.strokeText(words, x, y);
    drawing.fillStyle = lineColour(line);
    drawing.fillText(words, x, y);
  }
  drawing.restore();
}

/** @param {number} line */
export function toggleLine(line) {
  const lines = isOn(line) ? state.lines.filter((own) => own !== line) : [...state.lines, line];
  choose({ lines: lines.length ? lines : [line] });
}

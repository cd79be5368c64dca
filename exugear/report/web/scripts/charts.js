// Line figures: Python says what to draw, this draws it when it comes into view.
import { curveColour, pageColour } from "./colours.js";
import { find, make } from "./dom.js";
import { addTools } from "./downloads.js";
import { pageData, unpack } from "./page_data.js";
import { axisOf, drawPlot, plotIn, zoomButtons } from "./plots.js";

/** @typedef {{label: string, style: string, right: boolean, x: number[], y: (number | null)[]}} Curve */

/** Draw all line figures, each when it is near the window. */
export function beginCharts() {
  const watcher = new IntersectionObserver(
    (entries) => {
      for (const entry of entries) {
        if (!entry.isIntersecting) continue;
        watcher.unobserve(entry.target);
        void drawChart(entry.target.id);
      }
    },
    { rootMargin: "300px" },
  );
  for (const name of Object.keys(pageData.charts)) {
    const figure = find(name);
    if (figure) watcher.observe(figure);
  }
}

/** Draw those anew that were drawn, such as with other colours; before printing all of them. @param {boolean} all */
export async function redrawCharts(all) {
  const drawn = [];
  for (const name of Object.keys(pageData.charts)) {
    const box = find(name)?.querySelector(".plot");
    // What is hidden has no width; drawn all the same, it would be printed in giant letters.
    if (box?.clientWidth && (all || plotIn(box))) drawn.push(drawChart(name));
  }
  await Promise.all(drawn);
}

/** Unpack what figures are drawn of, one after the other. */
export async function unpackCharts() {
  for (const { curves } of Object.values(pageData.charts)) {
    for (const curve of curves) await Promise.all([unpack(curve.x), unpack(curve.y)]);
  }
}

/** @param {string} name */
async function drawChart(name) {
  const chart = pageData.charts[name];
  const figure = find(name);
  const box = /** @type {HTMLElement | null} */ (figure?.querySelector(".plot"));
  if (!box) return;
  const curves = await Promise.all(chart.curves.map(curveOf));
  const joined = uPlot.join(curves.map(({ x, y }) => /** @type {PlotData} */ ([x, y])));
  const bounds = { x: rangeOf(curves.map((curve) => curve.x)), y: rangeOf(curves.filter((c) => !c.right).map((c) => c.y)) };
  const padded = chart.axes[0].logarithmic ? bounds : { ...bounds, y: margin(bounds.y) };
  drawPlot(box, optionsOf(chart, curves), joined, padded);
  const words = figure?.querySelector(".words");
  if (words && !figure?.querySelector(".legend")) words.before(legendOf(curves));
  addTools(figure?.querySelector(".tools"), () => chart.title, {
    rows: () => [
      [chart.axes[0].label, ...curves.map((curve) => headingOf(chart, curve))],
      ...Array.from(joined[0], (_, row) => joined.map((column) => column[row])),
    ],
    canvas: () => /** @type {HTMLCanvasElement} */ (box.querySelector("canvas")),
    extra: chart.axes[0].logarithmic ? [] : zoomButtons(box),
  });
}

/** Heading of a column of data, with its unit. @param {import("./page_data.js").ChartData} chart @param {Curve} curve */
function headingOf(chart, curve) {
  const axis = chart.axes[curve.right ? 2 : 1].label;
  return curve.label.includes(" / ") || !axis.includes(" / ") ? curve.label : `${curve.label}, ${axis}`;
}

/** @param {import("./page_data.js").CurveData} data @returns {Promise<Curve>} */
async function curveOf(data) {
  const [x, y] = [Array.from(await unpack(data.x)), Array.from(await unpack(data.y))];
  // uPlot wants its first column to rise.
  const order = x.map((_, place) => place).sort((a, b) => x[a] - x[b]);
  return {
    ...data,
    x: order.map((place) => x[place]),
    y: order.map((place) => (Number.isFinite(y[place]) ? y[place] : null)),
  };
}

/** @param {(number | null)[][]} columns @returns {[number, number]} */
function rangeOf(columns) {
  const known = columns.flat().filter((value) => value !== null);
  if (!known.length) return [0, 1];
  let [low, high] = [Infinity, -Infinity];
  for (const value of known) {
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low === high) return [low - 0.5, high + 0.5];
  // What changes by less than a hundredth is to look as if it stood still.
  const lacking = 0.01 * Math.max(Math.abs(low), Math.abs(high)) - (high - low);
  return lacking > 0 ? [low - lacking / 2, high + lacking / 2] : [low, high];
}

/** @param {[number, number]} range @returns {[number, number]} */
const margin = ([low, high]) => [low - 0.05 * (high - low), high + 0.05 * (high - low)];

/** @param {import("./page_data.js").ChartData} chart @param {Curve[]} curves @returns {PlotOptions} */
function optionsOf(chart, curves) {
  const [below, left, right] = chart.axes;
  const axes = [axisOf(below.label), { ...axisOf(left.label), size: 58 }];
  if (right) axes.push({ ...axisOf(right.label), scale: "right", side: 1, size: 52, grid: { show: false } });
  const rightRange = rangeOf(curves.filter((curve) => curve.right).map((curve) => curve.y));
  return {
    height: 250,
    padding: [12, right ? 0 : 14, 0, 0],
    cursor: { drag: { x: true, y: true, uni: 20 } },
    scales: {
      x: { time: false, distr: below.logarithmic ? 3 : 1, range: (_, low, high) => [low, high] },
      y: { range: (_, low, high) => [low, high] },
      right: { range: () => [0, Math.max(1e-9, 1.08 * rightRange[1])] },
    },
    axes,
    series: [
      {},
      ...curves.map((curve, number) => ({
        label: curve.label,
        scale: curve.right ? "right" : "y",
        stroke: colourOf(curves, number),
        width: curve.style === "points" ? 0 : curve.style === "thin" ? 1 : 2,
        dash: curve.style === "dashed" ? [6, 4] : [],
        spanGaps: true,
        points: { show: curve.style === "points" || curve.x.length < 3, size: 6, fill: colourOf(curves, number) },
      })),
    ],
    hooks: { draw: [(plot) => paintMarks(plot, chart)] },
  };
}

/** @param {Plot} plot @param {import("./page_data.js").ChartData} chart */
function paintMarks(plot, chart) {
  const { top, height } = plot.bbox;
  const ratio = window.devicePixelRatio || 1;
  for (const mark of chart.marks) {
    const x = plot.valToPos(mark.x, "x", true);
    plot.ctx.save();
    plot.ctx.strokeStyle = pageColour("--soft");
    plot.ctx.setLineDash([2 * ratio, 3 * ratio]);
    plot.ctx.beginPath();
    plot.ctx.moveTo(x, top);
    plot.ctx.lineTo(x, top + height);
    plot.ctx.stroke();
    plot.ctx.restore();
  }
}

/** @param {Curve[]} curves */
function legendOf(curves) {
  const legend = make("p", { class: "legend" });
  // Many lines are of one kind: the first of each is told.
  const told = curves.filter((curve, place) => firstOfKind(curves, curve) === place);
  for (const curve of told) {
    const sign = make("i", { class: `sign ${curve.style}` });
    sign.style.borderColor = colourOf(curves, curves.indexOf(curve));
    legend.append(make("span", {}, sign, kindOf(curve)));
  }
  return legend;
}

/**
 * A colour for each kind of curve; thin ones are told apart only if there are several kinds of them.
 * @param {Curve[]} curves
 * @param {number} number
 */
function colourOf(curves, number) {
  const kinds = [...new Set(curves.map(kindOf))];
  const thin = new Set(curves.filter((curve) => curve.style === "thin").map(kindOf));
  const curve = curves[number];
  return curve.style === "thin" && thin.size < 2 ? pageColour("--soft") : curveColour(kinds.indexOf(kindOf(curve)));
}

/** @param {Curve} curve */
const kindOf = (curve) => curve.label.split(/: (?:mode|part) /)[0];

/** Place of the first curve of the same kind; a kind has one colour. @param {Curve[]} curves @param {Curve} curve */
const firstOfKind = (curves, curve) => curves.findIndex((own) => kindOf(own) === kindOf(curve));

// The Campbell diagram of the page `edit`: modes as horizontal lines, mesh orders as rays, and their crossings.
import { curveColour, pageColour } from "./colours.js";
import { make } from "./dom.js";
import { figureText } from "./numbers.js";
import { axisOf, drawPlot } from "./plots.js";

/** @typedef {{modes: {mode: number, frequency: number, weight: number}[], orders: Record<string, number>, fastest: number, top: number, range: [number, number] | null, rated: number | null}} Campbell */

/** Dashes of the harmonics of a mesh. */
const DASHES = [[], [7, 4], [2, 4]];
/** Distance in pixels at which a click chooses a mode. */
const NEAR = 12;

/** @param {string} name such as "2 × sun_planet" @returns {{family: string, harmonic: number}} */
function orderOf(name) {
  const found = /^(\d+) × (.*)$/.exec(name);
  return found ? { family: found[2], harmonic: Number(found[1]) } : { family: name, harmonic: 1 };
}

/**
 * @param {HTMLElement} figure
 * @param {Campbell} data
 * @param {number} chosen mode
 * @param {(mode: number) => void} choose
 */
export function drawCampbell(figure, data, chosen, choose) {
  const box = /** @type {HTMLElement} */ (figure.querySelector(".plot"));
  const names = Object.keys(data.orders);
  const families = [...new Set(names.map((name) => orderOf(name).family))];
  const colourOf = (/** @type {string} */ name) => curveColour(families.indexOf(orderOf(name).family));
  const ends = { x: /** @type {[number, number]} */ ([0, data.fastest]), y: /** @type {[number, number]} */ ([0, data.top]) };
  const plot = drawPlot(
    box,
    {
      height: 300,
      padding: [10, 24, 0, 0],
      cursor: { drag: { x: true, y: true, uni: 20 } },
      scales: { x: { time: false, range: (_, low, high) => [low, high] }, y: { range: (_, low, high) => [low, high] } },
      axes: [axisOf("Input speed / rpm"), { ...axisOf("Frequency / Hz"), size: 58 }],
      series: [
        {},
        ...names.map((name) => ({
          label: name,
          stroke: colourOf(name),
          width: 1.5,
          dash: DASHES[Math.min(orderOf(name).harmonic, DASHES.length) - 1],
          points: { show: false },
        })),
      ],
      hooks: { drawAxes: [(own) => drawModes(own, data, chosen)], draw: [(own) => drawCrossings(own, data, colourOf)] },
    },
    [[0, data.fastest], ...names.map((name) => [0, (data.orders[name] * data.fastest) / 60])],
    ends,
  );
  chooseByClick(plot, data, choose);
  const words = /** @type {HTMLElement} */ (figure.querySelector(".words"));
  words.textContent = `${data.modes.length} modes with a share in the overall transmission error, up to ${figureText(data.top)} Hz.`;
  figure.querySelector(".legend")?.remove();
  words.before(legendOf(families, data.range !== null));
}

/** @param {Plot} plot @param {Campbell} data @param {number} chosen */
function drawModes(plot, data, chosen) {
  const { left, top, width, height } = plot.bbox;
  const { ctx } = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(left, top, width, height);
  ctx.clip();
  if (data.range) {
    const [low, high] = data.range.map((speed) => plot.valToPos(speed, "x", true));
    ctx.fillStyle = pageColour("--good-soft");
    ctx.fillRect(low, top, high - low, height);
  }
  for (const { mode, frequency } of data.modes) {
    const y = plot.valToPos(frequency, "y", true);
    ctx.strokeStyle = pageColour(mode === chosen ? "--bad" : "--soft");
    ctx.globalAlpha = mode === chosen ? 1 : 0.55;
    ctx.lineWidth = (mode === chosen ? 2.5 : 1) * devicePixelRatio;
    ctx.beginPath();
    ctx.moveTo(left, y);
    ctx.lineTo(left + width, y);
    ctx.stroke();
  }
  ctx.restore();
}

/** @param {Plot} plot @param {Campbell} data @param {(name: string) => string} colourOf */
function drawCrossings(plot, data, colourOf) {
  const { ctx } = plot;
  const { left, top, width, height } = plot.bbox;
  ctx.save();
  ctx.beginPath();
  ctx.rect(left, top, width, height);
  ctx.clip();
  for (const [name, order] of Object.entries(data.orders)) {
    ctx.fillStyle = colourOf(name);
    for (const { frequency, weight } of data.modes) {
      const speed = (60 * frequency) / order;
      if (speed > data.fastest) continue;
      ctx.beginPath();
      ctx.arc(plot.valToPos(speed, "x", true), plot.valToPos(frequency, "y", true), (2 + 4 * weight) * devicePixelRatio, 0, 7);
      ctx.fill();
    }
  }
  ctx.restore();
}

/** @param {Plot} plot @param {Campbell} data @param {(mode: number) => void} choose */
function chooseByClick(plot, data, choose) {
  let began = [0, 0];
  plot.over.addEventListener("pointerdown", (event) => (began = [event.clientX, event.clientY]));
  plot.over.addEventListener("click", (event) => {
    if (Math.hypot(event.clientX - began[0], event.clientY - began[1]) > 4) return;
    const y = event.clientY - plot.over.getBoundingClientRect().top;
    const away = data.modes.map(({ frequency }) => Math.abs(plot.valToPos(frequency, "y") - y));
    const nearest = away.indexOf(Math.min(...away));
    if (away[nearest] < NEAR) choose(data.modes[nearest].mode);
  });
}

/** @param {string[]} families @param {boolean} range whether there is an operating range */
function legendOf(families, range) {
  const legend = make("p", { class: "legend" });
  families.forEach((family, number) => {
    const sign = make("i", { class: "sign" });
    sign.style.borderColor = curveColour(number);
    legend.append(make("span", {}, sign, family.replaceAll("_", " ")));
  });
  legend.append(make("span", {}, `Dashed and dotted lines are the 2nd and 3rd harmonics. Points grow with the share of a mode in the transmission error.${range ? " The operating range is shaded." : ""}`));
  return legend;
}

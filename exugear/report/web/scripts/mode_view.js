// The figure in which the chosen mode moves, with its controls.
import { find, make, need } from "./dom.js";
import { addTools } from "./downloads.js";
import { figureText } from "./numbers.js";
import { pageData } from "./page_data.js";
import { Stage } from "./stage.js";
import { state } from "./state.js";

/** @type {Stage | null} */
let stage = null;

/** The stage, if this browser can draw it. */
export const shownStage = () => stage;

/** Begin: without WebGL the words stand alone. */
export function beginModeView() {
  const canvas = /** @type {HTMLCanvasElement | null} */ (find("view-3d"));
  if (!canvas) return;
  try {
    stage = new Stage(canvas, /** @type {HTMLCanvasElement} */ (need("marks")));
  } catch {
    need("no-gl").hidden = false;
    canvas.hidden = true;
    return;
  }
  const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  setPlaying(!still);
  need("play").addEventListener("click", () => setPlaying(!stage?.playing));
  need("amplitude").addEventListener("input", (event) => {
    if (!stage) return;
    stage.amplitude = Number(/** @type {HTMLInputElement} */ (event.target).value);
    stage.place(stage.angle);
    stage.draw();
  });
  need("by-body").addEventListener("change", (event) => {
    if (!stage) return;
    stage.byBody = /** @type {HTMLInputElement} */ (event.target).checked;
    stage.colour();
    stage.draw();
  });
  need("labels").addEventListener("change", (event) => {
    if (!stage) return;
    stage.labelled = /** @type {HTMLInputElement} */ (event.target).checked;
    stage.draw();
  });
  need("at-rest").addEventListener("change", (event) => {
    stage?.showRest(/** @type {HTMLInputElement} */ (event.target).checked);
  });
  need("views").addEventListener("click", (event) => {
    const look = event.target instanceof HTMLElement ? event.target.dataset.look : undefined;
    if (!look || !stage) return;
    stage.lookFrom(look.split(" ").map(Number));
    stage.draw();
  });
  window.addEventListener("beforeprint", keepStill);
}

/** @param {boolean} on */
function setPlaying(on) {
  stage?.setPlaying(on);
  const button = need("play");
  button.textContent = on ? "Pause" : "Play";
  button.setAttribute("aria-pressed", String(on));
}

/** Paper shows a picture: what WebGL drew prints cropped. */
function keepStill() {
  if (!stage) return;
  stage.place(0);
  stage.draw();
  /** @type {HTMLImageElement} */ (need("still")).src = pictureOf(stage).toDataURL();
}

/** Bodies with their marks. @param {Stage} current @returns {HTMLCanvasElement} */
function pictureOf({ canvas, marks }) {
  const picture = make("canvas");
  [picture.width, picture.height] = [canvas.width, canvas.height];
  const drawing = picture.getContext("2d");
  for (const layer of [canvas, marks]) drawing?.drawImage(layer, 0, 0, picture.width, picture.height);
  return picture;
}

/** Show the chosen mode of the chosen model. */
export async function drawMode() {
  const model = pageData.models[state.model];
  const title = find("mode-title");
  if (!model || !title) return;
  const mode = model.modes[state.mode];
  title.textContent = mode ? (mode.title ?? `Mode ${state.mode + 1} at ${mode.frequency.toFixed(1)} Hz`) : "No matching mode";
  if (!stage) return;
  stage.canvas.setAttribute("aria-label", mode ? `Mode at ${figureText(mode.frequency, 5)} Hz: ${mode.words}` : "At rest");
  const current = stage;
  await current.show(model.stage, state.mode);
  drawBodies(current);
  addTools(need("mode-tools"), () => title.textContent ?? "Mode", {
    rows: motionRows,
    canvas: () => pictureOf(current),
    extra: [make("button", { type: "button", "aria-label": "Reset view", click: () => lookAgain(current) }, "⤢")],
  });
}

/** Show bodies whose modes are not known yet. @param {import("./page_data.js").StageData} data */
export async function drawAtRest(data) {
  if (!stage) return;
  await stage.show(data, -1);
  drawBodies(stage);
}

/** @param {Stage} current */
function lookAgain(current) {
  current.lookFrom([0.75, 0.45, -1]);
  current.draw();
}

/** Chips that hide bodies. @param {Stage} current */
function drawBodies(current) {
  const place = need("bodies");
  const owners = current.actors.filter((actor) => actor.data.owner === actor.data.name);
  const chips = owners.map(({ data }) => {
    const dot = make("i", { class: "dot" });
    dot.style.background = data.colour;
    const chip = make("button", { type: "button", "aria-pressed": String(!current.hidden.has(data.name)) }, dot, data.label);
    chip.addEventListener("click", () => {
      if (!current.hidden.delete(data.name)) current.hidden.add(data.name);
      chip.setAttribute("aria-pressed", String(!current.hidden.has(data.name)));
      current.place(current.angle);
      current.draw();
    });
    return chip;
  });
  place.replaceChildren(...chips);
}

/** Rows of how bodies move as a whole: the largest displacement of any point is 1 m, and reached at the time 0. */
function motionRows() {
  const axes = ["x / m", "y / m", "z / m", "about x / rad", "about y / rad", "about z / rad"];
  const head = ["body", ...axes, ...axes.map((axis) => `imaginary part, ${axis}`)];
  const current = stage;
  if (!current) return [head];
  return [head, ...current.actors.map(({ data }, n) => [data.label, ...current.motionOf(n, 0), ...current.motionOf(n, 1)])];
}

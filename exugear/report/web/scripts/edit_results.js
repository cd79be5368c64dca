// What the program makes of the text: verdict, messages, tables, Campbell diagram and picture, each as soon as it is known.
import { drawCampbell } from "./edit_campbell.js";
import { make, need } from "./dom.js";
import { drawAtRest, drawMode, shownStage } from "./mode_view.js";
import { addArrays, pageData } from "./page_data.js";
import { choose, state } from "./state.js";

/** @typedef {{head: string[], texts: boolean[], rows: {key: string, cells: string[]}[], legend: string}} TableData */
/** @typedef {{key: string, bodies: string[], places: number[][], half: number}} PartData */
/** @typedef {import("./edit_text.js").Remark} Remark */

const MODEL = "live";
/** Bodies drawn in the colour of selection, and rings, are for these tables of the file. */
const PICKED = ["gears", "bearings", "bodies"];

/** @type {{parts: PartData[], remarks: Remark[], campbell: import("./edit_campbell.js").Campbell | null, first: number}} */
export const shown = { parts: [], remarks: [], campbell: null, first: -1 };

/** Bodies of the picture. @type {import("./page_data.js").StageData | undefined} */
let bodies;

/** Time (ms) after which results of an earlier state become grey: most are new before, and nothing flickers. */
const LATE = 300;
let late = 0;

/** Mark results as those of an earlier state of the text, or as current. @param {string[]} steps @param {boolean} old */
export function setOld(steps, old) {
  for (const step of steps) {
    for (const part of document.querySelectorAll(`[data-step=${step}]`)) {
      part.classList.toggle("old", old);
      part.setAttribute("aria-busy", String(old));
    }
  }
  // A timer, since a delayed transition keeps the browser drawing.
  const root = document.documentElement;
  if (old && !late) late = setTimeout(() => root.setAttribute("data-late", ""), LATE);
  if (old || document.querySelector("[data-step].old")) return;
  clearTimeout(late);
  late = 0;
  root.removeAttribute("data-late");
}

/** @param {string} words @param {"good" | "bad" | "mind" | ""} kind */
export function tellVerdict(words, kind) {
  const verdict = need("verdict");
  verdict.textContent = words;
  verdict.className = kind;
}

/** @param {any} step @param {(key: string) => void} goTo place of a key in the text */
export function showCheck(step, goTo) {
  shown.remarks = step.remarks;
  if (!step.ok) return;
  shown.parts = step.parts;
  need("gearbox-name").textContent = step.name;
  for (const [name, table] of Object.entries(step.tables)) fillTable(name, table, goTo);
  setOld(["check"], false);
}

/** @param {any} step @param {(key: string) => void} goTo */
export function showLoads(step, goTo) {
  shown.remarks = [...shown.remarks, ...step.remarks];
  for (const [name, table] of Object.entries(step.tables)) fillTable(name, table, goTo);
  const lack = need("unavailable");
  lack.textContent = step.unavailable && `No bearing loads and misalignment: ${step.unavailable}`;
  lack.hidden = !step.unavailable;
  setOld(["loads"], false);
}

/** @param {any} step */
export async function showPicture(step) {
  addArrays(step.arrays);
  // The same bodies go on moving as before until their new modes are known.
  if (bodies?.geometry !== step.geometry) await drawAtRest((bodies = { ...step.stage, geometry: step.geometry }));
  setOld(["picture"], false);
}

/** @param {any} step */
export function showDynamics(step) {
  shown.remarks = [...shown.remarks, ...step.remarks];
  if (step.failed) return;
  need("model").textContent = `Model: ${step.model}.`;
  shown.campbell = step.campbell;
  shown.first = step.first;
  showCampbell();
  setOld(["dynamics"], false);
}

/** @param {any} step */
export async function showShapes(step) {
  addArrays(step.arrays);
  fillTable("modes", step.tables.modes, (key) => chooseMode(Number(key)));
  /** @type {import("./page_data.js").ModeData[]} */
  const modes = [];
  for (const { key, cells } of step.tables.modes.rows) {
    const title = `Mode ${cells[0]} at ${cells[1]} Hz: ${cells[3]}`;
    modes[Number(key)] = { frequency: Number(cells[1]), damping: 0, words: cells[3], title };
  }
  pageData.models[MODEL] = { words: "", variant: "", stage: { ...bodies, ...step.stage }, modes };
  // A mode that was chosen stays, by its number.
  if (!modes[state.mode]) {
    choose({ model: MODEL, mode: shown.first });
    showCampbell();
  }
  markChosenMode();
  await drawMode();
  setOld(["shapes"], false);
}

/** Name of the bodies that the page has. */
export const shownGeometry = () => bodies?.geometry ?? "";

/** @param {number} mode from 0 */
export function chooseMode(mode) {
  choose({ model: MODEL, mode });
  showCampbell();
  void drawMode();
}

export function showCampbell() {
  need("mode-number").textContent = state.mode < 0 ? "" : `Mode ${state.mode + 1}`;
  if (shown.campbell) drawCampbell(need("campbell"), shown.campbell, state.mode, chooseMode);
  markChosenMode();
}

function markChosenMode() {
  for (const row of document.querySelectorAll("#table-modes tbody tr")) {
    row.classList.toggle("chosen", row instanceof HTMLElement && row.dataset.key === String(state.mode));
  }
}

/** @param {number} by */
export function stepMode(by) {
  const places = [...document.querySelectorAll("#table-modes tbody tr")].map((row) => Number(/** @type {HTMLElement} */ (row).dataset.key));
  if (places.length) chooseMode(places[(places.indexOf(state.mode) + by + places.length) % places.length]);
}

/** @param {string} name @param {any} data @param {(key: string) => void} act on the key of a row */
function fillTable(name, data, act) {
  const place = document.getElementById(`table-${name}`);
  if (!place) return;
  const { head, texts, rows, legend } = /** @type {TableData} */ (data);
  const box = /** @type {HTMLElement} */ (place.closest(".of-table-data"));
  box.hidden = !rows.length;
  const kind = (/** @type {number} */ n) => (texts[n] ? "text" : "");
  const cellsOf = (/** @type {{key: string, cells: string[]}} */ { key, cells }) =>
    cells.map((cell, n) => {
      if (n || !key) return make("td", { class: kind(n) }, cell);
      return make("td", { class: kind(n) }, make("button", { type: "button", class: "choice", click: () => act(key) }, cell));
    });
  place.replaceChildren(
    make("thead", {}, make("tr", {}, ...head.map((text, n) => make("th", { scope: "col", class: kind(n) }, text)))),
    make("tbody", {}, ...rows.map((row) => make("tr", { "data-key": row.key }, ...cellsOf(row)))),
  );
  const note = /** @type {HTMLElement} */ (box.querySelector(".note"));
  note.textContent = legend;
  note.hidden = !legend;
}

/** @type {PartData | undefined} */
let pointed;

/** Point out in the picture what a key of the text is about. @param {string} key */
export function pointOut(key) {
  const part = shown.parts.find((one) => key === one.key || key.startsWith(`${one.key}.`));
  // A picture takes a moment to draw on machines without graphics.
  if (part === pointed) return;
  pointed = part;
  const flagged = part && !part.key.startsWith("bodies.");
  const [, name] = part?.key.split(".") ?? [];
  const flags = part && flagged ? part.places.map((at) => ({ text: name, at })) : [];
  shownStage()?.mark(new Set(part?.bodies ?? []), flags);
  for (const row of document.querySelectorAll("[data-step=check] tr[data-key], #table-bearings tr, #table-meshes tr")) {
    row.classList.toggle("chosen", Boolean(part) && row instanceof HTMLElement && row.dataset.key === part?.key);
  }
}

/**
 * Key of what stands at a point of a body: gear, bearing, or else the body itself.
 * @param {string} body @param {number[]} point m @returns {string | null}
 */
export function keyAt(body, point) {
  for (const kind of PICKED) {
    for (const part of shown.parts.filter(({ key }) => key.startsWith(`${kind}.`))) {
      const inside = part.places.some((at, n) => part.bodies[n] === body && (kind === "bodies" || Math.abs(at[2] - point[2]) <= part.half));
      if (inside) return part.key;
    }
  }
  return null;
}

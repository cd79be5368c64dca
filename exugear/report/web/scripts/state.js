// What is chosen on the page. It stands in the address, so that a view can be sent on.
import { pageData } from "./page_data.js";

/** @typedef {{group: string, variant: string, view: string, channel: string, resonance: number, model: string, mode: number, lines: number[], extent: string}} State */

/** Which resonances are listed and circled. */
const EXTENTS = ["first", "range", "all"];
/** Number of resonances of the shortest list. */
const FIRST = 10;

/** @type {State} */
export const state = {
  group: "",
  variant: "",
  view: "",
  channel: "overall",
  resonance: 0,
  model: "",
  mode: -1,
  lines: [],
  extent: "first",
};

/** Stands for the first resonance of the list: no place, so that it falls back to it. */
const LOUDEST = -2;

/** @type {((changed: Set<string>) => void)[]} */
const listeners = [];

/** @param {(changed: Set<string>) => void} listener told what changed */
export const onChange = (listener) => void listeners.push(listener);

/** @returns {import("./page_data.js").GroupData | undefined} */
export const chosenGroup = () => pageData.groups.find((group) => group.name === state.group);

/** @returns {import("./page_data.js").VariantData | undefined} */
export const chosenVariant = () => chosenGroup()?.variants[state.variant];

/** @returns {import("./page_data.js").Resonance | undefined} */
export const chosenResonance = () => chosenVariant()?.resonances[state.resonance];

/** @param {import("./page_data.js").GroupData} group @returns {[number, number]} all of its speeds, rpm */
export function allSpeeds(group) {
  const ends = Object.values(group.variants).map((variant) => variant.channels[0].knots[0]);
  return [Math.min(...ends.map((own) => own[0])), Math.max(...ends.map((own) => own[own.length - 1]))];
}

/** @param {import("./page_data.js").GroupData} group @returns {[number, number]} speeds that are shown first, rpm */
export function firstSpeeds(group) {
  const [low, high] = allSpeeds(group);
  if (!group.range || state.extent === "all") return [low, high];
  const ends = [Math.max(low, 0.8 * group.range[0]), Math.min(high, 1.15 * group.range[1])];
  return ends[0] < ends[1] ? [ends[0], ends[1]] : [low, high];
}

/** Whether a resonance of the list is shown. @param {boolean} inside @param {number} place @returns {boolean} */
export const isShown = (inside, place) => state.extent === "all" || (inside && (state.extent === "range" || place < FIRST));

/** Resonances that are shown, with their places. */
export const shownResonances = () =>
  (chosenVariant()?.resonances ?? []).map((own, place) => ({ own, place })).filter(({ own, place }) => isShown(own.inside, place));

/**
 * Choose something; what does not fit falls back to what does.
 * @param {Partial<State>} choice
 */
export function choose(choice) {
  const before = { ...state, lines: [...state.lines] };
  Object.assign(state, choice);
  mend(choice);
  /** @type {Set<string>} */
  const changed = new Set();
  for (const key of /** @type {(keyof State)[]} */ (Object.keys(state))) {
    if (String(state[key]) !== String(before[key])) changed.add(key);
  }
  if (!changed.size) return;
  remember();
  for (const listener of listeners) listener(changed);
}

/** @param {Partial<State>} choice */
function mend(choice) {
  const group = chosenGroup() ?? pageData.groups[0];
  if (group) mendRuns(group, choice);
  const models = Object.keys(pageData.models);
  if (!pageData.models[state.model]) state.model = models[0] ?? "";
  const count = pageData.models[state.model]?.modes.length ?? 0;
  if (!(state.mode >= -1 && state.mode < count)) state.mode = -1;
}

/** @param {import("./page_data.js").GroupData} group @param {Partial<State>} choice */
function mendRuns(group, choice) {
  state.group = group.name;
  if (!group.variants[state.variant]) state.variant = group.main;
  const variant = group.variants[state.variant];
  if (!(state.view === "difference" && Object.keys(group.variants).length > 1)) state.view = "variant";
  const channels = variant.channels.map((channel) => channel.name);
  if (state.view === "difference" || !channels.includes(state.channel)) state.channel = "overall";
  const count = variant.resonances.length;
  if (!(Number.isInteger(state.resonance) && state.resonance >= -1 && state.resonance < count)) {
    state.resonance = variant.first;
  }
  if (!count) state.resonance = -1;
  if (!EXTENTS.includes(state.extent)) state.extent = EXTENTS[0];
  const chosen = variant.resonances[state.resonance];
  // What is chosen is listed, too.
  if (chosen && !isShown(chosen.inside, state.resonance)) state.extent = chosen.inside ? "range" : "all";
  state.lines = state.lines.filter((line) => pageData.lines[line]);
  const moved = "resonance" in choice || "variant" in choice || "group" in choice;
  if (moved) followResonance(variant, choice);
  if (!state.lines.length && pageData.lines.length) state.lines = [0];
}

/** Choose the loudest resonance of what is chosen otherwise. @param {Partial<State>} choice */
export const chooseLoudest = (choice) => choose({ ...choice, resonance: LOUDEST });

/**
 * A resonance brings its mode and its order along.
 * @param {import("./page_data.js").VariantData} variant
 * @param {Partial<State>} choice
 */
function followResonance(variant, choice) {
  if (!("model" in choice)) state.model = variant.model;
  const own = variant.resonances[state.resonance];
  if (!own) return;
  if (!("mode" in choice)) state.mode = own.mode ?? -1;
  // One order of each mesh, and that of the resonance.
  if (!("lines" in choice)) state.lines = [...new Set([...firstHarmonics(), own.line])].filter((line) => line >= 0);
}

/** @returns {number[]} the mesh orders among the orders */
export const firstHarmonics = () => pageData.lines.flatMap((line, place) => (line.harmonic === 1 ? [place] : []));

function remember() {
  const kept = new URLSearchParams();
  for (const [key, value] of Object.entries(state)) kept.set(key, String(value));
  try {
    history.replaceState(null, "", `#${kept}`);
  } catch {
    // Some viewers of files forbid it; the page works without.
  }
}

/** Begin with what the address says; it may be old, cut, or of another gearbox. */
export function recall() {
  /** @type {Partial<State>} */
  const told = {};
  const given = new URLSearchParams(location.hash.slice(1));
  for (const key of /** @type {const} */ (["group", "variant", "view", "channel", "model", "extent"])) {
    const value = given.get(key);
    if (value) told[key] = value;
  }
  for (const key of /** @type {const} */ (["resonance", "mode"])) {
    const value = given.get(key);
    if (value !== null && value !== "" && Number.isFinite(Number(value))) told[key] = Number(value);
  }
  const lines = given.get("lines");
  if (lines) told.lines = lines.split(",").map(Number);
  choose({ group: pageData.groups[0]?.name ?? "", variant: "", resonance: LOUDEST, ...told });
}

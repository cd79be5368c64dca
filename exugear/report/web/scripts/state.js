// What is chosen on the page. It stands in the address, so that a view can be sent on.
import { pageData } from "./page_data.js";

/** @typedef {{group: string, variant: string, view: string, channel: string, resonance: number, model: string, mode: number, lines: number[], limit: number}} State */

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
  limit: 0,
};

/** Stands for the first resonance of the ranking: no place, so that it falls back to it. */
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

/** @param {import("./page_data.js").GroupData | undefined} group @returns {number} highest speed of its run-ups, rpm */
export function fastest(group) {
  if (!group) return 0;
  return Math.ceil(Math.max(...Object.values(group.variants).map((variant) => variant.channels[0].span[1])));
}

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
  const top = fastest(group);
  if (!(state.limit > 0 && state.limit <= top)) state.limit = top;
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
  // The first resonance of the ranking may be no peak of the transmission error: its mode and order are shown then.
  const own = variant.resonances[state.resonance] ?? (state.resonance === -1 ? variant.leading : null);
  if (!own) return;
  if (!("mode" in choice)) state.mode = own.mode ?? -1;
  if (!("lines" in choice)) state.lines = [own.line];
}

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
  for (const key of /** @type {const} */ (["group", "variant", "view", "channel", "model"])) {
    const value = given.get(key);
    if (value) told[key] = value;
  }
  for (const key of /** @type {const} */ (["resonance", "mode", "limit"])) {
    const value = given.get(key);
    if (value !== null && value !== "" && Number.isFinite(Number(value))) told[key] = Number(value);
  }
  const lines = given.get("lines");
  if (lines) told.lines = lines.split(",").map(Number);
  choose({ group: pageData.groups[0]?.name ?? "", variant: "", resonance: LOUDEST, ...told });
}

// The chosen resonance in words that Python wrote.
import { make, need } from "./dom.js";
import { figureText } from "./numbers.js";
import { pageData } from "./page_data.js";
import { choose, chosenResonance, chosenVariant, state } from "./state.js";

/** Show the chosen resonance, or the mode that was chosen without one. */
export function drawDetail() {
  const own = chosenResonance();
  const variant = chosenVariant();
  const place = need("detail");
  if (!own || !variant) {
    place.replaceChildren(...modeWords());
    return;
  }
  const step = make(
    "div",
    { class: "tools" },
    make("button", { type: "button", "aria-label": "Previous resonance", click: () => move(-1) }, "‹"),
    make("button", { type: "button", "aria-label": "Next resonance", click: () => move(1) }, "›"),
  );
  const where = `${own.tolerance === null ? "" : `± ${figureText(own.tolerance)} Hz `}at ${figureText(own.speed, 4)} rpm`;
  const rank = make("span", { class: "tag plain" }, `No. ${state.resonance + 1} of ${variant.resonances.length}`);
  const outside = own.inside ? [] : [make("span", { class: "tag mind" }, "outside the operating range")];
  const heading = make("h3", {}, `${figureText(own.frequency, 4)} Hz `, make("small", {}, where));
  const facts = make("dl", { class: "facts" });
  for (const [term, words] of own.facts) facts.append(make("dt", {}, term), make("dd", {}, words));
  const caveats = own.caveats.map((words) => make("p", { class: "caveat-words" }, make("span", { class: "caveat" }), ` ${words}`));
  place.replaceChildren(step, heading, make("p", {}, rank, ...outside, ` ${variant.words}`), ...caveats, facts);
}

function modeWords() {
  const model = pageData.models[state.model];
  const mode = model?.modes[state.mode];
  if (!model || !mode) return [make("p", {}, "No resonance found.")];
  return [
    make("h3", {}, `Mode at ${figureText(mode.frequency, 5)} Hz`),
    make("p", {}, `${model.words}: ${mode.words}; damping ${figureText(100 * mode.damping, 2)} %.`),
  ];
}

/** @param {number} by */
function move(by) {
  const count = chosenVariant()?.resonances.length ?? 0;
  if (count) choose({ resonance: (state.resonance + by + count) % count });
}

// Choices of the whole page: load, inertia set, variant, signal; table of contents; link, print and data.
import { find, make, need, say } from "./dom.js";
import { saveJson } from "./downloads.js";
import { pageData } from "./page_data.js";
import { choose, chooseLoudest, chosenGroup, chosenVariant, state } from "./state.js";

/** @param {string} id @returns {HTMLSelectElement} */
const box = (id) => /** @type {HTMLSelectElement} */ (need(id));

/**
 * Fill a selection; one that has a single entry is no choice.
 * @param {string} id @param {[string, string][]} entries values and words @param {string} current
 */
function fill(id, entries, current) {
  const select = box(id);
  const known = [...new Map(entries)];
  select.replaceChildren(...known.map(([value, words]) => make("option", { value }, words)));
  select.value = current;
  const label = select.closest("label");
  if (label) label.hidden = known.length < 2;
}

/** Fill what is chosen among. */
export function drawSwitches() {
  const group = chosenGroup();
  const variant = chosenVariant();
  if (!group || !variant) return;
  const { groups } = pageData;
  fill("load", groups.map((own) => [own.words, own.words]), group.words);
  fill("inertias", groups.map((own) => [own.inertias, own.inertias]), group.inertias);
  fill("variant", Object.entries(group.variants).map(([name, own]) => [name, sentenceCase(own.words)]), state.variant);
  fill("channel", variant.channels.map((own) => [own.name, own.words]), state.channel);
  need("extent").hidden = false;
  box("extent").value = state.extent;
  const other = Object.keys(group.variants).find((name) => name !== state.variant);
  const difference = need("difference-label");
  difference.hidden = other === undefined;
  const words = difference.querySelector("span");
  if (words && other) words.textContent = `difference from ${group.variants[other].words}`;
  /** @type {HTMLInputElement} */ (need("difference")).checked = state.view === "difference";
}

/** @param {string} words */
const sentenceCase = (words) => words.charAt(0).toUpperCase() + words.slice(1);

/** Show what belongs to the chosen result; models without a result are always shown. */
export function showChosen() {
  const variants = pageData.groups.flatMap((group) => Object.values(group.variants));
  const models = new Set(variants.map((variant) => variant.model));
  const chosen = chosenVariant()?.model;
  for (const part of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-group], [data-model]"))) {
    const { group, variant, model } = part.dataset;
    const other =
      model === undefined
        ? group !== state.group || (variant !== undefined && variant !== state.variant)
        : models.has(model) && model !== chosen;
    part.classList.toggle("other", other);
  }
}

/** The result with a load and an inertia set, or with the one that was just chosen. @param {"words" | "inertias"} key @param {string} value */
function selectGroup(key, value) {
  const before = chosenGroup();
  const fits = pageData.groups.filter((group) => group[key] === value);
  const rest = key === "words" ? "inertias" : "words";
  const group = fits.find((own) => before && own[rest] === before[rest]) ?? fits[0];
  if (group) chooseLoudest({ group: group.name });
}

/** Begin what never changes. */
export function beginSwitches() {
  /** @type {[string, (value: string) => void][]} */
  const selections = [
    ["load", (value) => selectGroup("words", value)],
    ["inertias", (value) => selectGroup("inertias", value)],
    ["variant", (value) => chooseLoudest({ variant: value, view: "variant" })],
    ["channel", (value) => choose({ channel: value, view: "variant" })],
    ["extent", (value) => choose({ extent: value })],
  ];
  for (const [id, act] of selections) find(id)?.addEventListener("change", () => act(box(id).value));
  find("difference")?.addEventListener("change", (event) => {
    const { checked } = /** @type {HTMLInputElement} */ (event.target);
    choose({ view: checked ? "difference" : "variant" });
  });
  find("share")?.addEventListener("click", copyAddress);
  find("print")?.addEventListener("click", () => window.print());
  find("save-data")?.addEventListener("click", () => saveJson("data", pageData));
  const links = /** @type {NodeListOf<HTMLAnchorElement>} */ (document.querySelectorAll("nav a, .card a"));
  for (const link of links) {
    // The address holds the view: a link of the page must not take its place.
    link.addEventListener("click", (event) => {
      const target = find(link.hash.slice(1));
      if (!target) return;
      event.preventDefault();
      target.scrollIntoView();
      target.setAttribute("tabindex", "-1");
      target.focus({ preventScroll: true });
    });
  }
  watchSections();
}

async function copyAddress() {
  try {
    await navigator.clipboard.writeText(location.href);
    say("Link copied");
  } catch {
    say("Copy the address of this page; it contains the view");
  }
}

/** Mark the section that is read in the table of contents. */
function watchSections() {
  const links = new Map(
    [.../** @type {NodeListOf<HTMLAnchorElement>} */ (document.querySelectorAll("nav a"))].map((link) => [link.hash.slice(1), link]),
  );
  const watcher = new IntersectionObserver(
    (entries) => {
      for (const { target, isIntersecting } of entries) links.get(target.id)?.classList.toggle("here", isIntersecting);
    },
    { rootMargin: "-20% 0px -70% 0px" },
  );
  for (const name of links.keys()) {
    const section = find(name);
    if (section) watcher.observe(section);
  }
}

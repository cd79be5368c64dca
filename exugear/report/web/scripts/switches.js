// Choices of the whole page: run-ups, variant, signal; table of contents; link, print and data.
import { fillChoices, find, make, need, say } from "./dom.js";
import { saveJson } from "./downloads.js";
import { pageData } from "./page_data.js";
import { choose, chooseLoudest, chosenGroup, chosenVariant, state } from "./state.js";

/** Fill what is chosen among. */
export function drawSwitches() {
  const group = chosenGroup();
  const variant = chosenVariant();
  if (!group || !variant) return;
  const box = /** @type {HTMLSelectElement | null} */ (find("group"));
  if (box) {
    box.replaceChildren(...pageData.groups.map((own) => make("option", { value: own.name }, own.words)));
    box.value = state.group;
  }
  const variants = Object.entries(group.variants).map(
    ([name, own]) => /** @type {[string, string]} */ ([name, sentenceCase(own.words)]),
  );
  const select = (/** @type {string} */ name) => chooseLoudest({ variant: name, view: "variant" });
  fillChoices(need("variant"), variants, state.variant, select);
  const views = [...variants];
  if (variants.length > 1) views.push(["difference", "Difference"]);
  const shown = state.view === "difference" ? "difference" : state.variant;
  fillChoices(need("view"), views, shown, (name) =>
    name === "difference" ? choose({ view: "difference", variant: group.main }) : select(name),
  );
  const channels = /** @type {HTMLSelectElement} */ (need("channel"));
  channels.replaceChildren(...variant.channels.map((own) => make("option", { value: own.name }, own.words)));
  channels.value = state.channel;
}

/** @param {string} words */
const sentenceCase = (words) => words.charAt(0).toUpperCase() + words.slice(1);

/** Show what belongs to the chosen run-ups and variant; paper shows all of it. */
export function showChosen() {
  for (const part of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-group]"))) {
    const { group, variant } = part.dataset;
    part.classList.toggle("other", group !== state.group || (variant !== undefined && variant !== state.variant));
  }
}

/** Begin what never changes. */
export function beginSwitches() {
  find("channel")?.addEventListener("change", (event) =>
    choose({ channel: /** @type {HTMLSelectElement} */ (event.target).value, view: "variant" }),
  );
  find("group")?.addEventListener("change", (event) =>
    chooseLoudest({ group: /** @type {HTMLSelectElement} */ (event.target).value }),
  );
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

// The page of the verb `view`: modes of one model and its vibration in operation, chosen from lists.
import { find, need } from "./dom.js";
import { beginModeView, drawMode } from "./mode_view.js";
import { pageData } from "./page_data.js";
import { choose, onChange, state } from "./state.js";
import { beginTables } from "./tables.js";
import { beginTheme } from "./theme.js";

/** Scroll a row into view within its list, and never the page: the picture stays in view. @param {HTMLElement | null} row */
function showRow(row) {
  const list = row?.closest(".scroll");
  if (!row || !list) return;
  const [inner, outer] = [row.getBoundingClientRect(), list.getBoundingClientRect()];
  if (inner.bottom > outer.bottom) list.scrollTop += inner.bottom - outer.bottom;
  if (inner.top < outer.top) list.scrollTop += inner.top - outer.top;
}

/** Mark the mode that is shown. */
function markMode() {
  const chosen = `mode:${state.model}:${state.mode}`;
  for (const button of document.querySelectorAll("button[data-choice]")) {
    const own = button instanceof HTMLElement && button.dataset.choice === chosen;
    button.closest("tr")?.classList.toggle("chosen", own);
    if (own) {
      button.setAttribute("aria-current", "true");
      showRow(button.closest("tr"));
    } else button.removeAttribute("aria-current");
  }
  const words = pageData.models[state.model]?.modes[state.mode]?.words;
  if (words) need("mode-words").textContent = words;
}

/** @param {number} by */
function step(by) {
  const count = pageData.models[state.model].modes.length;
  choose({ mode: (state.mode + by + count) % count });
}

/** @type {Promise<unknown>} */
let drawing = Promise.resolve();
onChange(() => {
  markMode();
  drawing = drawMode();
});
beginTheme(() => void drawMode());
function begin() {
  beginTables();
  beginModeView();
  find("before")?.addEventListener("click", () => step(-1));
  find("next")?.addEventListener("click", () => step(1));
  choose({ model: Object.keys(pageData.models)[0], mode: pageData.first ?? 0 });
  void drawing.finally(() => document.documentElement.setAttribute("data-ready", ""));
}

// Lists are painted first: they can be read while bodies are drawn.
requestAnimationFrame(() => setTimeout(begin));

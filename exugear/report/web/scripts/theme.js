// Dark or light colours, kept for the next time.
import { find } from "./dom.js";

/** @param {(all: boolean) => void} redraw what was drawn in the colours before, or all there is */
export function beginTheme(redraw) {
  const root = document.documentElement;
  const button = find("theme");
  const tell = () => button?.setAttribute("aria-pressed", String(root.dataset.theme === "dark"));
  button?.addEventListener("click", () => {
    root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark";
    try {
      localStorage.setItem("exugear-theme", root.dataset.theme);
    } catch {
      // Kept or not, the page has its colours.
    }
    tell();
    redraw(false);
  });
  tell();
  // Paper is white: figures are drawn for it, and afterwards as they were.
  let before = root.dataset.theme;
  window.addEventListener("beforeprint", () => {
    before = root.dataset.theme;
    root.dataset.theme = "light";
    redraw(true);
  });
  window.addEventListener("afterprint", () => {
    root.dataset.theme = before;
    redraw(false);
  });
}

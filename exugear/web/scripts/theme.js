// Dark or light colours, kept for the next time.
import { find } from "./dom.js";

/** @param {() => void} redraw what was drawn in the colours before */
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
    redraw();
  });
  tell();
}

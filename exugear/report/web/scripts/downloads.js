// Data and pictures that the reader takes away.
import { make } from "./dom.js";
import { pageData } from "./page_data.js";
import { pageColour } from "./colours.js";

/** @param {string} title @returns {string} */
const fileName = (title) =>
  `${pageData.name} ${title}`
    .toLowerCase()
    .replace(/[^a-z0-9]+/g, "-")
    .replace(/^-|-$/g, "")
    .slice(0, 100);

/** @param {string} name @param {Blob} content */
function save(name, content) {
  const address = URL.createObjectURL(content);
  make("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 5000);
}

/** @typedef {string | number | null | undefined} Value */

/** @param {Value} value @returns {string} */
function written(value) {
  const text = value === null || value === undefined ? "" : String(value);
  // A text that begins like a formula is none: spreadsheets would run it.
  const plain = typeof value === "string" && /^[=+@\t\r]|^-(?![\d.])/.test(text) ? `'${text}` : text;
  return /[",\n\r]/.test(plain) ? `"${plain.replace(/"/g, '""')}"` : plain;
}

/** @param {string} title @param {Value[][]} rows */
export function saveTable(title, rows) {
  const text = rows.map((row) => row.map(written).join(",")).join("\n");
  save(`${fileName(title)}.csv`, new Blob(["\ufeff", text, "\n"], { type: "text/csv" }));
}

/** @param {string} title @param {unknown} content */
export function saveJson(title, content) {
  save(`${fileName(title)}.json`, new Blob([JSON.stringify(content, null, 1)], { type: "application/json" }));
}

/** @param {string} title @param {HTMLCanvasElement} canvas */
export function savePicture(title, canvas) {
  framed(title, canvas).toBlob((picture) => picture && save(`${fileName(title)}.png`, picture));
}

/**
 * A picture under its title, on the colour of the page.
 * @param {string} title
 * @param {HTMLCanvasElement} canvas
 */
function framed(title, canvas) {
  const ratio = window.devicePixelRatio || 1;
  const picture = make("canvas");
  picture.width = canvas.width + 20 * ratio;
  picture.height = canvas.height + 44 * ratio;
  const drawing = picture.getContext("2d");
  if (drawing) {
    drawing.fillStyle = pageColour("--panel");
    drawing.fillRect(0, 0, picture.width, picture.height);
    drawing.drawImage(canvas, 10 * ratio, 34 * ratio);
    drawing.fillStyle = pageColour("--ink");
    drawing.font = `600 ${14 * ratio}px system-ui, sans-serif`;
    drawing.fillText(`${pageData.name}: ${title}`, 14 * ratio, 22 * ratio);
  }
  return picture;
}

/**
 * Fill the tools of a figure.
 * @param {Element | null | undefined} box
 * @param {() => string} title
 * @param {{rows?: () => Value[][] | Promise<Value[][]>, canvas?: () => HTMLCanvasElement, extra?: HTMLElement[]}} what
 */
export function addTools(box, title, { rows, canvas, extra = [] }) {
  const buttons = [...extra];
  if (rows) {
    const button = make("button", { type: "button" }, "CSV");
    button.addEventListener("click", async () => saveTable(title(), await rows()));
    buttons.push(button);
  }
  if (canvas) {
    const button = make("button", { type: "button" }, "PNG");
    button.addEventListener("click", () => savePicture(title(), canvas()));
    buttons.push(button);
  }
  for (const button of buttons) {
    if (!button.getAttribute("aria-label")) button.setAttribute("aria-label", `${button.textContent}: ${title()}`);
  }
  box?.replaceChildren(...buttons);
}

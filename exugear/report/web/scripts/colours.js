// Colours of the page and of diagrams, by theme.

/** @param {string} name of a custom property @returns {string} */
export const pageColour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** @returns {"light" | "dark"} */
export const theme = () => (document.documentElement.dataset.theme === "dark" ? "dark" : "light");

const METHODS = {
  light: ["#ffffff", "#f1eff8", "#d6cfea", "#b49fd6", "#9c68ba", "#a03589", "#a81d4a", "#87101e", "#38060c"],
  dark: ["#0e1117", "#1a1440", "#46136b", "#7c1d6d", "#b23257", "#e05a36", "#f69422", "#f9d648", "#fdffc5"],
};
const DIFFERENCES = {
  light: ["#00456e", "#2f86bd", "#a6cfe8", "#f7f8fa", "#f6c39c", "#d9691a", "#7c2f00"],
  dark: ["#8fd3ff", "#3b93cf", "#1e4a6b", "#141a22", "#6b3a17", "#d2701f", "#ffc488"],
};
const FAMILIES = {
  light: ["#00795a", "#7d3aa0", "#9a6700", "#2f55c8", "#a8324a"],
  dark: ["#4fd6a8", "#d99be8", "#f2c14e", "#91a7ff", "#ff9db0"],
};
const CURVES = {
  light: ["#c25100", "#0069a6", "#00795a", "#7d3aa0", "#9a6700", "#55606d"],
  dark: ["#ff9447", "#56b4e9", "#4fd6a8", "#d99be8", "#f2c14e", "#9fabb9"],
};

/** @param {boolean} difference @returns {string[]} */
export const mapColours = (difference) => (difference ? DIFFERENCES : METHODS)[theme()];

/** @param {number} number @returns {string} */
export const familyColour = (number) => FAMILIES[theme()][number % FAMILIES.light.length];

/** @param {number} number @returns {string} */
export const curveColour = (number) => CURVES[theme()][number % CURVES.light.length];

/** @param {string} colour as #rrggbb @returns {[number, number, number]} 0 to 255 */
export function channelsOf(colour) {
  return [parseInt(colour.slice(1, 3), 16), parseInt(colour.slice(3, 5), 16), parseInt(colour.slice(5, 7), 16)];
}

/**
 * Table of 256 colours between stops.
 * @param {string[]} stops
 * @returns {Uint8Array} red, green, blue of each
 */
export function ramp(stops) {
  const colours = stops.map(channelsOf);
  const table = new Uint8Array(3 * 256);
  for (let i = 0; i < 256; i++) {
    const place = (i / 255) * (colours.length - 1);
    const below = Math.min(colours.length - 2, Math.floor(place));
    for (let k = 0; k < 3; k++) {
      table[3 * i + k] = colours[below][k] + (colours[below + 1][k] - colours[below][k]) * (place - below);
    }
  }
  return table;
}

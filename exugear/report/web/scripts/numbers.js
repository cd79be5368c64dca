// Numbers as people write them.

/** @param {number | null | undefined} value @param {number} [digits] significant ones @returns {string} */
export function figureText(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value !== 0 && Math.abs(value) >= 10 ** (digits - 1)) return value.toFixed(0);
  return String(Number(value.toPrecision(digits)));
}

/** @param {number} level dB @returns {number} amplitude over the reference */
export const amplitudeOf = (level) => 10 ** (level / 20);

/** @param {number} value @param {number} low @param {number} high @returns {number} */
export const within = (value, low, high) => Math.min(Math.max(value, low), high);

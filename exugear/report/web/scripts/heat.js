// Waterfalls as pictures of cells: unpacked, coloured, read out.
import { mapColours, ramp } from "./colours.js";
import { make } from "./dom.js";
import { within } from "./numbers.js";
import { unpack } from "./page_data.js";

/** @typedef {{channel: import("./page_data.js").Channel, cells: import("./page_data.js").Numbers, columns: number, rows: number, top: number}} Field */
/** @typedef {{field: Field, other: Field | null, canvas: HTMLCanvasElement, top: number}} Heat */

export const SPAN = 70;
export const DIFFERENCE = 30;

/** @param {import("./page_data.js").Channel} channel @returns {Promise<Field>} */
export async function fieldOf(channel) {
  const cells = await unpack(channel.cells);
  const [columns, rows] = channel.cells.shape;
  let highest = 0;
  for (const value of cells) if (value > highest) highest = value;
  return { channel, cells, columns, rows, top: channel.floor + channel.step * highest };
}

/** @param {Field} field @param {number} column @param {number} row @returns {number} level, dB */
export function levelAt(field, column, row) {
  if (column < 0 || row < 0 || column >= field.columns || row >= field.rows) return field.channel.floor;
  return field.channel.floor + field.channel.step * field.cells[column * field.rows + row];
}

/** @param {Field} field @param {number} speed rpm @returns {number} */
export const columnOf = (field, speed) => Math.floor(along(...field.channel.knots, speed));

/** @param {Field} field @param {number} frequency Hz @returns {number} */
export const rowOf = (field, frequency) => Math.round((frequency - field.channel.first) / field.channel.spacing);

/** @param {Field} field @param {number} column @returns {number} speed in the middle of a column, rpm */
export const speedOf = (field, column) => along(field.channel.knots[1], field.channel.knots[0], column + 0.5);

/**
 * Value of a line through knots, straight on beyond its ends.
 * @param {number[]} from @param {number[]} to @param {number} value @returns {number}
 */
function along(from, to, value) {
  let piece = 0;
  while (piece < from.length - 2 && value > from[piece + 1]) piece++;
  const share = (value - from[piece]) / Math.max(from[piece + 1] - from[piece], 1e-9);
  return to[piece] + share * (to[piece + 1] - to[piece]);
}

/** @param {Field} field @param {number} row @returns {number} frequency of a row, Hz */
export const frequencyOf = (field, row) => field.channel.first + row * field.channel.spacing;

/**
 * Colour a waterfall, or the difference of two.
 * @param {Field} field
 * @param {Field | null} other what is taken away
 * @returns {Heat}
 */
export function heatOf(field, other) {
  const canvas = make("canvas");
  canvas.width = field.columns;
  canvas.height = field.rows;
  const drawing = canvas.getContext("2d");
  const top = Math.ceil(Math.max(field.top, other?.top ?? -Infinity));
  if (!drawing) return { field, other, canvas, top };
  const picture = drawing.createImageData(field.columns, field.rows);
  const colours = ramp(mapColours(other !== null));
  for (let column = 0; column < field.columns; column++) {
    const beside = other ? columnOf(other, speedOf(field, column)) : 0;
    for (let row = 0; row < field.rows; row++) {
      const level = levelAt(field, column, row);
      // The lowest step is silence, however quiet the loudest cell.
      const share = other
        ? differenceShare(level, levelAt(other, beside, rowOf(other, frequencyOf(field, row))), top)
        : level > field.channel.floor
          ? (level - (top - SPAN)) / SPAN
          : 0;
      const colour = 3 * Math.round(255 * within(share, 0, 1));
      const pixel = 4 * ((field.rows - 1 - row) * field.columns + column);
      picture.data[pixel] = colours[colour];
      picture.data[pixel + 1] = colours[colour + 1];
      picture.data[pixel + 2] = colours[colour + 2];
      picture.data[pixel + 3] = 255;
    }
  }
  drawing.putImageData(picture, 0, 0);
  return { field, other, canvas, top };
}

/** What is quiet in both differs by nothing that matters, and fades. @param {number} one @param {number} two @param {number} top */
function differenceShare(one, two, top) {
  const loud = within((Math.max(one, two) - (top - SPAN)) / 12, 0, 1);
  return 0.5 + 0.5 * within((one - two) / DIFFERENCE, -1, 1) * loud;
}

/**
 * Loudest cell of a part: a pixel may cover several, and no peak is to be missed.
 * @param {Heat} heat
 * @param {[number, number]} columns
 * @param {[number, number]} rows
 * @returns {{column: number, row: number, level: number, other: number} | null}
 */
export function loudestIn({ field, other }, columns, rows) {
  let best = null;
  let loudest = -Infinity;
  for (let column = Math.max(0, columns[0]); column <= Math.min(field.columns - 1, columns[1]); column++) {
    for (let row = Math.max(0, rows[0]); row <= Math.min(field.rows - 1, rows[1]); row++) {
      const level = levelAt(field, column, row);
      const beside = other
        ? levelAt(other, columnOf(other, speedOf(field, column)), rowOf(other, frequencyOf(field, row)))
        : -Infinity;
      if (Math.max(level, beside) > loudest) {
        loudest = Math.max(level, beside);
        best = { column, row, level, other: beside };
      }
    }
  }
  return best;
}

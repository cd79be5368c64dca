// What Python put into the page: JSON, and arrays that are unpacked when they are shown.

/** @typedef {{blob: string, type: string, shape: number[], differences: boolean}} ArrayReference */
/** @typedef {Uint8Array | Int8Array | Uint16Array | Int16Array | Uint32Array | Float32Array} Numbers */
/** @typedef {{name: string, words: string, unit: string, cells: ArrayReference, floor: number, step: number, spacing: number, first: number, knots: [number[], number[]], cuts: ArrayReference, speeds: ArrayReference}} Channel */
/** @typedef {{frequency: number, tolerance: number | null, speed: number, peak: number, line: number, short: string, level: number, steady: boolean, inside: boolean, mode: number | null, facts: [string, string][], caveats: string[]}} Resonance */
/** @typedef {{words: string, model: string, window: string, channels: Channel[], constant: {cuts: ArrayReference, speeds: ArrayReference} | null, resonances: Resonance[], first: number}} VariantData */
/** @typedef {{name: string, title: string, words: string, inertias: string, source: string, main: string, range: [number, number] | null, variants: Record<string, VariantData>}} GroupData */
/** @typedef {{name: string, short: string, sentence: string, order: number, harmonic: number, family: string}} LineData */
/** @typedef {{name: string, label: string, owner: string, fixed: boolean, elastic: boolean, colour: string, reference: number[], turn: number, low: number[], span: number[], points: ArrayReference, triangles: ArrayReference}} BodyData */
/** @typedef {{bodies: BodyData[], centre: number[], diagonal: number, amplitude: number, motions?: ArrayReference, deformed?: Record<string, Record<string, ArrayReference>>, colours: string[], geometry?: string}} StageData */
/** @typedef {{title?: string, frequency: number, damping: number, words: string}} ModeData */
/** @typedef {{words: string, variant: string, stage: StageData, modes: ModeData[]}} ModelData */
/** @typedef {{label: string, style: string, right: boolean, x: ArrayReference, y: ArrayReference}} CurveData */
/** @typedef {{title: string, axes: {label: string, logarithmic: boolean}[], curves: CurveData[], marks: {x: number, label: string}[]}} ChartData */
/** @typedef {{label: string, unit: string, speeds: ArrayReference, values: ArrayReference}} SpeedCurve */
/** @typedef {{table: string, name: string, about: string, meaning: string, example: string}} SchemaKey */
/** @typedef {{name: string, input: string, rated: number | null, lines: LineData[], groups: GroupData[], models: Record<string, ModelData>, charts: Record<string, ChartData>, curves?: SpeedCurve[], first?: number, nonce?: string, schema?: SchemaKey[]}} PageData */

/** @param {string} id @returns {string} */
function textOf(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page lacks ${id}`);
  return element.textContent ?? "";
}

/** @type {PageData} */
export const pageData = JSON.parse(textOf("data"));

/** @type {Record<string, {new (buffer: ArrayBuffer): Numbers}>} */
const KINDS = {
  u8: Uint8Array,
  i8: Int8Array,
  u16: Uint16Array,
  i16: Int16Array,
  u32: Uint32Array,
  f32: Float32Array,
};

/** Arrays of the last pictures that came after the page, by name. @type {Record<string, string>[]} */
const later = [];
const KEPT_PICTURES = 4;

/** @param {Record<string, string>} arrays by name */
export function addArrays(arrays) {
  later.push(arrays);
  if (later.length > KEPT_PICTURES) for (const name of Object.keys(later.shift() ?? {})) unpacked.delete(name);
}

/** @param {string} name of an array that came after the page */
const laterText = (name) => later.find((arrays) => name in arrays)?.[name];

/** @type {Map<string, Promise<Numbers>>} */
const unpacked = new Map();

/**
 * Numbers of an array; the same promise every time.
 * @param {ArrayReference} reference
 * @returns {Promise<Numbers>}
 */
export function unpack(reference) {
  const known = unpacked.get(reference.blob);
  if (known) return known;
  const numbers = inflate(reference);
  unpacked.set(reference.blob, numbers);
  return numbers;
}

/** @param {ArrayReference} reference @returns {Promise<Numbers>} */
async function inflate(reference) {
  const packed = Uint8Array.from(atob(laterText(reference.blob) ?? textOf(reference.blob)), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const numbers = new KINDS[reference.type](await new Response(stream).arrayBuffer());
  if (reference.differences) {
    const width = reference.shape.slice(1).reduce((product, size) => product * size, 1);
    for (let i = width; i < numbers.length; i++) numbers[i] += numbers[i - width];
  }
  return numbers;
}

// The text of the page `edit`: CodeMirror with highlighting, completion, messages at their lines, and keys at the cursor.
import { pageData } from "./page_data.js";

/** @typedef {{text: string, kind: "error" | "warning", line: number | null, old: string, new: string}} Remark */
/** @typedef {{from: number, to: number, text: string}} NumberPlace */

const HEADER = /^\s*\[\[?\s*([^\]#]+?)\s*\]/;
const PAIR = /^\s*([\w."'-]+(?:\s*\.\s*[\w."'-]+)*)\s*=/;
const NUMBER = /(?<![\w."'])[-+]?\d[\d_]*(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w."'])/g;

/** Beginning of a number with an exponent, of which the mode of CodeMirror takes the part before it. */
const EXPONENT = /^[-+]?\d[\d_]*(?:\.\d[\d_]*)?[eE][-+]?\d+/;

/** The mode of CodeMirror, with whole numbers. */
const tomlMode = () => ({
  ...CM.toml,
  token: (/** @type {any} */ stream, /** @type {any} */ state) => {
    if (!state.inString && !state.lhs && stream.match(EXPONENT)) return "number";
    return CM.toml.token(stream, state);
  },
});

/** @param {string} dotted */
const plainKey = (dotted) => dotted.replace(/["'\s]/g, "");

/** Colours of the text come from the page, for both themes. */
const COLOURS = () => {
  const { tags } = CM;
  return CM.HighlightStyle.define([
    { tag: [tags.propertyName, tags.definition(tags.propertyName)], color: "var(--accent)" },
    { tag: [tags.string], color: "var(--good)" },
    { tag: [tags.number, tags.bool, tags.atom], color: "var(--force)" },
    { tag: [tags.comment], color: "var(--soft)", fontStyle: "italic" },
    { tag: [tags.bracket, tags.operator], color: "var(--soft)" },
  ]);
};

const LOOK = {
  "&": { height: "100%", fontSize: "13px", color: "var(--ink)", backgroundColor: "var(--panel)" },
  "&.cm-focused": { outline: "none" },
  ".cm-scroller": { fontFamily: "ui-monospace, 'DejaVu Sans Mono', monospace", lineHeight: "1.5" },
  ".cm-content": { caretColor: "var(--ink)" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  ".cm-gutters": { backgroundColor: "var(--panel)", color: "var(--soft)", borderRight: "1px solid var(--line)" },
  ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "color-mix(in srgb, var(--accent) 9%, transparent)" },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": {
    backgroundColor: "color-mix(in srgb, var(--accent) 30%, transparent)",
  },
  ".cm-tooltip, .cm-panels": { backgroundColor: "var(--panel)", color: "var(--ink)", border: "1px solid var(--line)" },
  ".cm-tooltip-autocomplete > ul > li[aria-selected]": { backgroundColor: "var(--accent)", color: "var(--panel)" },
  ".cm-completionDetail": { color: "inherit", opacity: "0.75" },
  ".cm-diagnosticAction": { backgroundColor: "var(--accent)", color: "var(--panel)", padding: "3px 8px" },
};

/**
 * @param {HTMLElement} parent
 * @param {{changed: () => void, moved: () => void, save: () => void}} told
 * @returns {Editor}
 */
export function makeEditor(parent, told) {
  const { EditorView } = CM;
  const extensions = [
    CM.lineNumbers(),
    CM.lintGutter(),
    CM.highlightActiveLine(),
    CM.highlightActiveLineGutter(),
    CM.drawSelection(),
    CM.history(),
    CM.bracketMatching(),
    CM.closeBrackets(),
    CM.highlightSelectionMatches(),
    CM.search({ top: true }),
    CM.StreamLanguage.define(tomlMode()),
    CM.syntaxHighlighting(COLOURS()),
    CM.autocompletion({ override: [completions], icons: false }),
    CM.keymap.of([
      { key: "Mod-s", preventDefault: true, run: () => (told.save(), true) },
      ...CM.closeBracketsKeymap,
      ...CM.completionKeymap,
      ...CM.defaultKeymap,
      ...CM.searchKeymap,
      ...CM.historyKeymap,
      ...CM.lintKeymap,
    ]),
    EditorView.theme(LOOK),
    EditorView.cspNonce.of(pageData.nonce ?? ""),
    EditorView.contentAttributes.of({ "aria-label": "Text of the gearbox file", spellcheck: "false" }),
    EditorView.updateListener.of((update) => {
      if (update.docChanged) told.changed();
      if (update.docChanged || update.selectionSet) told.moved();
    }),
  ];
  return new EditorView({ parent, state: CM.EditorState.create({ doc: "", extensions }) });
}

/** Replace the text where it differs, which can be undone unless it is the first; the cursor stays. @param {Editor} editor @param {string} text @param {boolean} first */
export function putText(editor, text, first = false) {
  const before = editor.state.doc.toString();
  const least = Math.min(before.length, text.length);
  let from = 0;
  while (from < least && before[from] === text[from]) from++;
  let same = 0;
  while (same < least - from && before[before.length - 1 - same] === text[text.length - 1 - same]) same++;
  editor.dispatch({
    changes: { from, to: before.length - same, insert: text.slice(from, text.length - same) },
    annotations: CM.Transaction.addToHistory.of(!first),
    userEvent: "input.replace", // a step of its own for undo
  });
}

/**
 * Keys of all lines, in their order.
 * @param {Editor} editor @param {number} [last] number of the last line to read
 * @returns {{line: number, key: string}[]}
 */
function keysOf(editor, last = editor.state.doc.lines) {
  const found = [];
  let table = "";
  for (let number = 1; number <= last; number++) {
    const text = editor.state.doc.line(number).text;
    const header = HEADER.exec(text);
    const pair = header ? null : PAIR.exec(text);
    if (header) found.push({ line: number, key: (table = plainKey(header[1])) });
    else if (pair) found.push({ line: number, key: [table, plainKey(pair[1])].filter(Boolean).join(".") });
  }
  return found;
}

/** Dotted key at the cursor; empty above the first. @param {Editor} editor @returns {string} */
export function keyAtCursor(editor) {
  const line = editor.state.doc.lineAt(editor.state.selection.main.head).number;
  const found = keysOf(editor, line);
  return found.length ? found[found.length - 1].key : "";
}

/** Table at the cursor. @param {Editor} editor */
function tableAtCursor(editor) {
  for (let number = editor.state.doc.lineAt(editor.state.selection.main.head).number; number > 0; number--) {
    const header = HEADER.exec(editor.state.doc.line(number).text);
    if (header) return plainKey(header[1]);
  }
  return "";
}

/** Go to a key, or to the innermost table around it. @param {Editor} editor @param {string} key @returns {boolean} */
export function goToKey(editor, key) {
  let best = { line: 0, length: 0 };
  for (const found of keysOf(editor)) {
    const inside = found.key === key || key.startsWith(`${found.key}.`);
    if (inside && found.key.length > best.length) best = { line: found.line, length: found.key.length };
    // A table may have only tables inside, such as [bearings.a.catalogue].
    if (!best.length && found.key.startsWith(`${key}.`)) best = { line: found.line, length: 0.5 };
  }
  if (best.line) goToLine(editor, best.line);
  return best.line > 0;
}

/** @param {Editor} editor @param {number} number */
export function goToLine(editor, number) {
  const line = editor.state.doc.line(Math.min(Math.max(number, 1), editor.state.doc.lines));
  editor.dispatch({ selection: { anchor: line.from }, effects: CM.EditorView.scrollIntoView(line.from, { y: "center" }) });
  editor.focus();
}

/** Number at the cursor, outside comments and names. @param {Editor} editor @returns {NumberPlace | null} */
export function numberAtCursor(editor) {
  const { head } = editor.state.selection.main;
  const line = editor.state.doc.lineAt(head);
  if (HEADER.test(line.text)) return null;
  const code = line.text.replace(/"[^"]*"|'[^']*'/g, (quoted) => "_".repeat(quoted.length)).replace(/#.*/, "");
  for (const found of code.matchAll(NUMBER)) {
    const from = line.from + found.index;
    const to = from + found[0].length;
    if (from <= head && head <= to) return { from, to, text: found[0] };
  }
  return null;
}

/** Show messages at their lines. @param {Editor} editor @param {Remark[]} remarks */
export function showRemarks(editor, remarks) {
  const { doc } = editor.state;
  const shown = remarks.map((remark) => {
    const line = doc.line(Math.min(remark.line ?? 1, doc.lines));
    const start = line.from + line.text.search(/\S|$/);
    return {
      from: Math.min(start, line.to),
      to: line.to,
      severity: remark.kind,
      message: remark.text,
      actions: remark.new ? [{ name: correctionText(remark), apply: () => correct(editor, remark) }] : [],
    };
  });
  editor.dispatch(CM.setDiagnostics(editor.state, shown));
}

/** @param {Remark} remark */
export const correctionText = (remark) => (remark.old ? `Replace by ${remark.new}` : `Add ${remark.new}`);

/** Take the correction of a message. @param {Editor} editor @param {Remark} remark */
export function correct(editor, remark) {
  const line = editor.state.doc.line(Math.min(remark.line ?? 1, editor.state.doc.lines));
  const place = remark.old ? line.text.indexOf(remark.old) : line.text.length;
  if (place < 0) return goToLine(editor, line.number);
  const from = line.from + place;
  const insert = remark.old ? remark.new : `\n${remark.new}`;
  editor.dispatch({ changes: { from, to: from + remark.old.length, insert }, selection: { anchor: from + insert.length } });
  editor.focus();
}

/** Description of a key. @param {string} key @returns {import("./page_data.js").SchemaKey | undefined} */
export function described(key) {
  const parts = key.split(".");
  for (let count = parts.length; count > 0; count--) {
    const table = parts.slice(0, count - 1).join(".");
    const found = pageData.schema?.find((one) => one.name === parts[count - 1] && isTable(one.table, table));
    if (found) return found;
  }
  return undefined;
}

/** Whether a table is of a kind, such as gears.sun of gears.NAME. @param {string} kind @param {string} table */
function isTable(kind, table) {
  const [wanted, given] = [kind.split("."), table.split(".").filter((part) => !/^\d+$/.test(part))];
  return wanted.length === given.length && wanted.every((part, n) => part === given[n] || part === "NAME");
}

/** @param {any} context of CodeMirror */
function completions(context) {
  const line = context.state.doc.lineAt(context.pos);
  const before = line.text.slice(0, context.pos - line.from);
  const header = /^\s*\[{1,2}([\w.]*)$/.exec(before);
  const key = /^\s*(\w*)$/.exec(before);
  if (header) {
    const tables = [...new Set(pageData.schema?.map(({ table }) => table))].filter(Boolean);
    return { from: context.pos - header[1].length, options: tables.map((label) => ({ label, type: "class" })) };
  }
  const table = tableAtCursor(context.view);
  const value = /^\s*(\w+)\s*=\s*("?\w*)$/.exec(before);
  if (value) {
    const words = described([table, value[1]].filter(Boolean).join("."))?.about.match(/"[^"]+"/g) ?? [];
    return words.length ? { from: context.pos - value[2].length, options: words.map((label) => ({ label })) } : null;
  }
  if (!key || (!key[1] && !context.explicit)) return null;
  const options = (pageData.schema ?? [])
    .filter((one) => isTable(one.table, table))
    .map(({ name, about, meaning, example }) => ({
      label: name,
      detail: about,
      info: meaning,
      type: "property",
      apply: example ? `${name} = ${example}` : `${name} = `,
    }));
  return { from: context.pos - key[1].length, options };
}

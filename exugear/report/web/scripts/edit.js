// The page of the command `edit`: the text, and all that the program makes of it.
import { find, make, need, say } from "./dom.js";
import { keyAt, pointOut, setOld, showCampbell, showCheck, showDynamics, showLoads, showPicture, showShapes, shown, shownGeometry, stepMode, tellVerdict } from "./edit_results.js";
import { ask, results } from "./edit_server.js";
import { beginSlider, followCursor } from "./edit_slider.js";
import { correct, correctionText, goToKey, goToLine, keyAtCursor, makeEditor, putText, showRemarks } from "./edit_text.js";
import { beginWork } from "./edit_work.js";
import { beginModeView, drawMode, shownStage } from "./mode_view.js";
import { beginTheme } from "./theme.js";

/** Pause (ms) after a change before the text is sent. */
const PAUSE = 30;
const DRAFT = `exugear-edit ${location.pathname}`;

/** What the file has, as far as this page knows. */
const file = { text: "", digest: "", offered: "" };
let running = false;
let again = false;
let timer = 0;
/** Number of the text: results of an earlier one are shown grey. */
let version = 0;
/** Results that come one after the other. */
const STEPS = ["check", "picture", "dynamics", "loads", "shapes"];

const editor = makeEditor(need("text"), { changed: onText, moved: onCursor, save: () => void save() });
const text = () => editor.state.doc.toString();
const isSaved = () => text() === file.text;
const goTo = (/** @type {string} */ key) => {
  if (!goToKey(editor, key)) say(`${key} is not in the text`);
  showSide("text");
};

function onText() {
  version += 1;
  setOld(STEPS, true);
  need("save").classList.toggle("needed", !isSaved());
  need("saved").textContent = isSaved() ? "saved" : "not saved";
  clearTimeout(timer);
  timer = setTimeout(() => {
    keepDraft();
    if (running) again = true;
    else void compute();
  }, PAUSE);
}

function onCursor() {
  followCursor(editor);
  pointOut(keyAtCursor(editor));
}

/** Results of the text; changes meanwhile start it again once the numbers are shown. */
async function compute() {
  running = true;
  do {
    again = false;
    const mine = version;
    if (!shown.parts.length) tellVerdict("Computing. The first start after an installation takes half a minute.", "");
    try {
      for await (const step of results(text(), shownGeometry())) {
        if (step.step === "check") showCheck(step, goTo);
        if (step.step === "picture") await showPicture(step);
        if (step.step === "dynamics") showDynamics(step);
        if (step.step === "loads") showLoads(step, goTo);
        if (step.step === "shapes") await showShapes(step);
        if (mine === version) tell(step);
        else setOld(STEPS, true);
        if (again && step.step === "dynamics") break;
      }
    } catch (error) {
      tellVerdict(error instanceof Error && error.message ? error.message : "The server does not answer.", "bad");
    }
    document.documentElement.setAttribute("data-ready", "");
  } while (again);
  running = false;
}

/** @param {any} step */
function tell(step) {
  const { remarks } = shown;
  const errors = remarks.filter(({ kind }) => kind === "error").length;
  const warnings = remarks.length - errors;
  const counted = (/** @type {number} */ count, /** @type {string} */ word) => `${count} ${word}${count > 1 ? "s" : ""}`;
  if (errors) tellVerdict(`${counted(errors, "error")}. Grey results belong to an earlier state without errors.`, "bad");
  else if (step.step === "check") tellVerdict(`No errors. ${step.ratio}${warnings ? `, ${counted(warnings, "warning")}` : ""}.`, warnings ? "mind" : "good");
  else if (warnings) need("verdict").className = "mind";
  const list = need("remarks");
  list.replaceChildren(...remarks.map(remarkItem));
  list.hidden = !remarks.length;
  showRemarks(editor, remarks);
  if (step.step === "picture") onCursor();
}

/** @param {import("./edit_text.js").Remark} remark */
function remarkItem(remark) {
  const item = make("li", { class: remark.kind });
  const { line } = remark;
  if (line) {
    const act = () => (goToLine(editor, line), showSide("text"));
    item.append(make("button", { type: "button", class: "choice", click: act }, `Line ${line}`), " ");
  }
  item.append(make("span", {}, remark.text));
  if (remark.new) item.append(" ", make("button", { type: "button", click: () => void correct(editor, remark) }, correctionText(remark)));
  return item;
}

async function save() {
  const saved = text();
  const failure = need("not-saved");
  try {
    const response = await ask("save", { text: saved, digest: file.digest });
    const content = await response.json();
    failure.hidden = response.ok || response.status === 409;
    if (response.ok) {
      Object.assign(file, { text: saved, digest: content.digest });
      onTextState();
      say("Saved");
    } else if (response.status === 409) await offer(content.file.digest);
    else failure.textContent = content.error;
  } catch {
    failure.textContent = "The file was not saved: the server does not answer.";
    failure.hidden = false;
  }
}

function onTextState() {
  need("save").classList.toggle("needed", !isSaved());
  need("saved").textContent = isSaved() ? "saved" : "not saved";
  keepDraft();
}

/** The file on disk, which others may have changed. @param {import("./edit_work.js").FileState} told */
function noticeFile(told) {
  if (told.digest === file.digest || told.missing) return;
  if (isSaved()) void load("The file was changed by another program and read again");
  else if (file.offered !== told.digest) void offer(told.digest);
}

/** Let the user choose between the text and the file. @param {string} digest of the file */
async function offer(digest) {
  file.offered = digest;
  const { text: other } = await (await ask("file")).json();
  need("conflict-words").textContent = `The file was changed by another program or page, and this text is not saved. They differ ${placeOfDifference(text(), other)}.`;
  need("conflict").hidden = false;
}

/** @param {string} mine @param {string} other @returns {string} lines of the first text between its first and last difference from the other */
function placeOfDifference(mine, other) {
  const [a, b] = [mine.split("\n"), other.split("\n")];
  let first = 0;
  while (first < Math.min(a.length, b.length) && a[first] === b[first]) first++;
  let last = 0;
  while (last < Math.min(a.length, b.length) - first && a[a.length - 1 - last] === b[b.length - 1 - last]) last++;
  const end = Math.max(a.length - last, first + 1);
  return end === first + 1 ? `in line ${end}` : `between lines ${first + 1} and ${end}`;
}

/** Go on with the text; the file is one step of undo away. */
async function keepText() {
  const content = await (await ask("file")).json();
  const mine = text(); // with what was typed while the server answered
  Object.assign(file, { text: content.text, digest: content.digest });
  need("conflict").hidden = true;
  putText(editor, content.text);
  putText(editor, mine);
  onTextState();
}

/** @param {string} words */
async function load(words) {
  const content = await (await ask("file")).json();
  const first = !file.digest;
  Object.assign(file, { text: content.text, digest: content.digest });
  need("conflict").hidden = true;
  putText(editor, content.text, first);
  onTextState();
  if (words) say(words);
}

/** Text that is not saved survives a reload of the page. */
function keepDraft() {
  if (!file.digest) return;
  if (isSaved()) sessionStorage.removeItem(DRAFT);
  else sessionStorage.setItem(DRAFT, text());
}

/** @param {string} side of narrow windows: text or results */
function showSide(side) {
  document.documentElement.dataset.side = side;
  for (const button of document.querySelectorAll("#sides button")) {
    button.setAttribute("aria-pressed", String(/** @type {HTMLElement} */ (button).dataset.side === side));
  }
}

function beginPicking() {
  const canvas = find("view-3d");
  let began = [0, 0];
  canvas?.addEventListener("pointerdown", (event) => (began = [event.clientX, event.clientY]));
  canvas?.addEventListener("pointerup", (event) => {
    if (Math.hypot(event.clientX - began[0], event.clientY - began[1]) > 4) return;
    const hit = shownStage()?.pick(event.clientX, event.clientY);
    const key = hit && keyAt(hit.owner, hit.point);
    if (key) goTo(key);
  });
}

async function begin() {
  beginModeView();
  need("mode-title").dataset.step = "shapes";
  beginPicking();
  beginSlider(editor);
  beginTheme(() => (showCampbell(), void drawMode()));
  need("save").addEventListener("click", () => void save());
  need("undo").addEventListener("click", () => CM.undo(editor));
  need("redo").addEventListener("click", () => CM.redo(editor));
  need("before").addEventListener("click", () => stepMode(-1));
  need("next").addEventListener("click", () => stepMode(1));
  need("take-file").addEventListener("click", () => void load(""));
  need("keep-text").addEventListener("click", () => void keepText());
  for (const button of document.querySelectorAll("#sides button")) {
    button.addEventListener("click", () => showSide(/** @type {HTMLElement} */ (button).dataset.side ?? ""));
  }
  window.addEventListener("beforeunload", (event) => {
    if (!isSaved()) event.preventDefault();
  });
  showSide("text");
  const draft = sessionStorage.getItem(DRAFT);
  await load("");
  if (draft !== null && draft !== text()) {
    putText(editor, draft);
    say("Text that was not saved is here again");
  }
  if (!text()) void compute();
  beginWork(isSaved, noticeFile);
}

void begin();

// Tables that Python made: sorted, filtered, taken away as data, and their rows chosen.
import { find, make, say } from "./dom.js";
import { saveTable } from "./downloads.js";
import { choose, state } from "./state.js";

/** @param {HTMLTableElement} table @returns {HTMLTableRowElement[]} */
const rowsOf = (table) => [...table.tBodies[0].rows];

/** Make all tables work. */
export function beginTables() {
  for (const table of document.querySelectorAll("table")) {
    if (table.dataset.sortable !== undefined) makeSortable(table);
    if (table.id) addCsv(table);
  }
  document.addEventListener("click", (event) => {
    const caveat = event.target instanceof Element ? event.target.closest(".caveat") : null;
    if (caveat) say(caveat.getAttribute("title") ?? "");
    const chosen = event.target instanceof Element ? event.target.closest("[data-choice]") : null;
    if (chosen) chooseByName(chosen.getAttribute("data-choice") ?? "");
  });
  find("filter")?.addEventListener("input", filterList);
}

/** @param {string} choice such as resonance:GROUP:VARIANT:NUMBER */
function chooseByName(choice) {
  const [kind, ...rest] = choice.split(":");
  const last = rest.pop() ?? "";
  if (kind === "resonance") choose({ group: rest[0], variant: rest[1], resonance: Number(last) });
  if (kind === "mode") choose({ model: rest[0], mode: Number(last), resonance: -1 });
  if (kind === "channel") choose({ group: rest[0], variant: rest[1], channel: last, view: "variant" });
  const lead = { mode: "mode", channel: "waterfall" }[kind];
  if (lead) find(lead)?.scrollIntoView({ block: "nearest" });
  if (kind === "resonance") say(`Resonance ${Number(last) + 1} selected`);
}

/** @param {HTMLTableElement} table */
function makeSortable(table) {
  [...table.tHead?.rows[0].cells ?? []].forEach((head, column) => {
    const button = make("button", { type: "button" }, head.textContent ?? "");
    button.addEventListener("click", () => sort(table, column, head));
    head.replaceChildren(button);
  });
}

/** @param {HTMLTableElement} table @param {number} column @param {HTMLElement} head */
function sort(table, column, head) {
  const rising = head.getAttribute("aria-sort") === "descending";
  for (const other of table.tHead?.rows[0].cells ?? []) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", rising ? "ascending" : "descending");
  const rows = rowsOf(table);
  const key = (/** @type {HTMLTableRowElement} */ row) => {
    const cell = row.cells[column];
    const order = cell.dataset.order;
    if (order === undefined) return cell.textContent ?? "";
    return order === "" ? -Infinity : Number(order.replace("inf", "Infinity"));
  };
  rows.sort((a, b) => {
    const [one, two] = [key(a), key(b)];
    const order = typeof one === "number" && typeof two === "number" ? one - two : String(one).localeCompare(String(two));
    return rising ? order : -order;
  });
  table.tBodies[0].append(...rows);
}

/** @param {HTMLTableElement} table */
function addCsv(table) {
  const title = table.dataset.title || table.id;
  const button = make("button", { type: "button", "aria-label": `CSV: ${title}` }, "CSV");
  button.addEventListener("click", () => {
    saveTable(title, [...table.rows].map((row) => [...row.cells].map(plain)));
  });
  table.parentElement?.before(make("div", { class: "tools of-table" }, button));
}

/** Content of a cell for data: its number in the unit of the heading, or its text. @param {HTMLTableCellElement} cell */
function plain(cell) {
  const text = (cell.textContent ?? "").trim();
  return cell.dataset.order ?? (text === "–" ? "" : text);
}

/** Show the rows of the lists of resonances that fit. */
export function filterList() {
  const words = /** @type {HTMLInputElement | null} */ (find("filter"))?.value.toLowerCase() ?? "";
  for (const row of /** @type {NodeListOf<HTMLTableRowElement>} */ (document.querySelectorAll("#ranking .listed tbody tr"))) {
    const said = (row.textContent ?? "").toLowerCase();
    const beyond = row.classList.contains("outside") ? state.extent !== "all" : row.classList.contains("further") && state.extent === "first";
    row.hidden = beyond || !said.includes(words);
  }
}

/** Mark the chosen resonance in the list and in the drawings. */
export function markRow() {
  const chosen = `resonance:${state.group}:${state.variant}:${state.resonance}`;
  for (const own of document.querySelectorAll("tr[data-choice], g[data-choice]")) {
    const on = own.getAttribute("data-choice") === chosen;
    own.classList.toggle("chosen", on);
    if (on) own.setAttribute("aria-current", "true");
    else own.removeAttribute("aria-current");
  }
}

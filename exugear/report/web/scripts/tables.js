// Tables that Python made: sorted, filtered, taken away as data, and their rows chosen.
import { find, make, need, say } from "./dom.js";
import { saveTable } from "./downloads.js";
import { pageData } from "./page_data.js";
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
    const chosen = event.target instanceof Element ? event.target.closest("[data-choice]") : null;
    if (chosen instanceof HTMLElement) chooseByName(chosen.dataset.choice ?? "");
  });
  for (const name of ["filter", "only-lacking", "limit"]) find(name)?.addEventListener("input", filterRanking);
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

/** Show the rows of the ranking that fit; the same for all of its tables. */
export function filterRanking() {
  const words = /** @type {HTMLInputElement | null} */ (find("filter"))?.value.toLowerCase() ?? "";
  const lacking = /** @type {HTMLInputElement | null} */ (find("only-lacking"))?.checked ?? false;
  for (const table of document.querySelectorAll("table")) {
    if (!table.id.startsWith("ranking-")) continue;
    for (const row of rowsOf(table)) {
      const said = (row.textContent ?? "").toLowerCase();
      const speed = Number(row.cells[2].dataset.order);
      row.hidden = !said.includes(words) || (lacking && !said.includes("absent")) || speed > state.limit + 1e-9;
    }
  }
}

/** Mark the row of the chosen resonance. */
export function markRow() {
  const chosen = `resonance:${state.group}:${state.variant}:${state.resonance}`;
  for (const row of document.querySelectorAll("tr[data-choice]")) {
    const own = row instanceof HTMLElement && row.dataset.choice === chosen;
    row.classList.toggle("chosen", own);
    if (own) row.setAttribute("aria-current", "true");
    else row.removeAttribute("aria-current");
  }
}

/** Range of speeds: a slider, and a button for those around the rated one. */
export function beginLimit() {
  const slider = /** @type {HTMLInputElement | null} */ (find("limit"));
  if (!slider) return;
  slider.addEventListener("input", () => choose({ limit: Number(slider.value) }));
  const rated = pageData.rated;
  if (rated === null) return;
  const button = need("rated");
  button.hidden = false;
  button.addEventListener("click", () => choose({ limit: Math.ceil(1.25 * rated) }));
}

/** @param {number} top highest speed, rpm */
export function drawLimit(top) {
  const slider = /** @type {HTMLInputElement | null} */ (find("limit"));
  if (!slider) return;
  slider.min = String(Math.min(top, Math.max(1, Math.round(top / 40))));
  slider.max = String(top);
  slider.value = String(state.limit);
  need("limit-shown").textContent = `${state.limit} rpm`;
  filterRanking();
}

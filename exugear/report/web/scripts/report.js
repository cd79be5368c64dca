// The report: all parts begun, and told what changes.
import { beginCharts, redrawCharts, unpackCharts } from "./charts.js";
import { drawCuts } from "./cuts.js";
import { drawDetail } from "./detail.js";
import { find } from "./dom.js";
import { beginModeView, drawMode } from "./mode_view.js";
import { beginSpeedCursor } from "./speed_cursor.js";
import { onChange, recall } from "./state.js";
import { beginSwitches, drawSwitches, showChosen } from "./switches.js";
import { beginTables, filterList, markRow } from "./tables.js";
import { beginTheme } from "./theme.js";
import { drawWaterfall } from "./waterfall.js";

const hasRuns = find("waterfall") !== null;

/** @param {Set<string>} changed @param {string[]} keys */
const any = (changed, keys) => keys.some((key) => changed.has(key));

/** @param {Set<string>} changed @returns {Promise<unknown>} */
async function redraw(changed) {
  /** @type {Promise<unknown>[]} */
  const drawn = [];
  if (hasRuns) {
    if (any(changed, ["group", "variant", "view", "channel", "extent"])) drawSwitches();
    if (any(changed, ["group", "variant"])) showChosen();
    if (any(changed, ["group", "variant", "extent"])) filterList();
    markRow();
    drawDetail();
    const over = ["group", "variant", "view", "channel", "extent", "resonance", "lines"];
    if (any(changed, over)) drawn.push(drawWaterfall(), drawCuts());
  }
  if (any(changed, ["model", "mode"])) drawn.push(drawMode());
  return Promise.all(drawn);
}

/** @type {Promise<unknown>} */
let drawing = Promise.resolve();
onChange((changed) => (drawing = redraw(changed)));

/** Draw all figures anew, in the colours of now. @param {boolean} all also those that were not in view so far */
function recolour(all) {
  if (hasRuns) void Promise.all([drawWaterfall(), drawCuts()]);
  void Promise.all([redrawCharts(all), drawMode()]);
}

beginTheme(recolour);
function begin() {
  beginSwitches();
  beginTables();
  beginSpeedCursor();
  beginModeView();
  recall();
  beginCharts();
  void drawing.finally(() => {
    document.documentElement.setAttribute("data-ready", "");
    // Nobody waits for a stream while a page is printed: what figures are drawn of is unpacked before.
    setTimeout(() => void unpackCharts(), 2000);
  });
}

// Cards and tables are painted first: they can be read while figures are drawn.
requestAnimationFrame(() => setTimeout(begin));

// What a job without an image has measured: a table of its meters, from the report.
import { h } from "../dom.js";
import { isOver } from "../state.js";
import { plural } from "../format.js";

const kMost = 500; // most rows drawn; all are in the file

const figure = (value) => (Number.isFinite(value) ? Number(value).toPrecision(5) : "–");

export function meterPanel(state, job) {
  const meters = state.open.report?.meters ?? [];
  return h("section", { class: "panel meters", "aria-label": "Measured values" },
    meters.length === 0
      ? h("p", { key: "waiting", class: "help" }, isOver(job) ? "No sample was taken." : "The first samples are being taken.")
      : h("table", { key: "table" },
        h("thead", null, h("tr", null, ["Meter", "R", "G", "B", "Luminance", "95 % interval", "Unit"].map((title) => h("th", { key: title, scope: "col" }, title)))),
        h("tbody", null, meters.slice(0, kMost).map(row))),
    meters.length > kMost ? h("p", { key: "more", class: "help" }, `and ${plural(meters.length - kMost, "more meter")}, in the file below`) : null);
}

function row({ name, value, luminance, luminance_ci95: ci, unit, trusted }, i) {
  return h("tr", { key: i },
    h("th", { scope: "row" }, name),
    value.map((channel, c) => h("td", { key: c, class: "number" }, figure(channel))),
    h("td", { key: "luminance", class: "number" }, figure(luminance)),
    h("td", { key: "interval" }, ci === null ? "no sample has found light" : `${figure(ci[0])} to ${figure(ci[1])}${trusted ? "" : ": don't trust yet"}`),
    h("td", { key: "unit" }, unit));
}

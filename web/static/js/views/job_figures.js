// The figures of one job, and its tiles in flight.
import { h } from "../dom.js";
import { colourOf, healthComplaints, isOver } from "../state.js";
import { count, duration, figure, interval, plural, spp } from "../format.js";
import { workerMark } from "./pieces.js";

const kListed = 12;

/** report: its verdict says in words when the error estimate is not to be trusted yet. */
export function figures(job, report) {
  const ci = interval(job.relmse_ci95);
  const clean = healthComplaints(job).length === 0;
  return h("dl", { class: "panel figures" },
    fact("relMSE", figure(job.relmse), ci ? [ci, h("i", { key: "ci" }, "95 % interval")] : "not known yet", "key"),
    report?.trusted === false ? h("p", { key: "verdict", class: "verdict" }, report.verdict || "This error estimate can't be trusted yet.") : null,
    fact("Samples per pixel", spp(job.spp_done), `of ${count(job.spp)}`, "key"),
    isOver(job) ? fact("Took", duration(job.elapsed_seconds), "wall clock", "key") : fact("Time left", duration(job.eta_seconds), timeNote(job), "key"),
    fact("RMSE", figure(job.rmse)),
    fact("Core time", duration(job.core_seconds)),
    fact("Units", count(job.units_done), `of ${count(job.units_total)}`),
    fact("Numeric health", clean ? "clean" : "see above", null, clean ? "good" : "bad"));
}

/** What the forecast leaves open, and what more workers would do. */
function timeNote(job) {
  const range = job.eta_ci95 ? `${duration(job.eta_ci95[0])} to ${duration(job.eta_ci95[1])}` : null;
  const more = typeof job.eta_with_8_more === "number" ? `${duration(job.eta_with_8_more)} with 8 more workers` : null;
  return [range, more, `${duration(job.elapsed_seconds)} so far`].filter(Boolean).join(", ");
}

const fact = (name, value, note, className = "") => h("div", { key: name, class: `fact ${className}` }, h("dt", null, name), h("dd", null, h("b", null, value), note ? h("small", null, note) : null));

export function inFlight(state, job) {
  if (isOver(job)) return null;
  const tiles = [...state.open.tiles.values()];
  return h("section", { key: "flight", class: "panel flight" },
    h("h2", null, "Tiles in flight", tiles.length ? h("span", { class: "count" }, tiles.length) : null),
    tiles.length === 0 ? h("p", { class: "help" }, "None at this moment.") : h("ul", null, tiles.slice(0, kListed).map((tile) => h("li", { key: tile.tile },
      h("span", { class: "number" }, `tile ${tile.tile}`),
      h("span", { class: "number dim" }, `${spp(tile.spp)} spp`),
      h("span", null, tile.workers.map((name) => workerMark(colourOf(state, name), name)))))),
    tiles.length > kListed ? h("p", { class: "help" }, `and ${plural(tiles.length - kListed, "more", "more")}`) : null);
}

// The figures of one job, and its tiles in flight.
import { h } from "../dom.js";
import { colourOf, healthComplaints, isOver } from "../state.js";
import { count, duration, figure, given, interval, plural, spp } from "../format.js";
import { workerMark } from "./pieces.js";

const kListed = 12;

/** What follows each figure has its lines kept free, so that nothing moves when it becomes known. */
export function figures(job) {
  const ci = interval(job.relmse_ci95);
  const clean = healthComplaints(job).length === 0;
  return h("dl", { class: "panel figures" },
    fact("relMSE", figure(job.relmse), [ci ? `95 %: ${ci}` : "not known yet", job.target_error > 0 ? `target ${given(job.target_error)}` : null], "key"),
    isOver(job) ? fact("Took", duration(job.elapsed_seconds), ["wall clock"], "key") : fact("Time left", duration(job.eta_seconds), timeNotes(job), "key"),
    fact("Samples per pixel", spp(job.spp_done), [`of ${count(job.spp)}`]),
    fact("RMSE", figure(job.rmse)),
    fact("Core time", duration(job.core_seconds)),
    job.reference ? trueFigures(job.reference) : null,
    fact("Units", count(job.units_done), [`of ${count(job.units_total)}`]),
    fact("Numeric health", clean ? "clean" : "see above", [], clean ? "good" : "bad"));
}

const between = (interval) => (Array.isArray(interval) ? ` (${duration(interval[0])} to ${duration(interval[1])})` : "");

/** What the forecast leaves open, and what more workers would do. */
function timeNotes(job) {
  return [
    job.eta_ci95 ? `95 %: ${duration(job.eta_ci95[0])} to ${duration(job.eta_ci95[1])}` : `${duration(job.elapsed_seconds)} so far`,
    typeof job.eta_with_8_more === "number" ? `with 8 more: ${duration(job.eta_with_8_more)}${between(job.eta_with_8_more_ci95)}` : null];
}

const trueFigures = ({ relmse, rmse, flip }) => [
  fact("True relMSE", figure(relmse), ["against the reference"], "true"), fact("True RMSE", figure(rmse), [], "true"),
  flip === null || flip === undefined ? null : fact("FLIP", figure(flip), [], "true")];

const fact = (name, value, notes = [], className = "") => h("div", { key: name, class: `fact ${className}` }, h("dt", null, name),
  h("dd", null, h("b", null, value), notes.filter(Boolean).map((note, i) => h("small", { key: i }, note))));

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

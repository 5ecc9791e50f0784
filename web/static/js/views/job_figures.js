// The numbers of one job, and its tiles being rendered.
import { h } from "../dom.js";
import { colourOf, healthComplaints, isOver } from "../state.js";
import { count, duration, figure, given, interval, percent, plural, spp } from "../format.js";
import { phrases } from "../phrases.js";
import { atLeast, confidence, denoisedTarget, doubtful, kDoubtWords, trueFigure } from "../verdict.js";
import { workerMark } from "./pieces.js";

const kListed = 12;

/** What follows each figure has its lines kept free, so that nothing moves when it becomes known. denoised: the error of the denoised picture, or why there is none; absent until it is known. */
export function figures(job, denoised) {
  const clean = healthComplaints(job).length === 0;
  return h("dl", { class: "panel figures" },
    fact("relMSE", figure(job.relmse), [confidence(job, job.relmse_ci95) ?? "not known yet", job.target_error > 0 && !denoisedTarget(job) ? target(job) : null], "key"),
    job.denoise || denoisedTarget(job) ? denoisedFact(job, denoised) : null,
    isOver(job) ? fact("Took", duration(job.elapsed_seconds), ["wall clock"], "key") : fact(atLeast(job) ? "Time left, at least" : "Time left", duration(job.eta_seconds), timeNotes(job), "key"),
    fact("Samples per pixel", spp(job.spp_done), samplesAsked(job)),
    fact("RMSE", figure(job.rmse), [confidence(job, job.rmse_ci95)]),
    fact("Core time", duration(job.core_seconds)),
    fact("Efficiency", figure(job.efficiency_per_core), ["1 / (relMSE × core s)"]),
    job.reference ? trueFigures(job.reference, job.reference_same_seed === true) : null,
    job.class_share && job.class_share.share < 1 ? fact("Can take it", percent(job.class_share.share), [`${count(job.class_share.workers)} of ${plural(job.class_share.of_workers, "worker")}: the others' processors or builds round differently`]) : null,
    fact("Parts of the work", count(job.units_done), [`of ${count(job.units_total)}`]),
    fact("Broken numbers", clean ? "none" : "see above", [], clean ? "good" : "bad"));
}

const target = (job) => `target ${given(job.target_error)}`;

/** The error of the denoised picture: of the finished one, before that as the target was last compared with it. */
function denoisedFact(job, denoised) {
  const targeted = job.target_error > 0 && denoisedTarget(job);
  const check = targeted ? job.denoised_check : null;
  if (typeof denoised?.relmse !== "number") return fact("relMSE, denoised", figure(check?.relmse), [denoised?.error ?? denoisedNote(check, isOver(job)), targeted ? target(job) : null], "key");
  const known = interval(denoised.relmse_ci95);
  return fact("relMSE, denoised", figure(denoised.relmse), [known ? `95 %: ${known}` : "no interval", targeted ? target(job) : null], "key");
}

/** Of the last comparison with the target. */
function denoisedNote(check, over) {
  if (!check) return over ? "not known" : "known when it is done";
  return check.at_most === null ? "no interval" : `95 %: at most ${figure(check.at_most)}`;
}

/** Of a job that only a target error or a time ends, `spp` is a limit that nobody asked for. */
function samplesAsked(job) {
  if (job.spp_asked !== null) return [`of ${count(job.spp)}`];
  const end = job.target_error > 0 ? ["until the target", "for the target"] : ["until its time is up", "in its time"];
  return [end[isOver(job) ? 1 : 0], `at most ${count(job.spp)}`];
}

const between = (interval) => (Array.isArray(interval) ? ` (${duration(interval[0])} to ${duration(interval[1])})` : "");

/** What the forecast leaves open, and what more workers would do. */
function timeNotes(job) {
  const sure = !doubtful(job.verdict);
  return [
    sure && job.eta_ci95 ? `95 %: ${duration(job.eta_ci95[0])} to ${duration(job.eta_ci95[1])}` : `${duration(job.elapsed_seconds)} so far`,
    job.eta_with_more ? `with ${job.eta_with_more.workers} more: ${duration(job.eta_with_more.seconds)}${sure ? between(job.eta_with_more.ci95) : ""}` : null];
}

const trueFigures = ({ relmse, rmse, flip, below_noise: below, rmse_below_noise: rmseBelow }, sameSeed) => [
  fact("True relMSE", trueFigure(relmse, below), [sameSeed ? phrases.oneSeed : phrases.againstReference], "true"),
  fact("True RMSE", trueFigure(rmse, rmseBelow), [], "true"),
  flip === null || flip === undefined ? null : fact("FLIP", figure(flip), [], "true")];

const fact = (name, value, notes = [], className = "") => h("div", { key: name, class: `fact ${className}` }, h("dt", null, name),
  h("dd", null, h("b", null, value), notes.filter(Boolean).map((note, i) => h("small", { key: i, class: kDoubtWords.has(note) ? "doubt" : null }, note))));

export function inFlight(state, job) {
  if (isOver(job)) return null;
  const tiles = [...state.open.tiles.values()];
  return h("section", { key: "flight", class: "panel flight" },
    h("h2", null, "Tiles being rendered", tiles.length ? h("span", { class: "count" }, tiles.length) : null),
    tiles.length === 0 ? h("p", { class: "help" }, "None at this moment.") : h("ul", null, tiles.slice(0, kListed).map((tile) => h("li", { key: tile.tile },
      h("span", { class: "number" }, `tile ${tile.tile}`),
      h("span", { class: "number dim" }, `${spp(tile.spp)} spp`),
      h("span", null, tile.workers.map((name) => workerMark(colourOf(state, name), name)))))),
    tiles.length > kListed ? h("p", { class: "help" }, `and ${plural(tiles.length - kListed, "more", "more")}`) : null);
}

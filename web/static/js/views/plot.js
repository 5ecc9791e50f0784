// Error against time: the choice of the axis, the drawing, the values at the chosen point, and all values as
// a table.
import { h } from "../dom.js";
import { aheadOf, drawable } from "../plot_scale.js";
import { duration, figure, given, interval, spp } from "../format.js";
import { phrases } from "../phrases.js";
import { denoisedTarget, doubtWord, doubtful, kDoubts, kUnsure, trueFigure, verdictOf } from "../verdict.js";
import { choice } from "./pieces.js";
import { boxOf, drawing, frameOf } from "./plot_drawing.js";

const kClocks = [["seconds", "Wall time"], ["core_seconds", "Core time"]];
const kSince = { seconds: "after the first ray", core_seconds: "of core time" };

/** open: {clock, picked, report}; actions: pickPoint(index, null, or what gives one from that of before), setClock(key). narrow: the page is as wide as a phone. */
export function errorPlot(job, { clock, picked, report }, actions, narrow) {
  const points = drawable(report?.convergence, clock);
  const plot = { points, key: clock, target: denoisedTarget(job) ? null : job.target_error ?? report?.target_error ?? null, ahead: aheadOf(job, report, clock), narrow };
  const verdict = verdictOf(job, report);
  plot.doubt = doubtful(verdict) ? doubtWord(verdict) : null;
  if (plot.doubt) withoutIntervals(plot);
  plot.chosen = points[picked] ? picked : points.length - 1;
  return h("section", { key: "plot", class: "panel plot", "aria-labelledby": "plot-title" },
    h("div", { class: "panel-head" }, h("h2", { id: "plot-title" }, "Error against time"), choice("clock", "Time axis", kClocks, clock, actions.setClock)),
    points.length === 0 ? empty(narrow) : figureOf(plot, actions),
    h("p", { class: "plot-verdict" }, verdictWords(report, verdict)),
    table(plot));
}

/** What each checkpoint was worth is not kept: in doubt about the last there are none at all. */
function withoutIntervals(plot) {
  plot.points = plot.points.map((p) => ({ ...p, relmse_ci95: null }));
  if (plot.ahead) plot.ahead = { ...plot.ahead, lo: null, hi: null };
}

function empty(narrow) {
  const box = boxOf(narrow);
  const rows = phrases.noPointYet.split(/ (?=has )/); // half of the sentence each, for narrow pages
  return h("figure", { key: "empty" },
    h("svg", { class: "plot-empty", viewBox: `0 0 ${box.width} ${box.height}`, role: "img", "aria-label": "No point yet" },
      rows.map((text, line) => h("text", { key: line, x: box.width / 2, y: box.height / 2 + 18 * line, "text-anchor": "middle" }, text))),
    h("figcaption", { class: "plot-reading" }));
}

function figureOf(plot, actions) {
  const { points, key, chosen } = plot;
  const frame = frameOf(plot);
  return h("figure", { key: "figure" },
    h("svg", {
      viewBox: `0 0 ${frame.box.width} ${frame.box.height}`, "aria-label": summary(plot), tabindex: 0,
      role: "slider", "aria-valuemin": 1, "aria-valuemax": points.length, "aria-valuenow": chosen + 1, "aria-valuetext": spoken(points[chosen], key),
      onpointermove: (event) => actions.pickPoint(nearest(event, points, key, frame)), onpointerleave: () => actions.pickPoint(null),
      onkeydown: (event) => step(event, points.length, actions), onblur: () => actions.pickPoint(null),
    }, drawing(plot, frame)),
    h("figcaption", { class: "plot-reading" }, reading(points[chosen], plot), forecastText(plot)));
}

function nearest(event, points, key, { x, box }) {
  const place = event.currentTarget.getBoundingClientRect();
  const at = ((event.clientX - place.left) / place.width) * box.width;
  const distance = (p) => Math.abs(x.at(p[key]) - at);
  return points.reduce((best, p, i) => (distance(p) < distance(points[best]) ? i : best), 0);
}

/** The arrow keys walk along the points, from the one that is chosen by now; Home and End go to the first and the last. */
function step(event, count, actions) {
  const by = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, Home: -count, End: count }[event.key];
  if (by === undefined) return;
  event.preventDefault();
  actions.pickPoint((picked) => Math.min(count - 1, Math.max(0, (picked < count && picked !== null ? picked : count - 1) + by)));
}

const spoken = (point, key) => `relMSE ${figure(point.relmse)} after ${duration(point[key])}`;

function reading(point, { key, doubt }) {
  const ci = interval(point.relmse_ci95);
  const within = doubt ? ` (${doubt})` : ci ? ` (95 %: ${ci})` : null;
  return [
    h("span", { key: "t" }, h("b", null, duration(point[key])), ` ${kSince[key]}`),
    h("span", { key: "e" }, "relMSE ", h("b", null, figure(point.relmse)), within),
    Number.isFinite(point.true_relmse) ? h("span", { key: "r", class: "true" }, point.true_relmse_below_noise === true ? "true error " : `${phrases.againstReference} `, h("b", null, trueFigure(point.true_relmse, point.true_relmse_below_noise)), point.true_flip >= 0 ? `, FLIP ${figure(point.true_flip)}` : null) : null,
    h("span", { key: "s" }, h("b", null, spp(point.spp)), " samples per pixel")];
}

function forecastText({ ahead, target, doubt }) {
  if (!ahead) return null;
  const at = doubt ? "not before" : "at";
  const ci = ahead.lo !== null ? ` (${duration(ahead.lo)} to ${duration(ahead.hi)})` : null;
  return h("span", { key: "f", class: "forecast" }, `target ${given(target)} ${at} `, h("b", null, duration(ahead.x)), ci, ahead.more ? `, with ${ahead.more.workers} more workers ${at} ${duration(ahead.more.x)}` : null);
}

/** The slope with its interval, and what it means, in words. */
function verdictWords(report, verdict) {
  if (!report) return null;
  const signed = (x) => x.toFixed(2).replace("-", "−");
  const ci = Array.isArray(report.slope_ci95) && !doubtful(verdict) ? ` (${report.slope_ci95.map(signed).join(" to ")})` : "";
  return [
    typeof report.slope === "number" ? h("span", { key: "slope", title: `Of log error over log time; ${phrases.independentSamples}` }, "slope ", h("b", null, signed(report.slope)), ci) : null,
    doubtful(verdict)
      ? h("span", { key: "words", class: "doubt" }, verdict.words || (kDoubts[verdict.kind] ?? kUnsure))
      : h("span", { key: "words" }, verdict.words)];
}

const kColumns = [
  ["Time", (p) => duration(p.seconds)], ["Core time", (p) => duration(p.core_seconds)], ["Samples", (p) => spp(p.spp)],
  ["relMSE", (p) => figure(p.relmse)], ["95 % interval", (p) => interval(p.relmse_ci95)], ["True relMSE", (p) => trueFigure(p.true_relmse, p.true_relmse_below_noise)]];

function table({ points, doubt }) {
  const truth = points.some((p) => p.true_relmse > 0);
  const columns = kColumns.filter(([name]) => (name === "95 % interval" ? !doubt : name === "True relMSE" ? truth : true));
  return h("details", { key: "table", class: "plot-table" }, h("summary", null, "As a table"),
    doubt ? h("p", { key: "why", class: "help" }, phrases.noIntervals) : null,
    h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Error at each checkpoint" }, h("table", null,
      h("thead", null, h("tr", null, columns.map(([name]) => h("th", { key: name, scope: "col" }, name)))),
      h("tbody", null, points.map((p, i) => h("tr", { key: i }, columns.map(([name, text]) => h("td", { key: name }, text(p)))))))));
}

function summary({ points, key, target }) {
  const last = points.at(-1);
  return `Error against time: relMSE ${figure(last.relmse)} after ${duration(last[key])}` + (target > 0 ? `, target ${given(target)}` : "");
}

// Logarithmic axes for the error plot: ranges, ticks, labels. No drawing. util/report/log_axis.cpp, which draws the
// same plot into reports, follows the same rules.
import { superscript } from "./format.js";
import { denoisedTarget } from "./verdict.js";

const kMargin = 0.06; // margin on either side, as a share of the range
const kShort = 2.2; // decades: a shorter axis also has labels at 2 and 5
const kFine = 4.5; // decades: a shorter axis has lines at 2 to 9
const kMostLabels = 8;
const kFewTimes = 4; // with fewer labels of time, intermediate times are added
const kFarthest = 300; // largest distance from 1 in decades: near the range of numbers
const [kMinute, kHour, kDay] = [60, 3600, 86400];

/** A log axis from values in [lo, hi] (both > 0) to pixels [from, to]; at least one decade wide. */
export function logAxis(lo, hi, from, to) {
  let a = Math.log10(lo);
  let b = Math.log10(hi);
  const pad = Math.max((1 - (b - a)) / 2, kMargin * (b - a));
  a = Math.max(a - pad, -kFarthest);
  b = Math.min(b + pad, kFarthest);
  return { lo: 10 ** a, hi: 10 ** b, at: (x) => from + ((Math.log10(x) - a) / (b - a)) * (to - from) };
}

const inside = (axis, value) => value >= axis.lo && value <= axis.hi;

/** [{value, label, major}]: decades, and what lies between where the axis is short; label "": a line alone. */
export function errorTicks(axis) {
  const decades = Math.log10(axis.hi) - Math.log10(axis.lo);
  const every = Math.floor(decades / kMostLabels) + 1;
  const out = [];
  for (let n = Math.floor(Math.log10(axis.lo)); n <= Math.ceil(Math.log10(axis.hi)); n += 1) {
    for (let step = 1; step <= 9; step += 1) {
      const value = Number(`${step}e${n}`);
      if (!inside(axis, value) || (step > 1 && decades > kFine)) continue;
      const named = step === 1 ? n % every === 0 : decades < kShort && (step === 2 || step === 5);
      out.push({ value, label: named ? errorLabel(step, n) : "", major: step === 1 });
    }
  }
  return out;
}

function errorLabel(step, n) {
  if (n >= -3 && n <= 3) return String(Number(`${step}e${n}`));
  return `${step === 1 ? "" : `${step}·`}10${superscript(n)}`;
}

/** Times that people count in. */
export function timeTicks(axis) {
  let times = usualTimes(axis, true);
  if (times.length < kFewTimes) times = usualTimes(axis, false);
  const every = Math.ceil(times.length / kMostLabels);
  return times.map((value, i) => ({ value, label: i % every === 0 ? timeLabel(value) : "", major: true }));
}

function usualTimes(axis, coarse) {
  const out = [];
  const take = (unit, few, all) => out.push(...(coarse ? few : all).map((step) => step * unit).filter((value) => inside(axis, value)));
  for (let n = Math.floor(Math.log10(axis.lo)); n < 0; n += 1) take(10 ** n, [1], [1, 2, 5]);
  for (const unit of [1, kMinute]) take(unit, [1, 10], [1, 2, 5, 10, 20]);
  take(kHour, [1, 10], [1, 2, 5, 10]);
  for (let unit = kDay; unit <= axis.hi; unit *= 10) take(unit, [1], [1, 2, 5]);
  return out;
}

function timeLabel(seconds) {
  const [unit, name] = seconds < kMinute ? [1, "s"] : seconds < kHour ? [kMinute, "min"] : seconds < kDay ? [kHour, "h"] : [kDay, "d"];
  return `${Number((seconds / unit).toPrecision(6))} ${name}`;
}

/** Points that can stand on log axes over the clock `key` ("seconds" or "core_seconds"), in order of time. */
export const drawable = (convergence, key) =>
  (Array.isArray(convergence) ? convergence : [])
    .filter((p) => p && Number.isFinite(p[key]) && p[key] > 0 && Number.isFinite(p.relmse) && p.relmse > 0)
    .sort((a, b) => a[key] - b[key]);

/**
 * When the error will be down to the job's target, over the same clock: {x, lo, hi, more}, lo, hi and more ({x, workers}: with so
 * many more workers) null if they are not known; null if nothing is forecast, or it is reached.
 */
export function aheadOf(job, report, key) {
  const last = drawable(report?.convergence, key).at(-1);
  const forecast = report?.forecast;
  const target = denoisedTarget(job) ? null : job.target_error;
  if (!last || !(target > 0) || last.relmse <= target) return null;
  if (key === "seconds" && job.eta_seconds > 0 && Array.isArray(job.eta_ci95)) {
    const [lo, hi] = job.eta_ci95.map((eta) => job.elapsed_seconds + eta);
    return { x: job.elapsed_seconds + job.eta_seconds, lo, hi, more: job.eta_with_more?.seconds > 0 ? { x: job.elapsed_seconds + job.eta_with_more.seconds, workers: job.eta_with_more.workers } : null };
  }
  if (!(forecast?.asked && forecast.core_seconds > 0)) return null;
  // The remaining time assumes the previous pace
  const pace = key === "seconds" ? last.seconds / last.core_seconds : 1;
  const at = (core) => last[key] + pace * core;
  const [lo, hi] = Array.isArray(forecast.core_seconds_ci95) ? forecast.core_seconds_ci95.map(at) : [null, null];
  return Number.isFinite(pace) ? { x: at(forecast.core_seconds), lo, hi, more: null } : null;
}

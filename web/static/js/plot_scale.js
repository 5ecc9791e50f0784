// Logarithmic axes for the error plot: ranges, ticks, fits. No drawing.
import { superscript } from "./format.js";

/** A log axis from values in [lo, hi] (both > 0) to pixels [from, to]; at least one decade wide. */
export function logAxis(lo, hi, from, to) {
  let a = Math.log10(lo);
  let b = Math.log10(hi);
  const pad = Math.max((1 - (b - a)) / 2, 0.06 * (b - a));
  a -= pad;
  b += pad;
  return { lo: 10 ** a, hi: 10 ** b, at: (x) => from + ((Math.log10(x) - a) / (b - a)) * (to - from) };
}

/** [{value, label, major}]: decades, and 2 and 5 between them where the axis is short. */
export function ticks(axis, label) {
  const first = Math.floor(Math.log10(axis.lo));
  const last = Math.ceil(Math.log10(axis.hi));
  const steps = Math.log10(axis.hi / axis.lo) < 2.2 ? [1, 2, 5] : [1];
  const out = [];
  for (let n = first; n <= last; n += 1) {
    for (const step of steps) {
      const value = step * 10 ** n;
      if (value >= axis.lo && value <= axis.hi) out.push({ value, label: label(value, step, n), major: step === 1 });
    }
  }
  return out;
}

export const errorLabel = (value, step, n) => (n >= -3 && n < 2 ? String(Number(value.toPrecision(2))) : `${step === 1 ? "" : `${step}·`}10${superscript(n)}`);

export function timeLabel(seconds) {
  if (seconds < 1000) return `${Number(seconds.toPrecision(2))} s`;
  return seconds < 3600 ? `${Math.round(seconds / 60)} min` : `${Math.round(seconds / 360) / 10} h`;
}

/** Least squares of log error on log seconds over the later half of the points: {slope, at(seconds)}, or null below three. */
export function fit(points) {
  const late = points.slice(Math.min(Math.floor(points.length / 2), Math.max(0, points.length - 3)));
  if (late.length < 3) return null;
  const xs = late.map((p) => Math.log(p.seconds));
  const ys = late.map((p) => Math.log(p.relmse));
  const mean = (v) => v.reduce((a, b) => a + b, 0) / v.length;
  const [mx, my] = [mean(xs), mean(ys)];
  const spread = xs.reduce((sum, x) => sum + (x - mx) ** 2, 0);
  if (spread === 0) return null;
  const slope = xs.reduce((sum, x, i) => sum + (x - mx) * (ys[i] - my), 0) / spread;
  return { slope, at: (seconds) => Math.exp(my + slope * (Math.log(seconds) - mx)) };
}

/** Points that can stand on log axes, in order of time. */
export const drawable = (convergence) =>
  (Array.isArray(convergence) ? convergence : [])
    .filter((p) => p && p.seconds > 0 && p.relmse > 0 && Number.isFinite(p.relmse))
    .sort((a, b) => a.seconds - b.seconds);

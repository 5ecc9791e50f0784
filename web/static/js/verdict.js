// Whether the error figures of a job can be trusted, and the text that is shown otherwise.
import { duration, figure, interval } from "./format.js";
import { phrases } from "./phrases.js";

/** Why an error can't be trusted, in a few words: of a job's verdict. */
export const kDoubts = { heavy_tail: "Still noisy: a few bright pixels carry the error", bias_floor: "The error does not fall as it should", early: "Too early to tell the error" };
export const kUnsure = "The error is not known well yet";
const kShortDoubts = { heavy_tail: "still noisy", bias_floor: "not falling as it should", early: "too early to tell" };
const kShortUnsure = "not known well yet";
export const kDoubtWords = new Set([...Object.values(kShortDoubts), kShortUnsure]);
export const doubtWord = (verdict) => kShortDoubts[verdict?.kind] ?? kShortUnsure;

const kDoubtful = new Set(["heavy_tail", "bias_floor"]);

/** {kind, words, trusted}; that of an older coordinator has no `trusted`. */
export const doubtful = (verdict) => Boolean(verdict) && (verdict.trusted === false || kDoubtful.has(verdict.kind));

/** The job's own, which comes with every event, or else its report's: null if neither has one. */
export const verdictOf = (job, report) =>
  job.verdict ?? (report ? { kind: report.verdict_kind, words: report.verdict || report.trend, trusted: report.trusted } : null);

/** "95 %: 0.00390 – 0.00448", or why there is no interval. */
export function confidence(job, ci) {
  if (doubtful(job.verdict)) return doubtWord(job.verdict);
  if (job.pixels_without_samples > 0) return "of the part rendered so far";
  const known = interval(ci);
  return known ? `95 %: ${known}` : null;
}

/** A figure against a reference; 0 is never what is meant. */
export const trueFigure = (value, belowNoise) => (belowNoise === true ? phrases.belowNoise : figure(value));

/** Bright outliers that are still missing only ever add to the time to a target; samples that are counted take what they take. */
export const atLeast = (job) => job.target_error > 0 && !denoisedTarget(job) && doubtful(job.verdict);

/** Whether the target error means the denoised layers; the curve and its forecast are of the image itself. */
export const denoisedTarget = (job) => job.target_layer === "denoised";

export function timeLeft(job) {
  const known = typeof job.eta_seconds === "number";
  return known && atLeast(job) ? `at least ${duration(job.eta_seconds)}` : duration(job.eta_seconds);
}

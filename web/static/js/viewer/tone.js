// Converts values to colours on a screen: exposure, curves of single channels, false colours. A curve is a
// table over all half floats, so that a million pixels take a few milliseconds without a graphics card.
import { halfValues } from "./half.js";

const clamped = (x) => (x > 0 ? (x < 1 ? x : 1) : 0);
const srgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const kOfChannel = { linear: (x) => clamped(x), srgb: (x) => srgb(clamped(x)) };

/** The 8-bit code of every half float under a curve of single channels. */
export function codes(curve, exposure) {
  const scale = 2 ** exposure;
  return Uint8ClampedArray.from(halfValues(), (value) => 255 * kOfChannel[curve](value * scale));
}

// The colours of the coordinator's false-colour maps (core/image/exr/maps.h).
const kStops = [[13, 8, 70], [45, 60, 142], [33, 120, 140], [70, 180, 105], [250, 230, 50]];
const kRampSteps = 1024;
let ramp = null;

/** Colours of 0..1, dark to bright: [r, g, b] times kRampSteps + 1. */
function rampColours() {
  ramp ??= Uint8ClampedArray.from({ length: 3 * (kRampSteps + 1) }, (_, i) => {
    const at = (Math.floor(i / 3) / kRampSteps) * (kStops.length - 1);
    const below = Math.min(Math.floor(at), kStops.length - 2);
    return kStops[below][i % 3] + (at - below) * (kStops[below + 1][i % 3] - kStops[below][i % 3]);
  });
  return ramp;
}

/** The false colour of t, to out[at..at + 2]. */
export function falseColour(t, out, at) {
  const colours = rampColours();
  const from = 3 * Math.round((t > 0 ? (t < 1 ? t : 1) : 0) * kRampSteps);
  out[at] = colours[from];
  out[at + 1] = colours[from + 1];
  out[at + 2] = colours[from + 2];
}

/** Where a value lies on a logarithmic scale from `least` (0) to `most` (1). */
export const onLogScale = (value, least, most) => (value > least ? Math.log(value / least) / Math.log(most / least) : 0);

export const kErrorScale = [1e-3, 1]; // relative standard error, as in maps.h
export const kSamplesScale = [2, 16384];
export const kRelMseScale = [1e-6, 1];
export const kFalseStops = 8; // number of stops below and above 1 that false colours cover

// Converts values to colours on a screen: exposure, tone curves, false colours. A curve that treats each
// channel separately is a table over all half floats, so that a million pixels take a few milliseconds
// without a graphics card.
import { halfValues } from "./half.js";

export const kCurves = [["srgb", "sRGB"], ["linear", "Linear"], ["filmic", "Filmic"], ["agx", "AgX-like"]];

const clamped = (x) => (x > 0 ? (x < 1 ? x : 1) : 0);
const srgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
// A rational curve with a toe and a shoulder: K. Narkowicz, "ACES filmic tone mapping curve", 2016.
const filmic = (x) => srgb(clamped((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)));
const kOfChannel = { linear: (x) => clamped(x), srgb: (x) => srgb(clamped(x)), filmic: (x) => filmic(Math.max(0, x)) };

/** The 8-bit code of every half float under a curve of single channels. */
export function codes(curve, exposure) {
  const scale = 2 ** exposure;
  return Uint8ClampedArray.from(halfValues(), (value) => 255 * kOfChannel[curve](value * scale));
}

// Similar to AgX (T. Sobotka): colours are mixed a little, so that bright ones lose saturation; then each
// channel goes through a sigmoid over the logarithm of light. 10 stops below and 6.5 above middle grey become
// 0 and 1.
const kBelow = 10;
const kAbove = 6.5;
const kGrey = 0.18;
const kSlope = 2.4; // slope at middle grey
const kPower = 1.5; // sharpness of toe and shoulder
const kMixed = 0.08; // share of each other channel that is mixed in

/** y of (t - pivot), 0 at the dark end, 0.5 at the pivot with kSlope, 1 at the bright end. */
function sigmoid(t) {
  const pivot = kBelow / (kBelow + kAbove);
  const [length, sign] = t < pivot ? [pivot, -1] : [1 - pivot, 1];
  const end = kSlope * length;
  const limit = end / ((end / 0.5) ** kPower - 1) ** (1 / kPower); // makes the curve end at 0 or 1
  const steep = kSlope * Math.abs(Math.min(1, Math.max(0, t)) - pivot);
  return 0.5 + (sign * steep) / (1 + (steep / limit) ** kPower) ** (1 / kPower);
}
const kSteps = 4096;
let sigmoidCodes = null;

/** 8-bit codes of one colour, to out[at..at + 2]. */
export function agx(r, g, b, scale, out, at) {
  sigmoidCodes ??= Uint8ClampedArray.from({ length: kSteps + 1 }, (_, i) => 255 * sigmoid(i / kSteps));
  const mixed = kMixed * (r + g + b);
  const rest = (1 - 3 * kMixed);
  const code = (v) => {
    const t = (Math.log2(Math.max(1e-10, v * scale) / kGrey) + kBelow) / (kBelow + kAbove);
    return sigmoidCodes[t <= 0 ? 0 : t >= 1 ? kSteps : Math.round(t * kSteps)];
  };
  out[at] = code(mixed + rest * r);
  out[at + 1] = code(mixed + rest * g);
  out[at + 2] = code(mixed + rest * b);
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

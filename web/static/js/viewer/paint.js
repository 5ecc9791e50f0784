// Paints one block of a layer: converts values to 8-bit RGBA.
import { isView, viewed } from "./display.js";
import { floatsOf, halfBits, halfValues } from "./half.js";
import { codes, falseColour, kErrorScale, kFalseStops, kRelMseScale, kSamplesScale, onLogScale } from "./tone.js";

const kNoSample = [24, 24, 27]; // colour of pixels without samples, as in the coordinator's previews
// Light of the two kinds of squares behind an image with alpha, at exposure 0, and the side of a square in pixels
const kChecks = [1 / 16, 1 / 8];
const kCheckSide = 8;
const kDimmed = 0.15; // brightness of objects that are not picked
export const kRelMseDenominator = 0.01; // the same as in relative_weights.h

let kept = { key: "", codes: null };

function codesOf(curve, exposure) {
  const key = `${curve} ${exposure}`;
  if (kept.key !== key) kept = { key, codes: codes(curve, exposure) };
  return kept.codes;
}

/** The curve of single channels that stands for a view. */
const singly = (curve) => (isView(curve) ? "srgb" : curve);

/** What a layer shows: "ramp" (error, samples), "matte", "normal", "measure" (a depth, say), or "colour". */
export function kindOf(layer) {
  if (layer.blocks === "first") return "matte";
  if (layer.name === "error" || layer.name === "spp") return "ramp";
  if (/normal$/.test(layer.name)) return "normal";
  return layer.channels.includes("R") ? "colour" : "measure";
}

/**
 * look: {exposure, curve, cube, falseColour, channel, range, matte: Set of picked identifiers}; cube: the table of the
 * view that `curve` names, once it is there; channel: the only one that is shown, as grey; range: [least, most] of a
 * layer that is no light, which become black and white. Returns RGBA, row by row.
 */
export function paint(buffer, layer, look) {
  const kind = kindOf(layer);
  if (kind === "matte") return mattes(new Float32Array(buffer), layer.channels.length, look.matte);
  const halves = new Uint16Array(buffer);
  if (kind === "ramp") return ramped(halves, layer.name === "error" ? kErrorScale : kSamplesScale);
  // the only channel of a layer is shown as grey
  const picked = [0, 1, 2].map((c) => Math.min(c, layer.channels.length - 1));
  if (layer.channels.length === 2) picked[2] = -1;
  if (look.channel !== null && look.channel !== undefined && look.channel < layer.channels.length) picked.fill(look.channel);
  if (kind === "normal") return each(halves, layer.channels.length, (v, out, at) => {
    for (let c = 0; c < 3; c += 1) out[at + c] = 127.5 * (v(picked[c]) + 1);
  });
  if (kind === "measure" && look.range) return each(halves, layer.channels.length, (v, out, at) => measured(picked.map((c) => placed(c < 0 ? 0 : v(c), look.range)), look.falseColour, out, at));
  if (look.falseColour) return each(halves, layer.channels.length, (v, out, at) => {
    const brightness = look.channel !== null && look.channel !== undefined ? v(picked[0]) : layer.channels.length === 3 ? 0.2126 * v(0) + 0.7152 * v(1) + 0.0722 * v(2) : v(0);
    falseColour((Math.log2(brightness) + look.exposure + kFalseStops) / (2 * kFalseStops), out, at);
  });
  if (look.cube) return viewed(look.cube, halves, layer.channels.length, picked, look.exposure, kNoSample);
  return coded(halves, layer.channels.length, picked, codesOf(singly(look.curve), look.exposure));
}

/**
 * The colours of a block, multiplied by alpha, over a checkerboard that looks the same at every exposure. rect: of the
 * block in its level. Returns half floats, as `colours` has them.
 */
export function overChecks(colours, alphas, [x0, y0, x1], exposure) {
  const values = halfValues();
  const [over, alpha] = [new Uint16Array(colours.slice(0)), new Uint16Array(alphas)];
  const width = x1 - x0;
  for (let i = 0; i < alpha.length; i += 1) {
    const passes = 1 - values[alpha[i]];
    if (!(passes > 0)) continue; // or no samples yet
    const [x, y] = [x0 + (i % width), y0 + Math.floor(i / width)];
    const light = (passes * kChecks[(Math.floor(x / kCheckSide) + Math.floor(y / kCheckSide)) % 2]) / 2 ** exposure;
    for (let c = 3 * i; c < 3 * i + 3; c += 1) over[c] = halfBits(values[over[c]] + light);
  }
  return over.buffer;
}

/** Where a value lies between the ends of a range, from 0 to 1. */
const placed = (value, [least, most]) => (most > least ? Math.min(1, Math.max(0, (value - least) / (most - least))) : 0.5);

function measured(parts, colours, out, at) {
  if (colours) falseColour(parts[0], out, at);
  else for (let c = 0; c < 3; c += 1) out[at + c] = 255 * parts[c];
}

function coded(halves, channels, picked, code) {
  const out = new Uint8ClampedArray((4 * halves.length) / channels);
  const values = halfValues();
  for (let from = 0, at = 0; from < halves.length; from += channels, at += 4) {
    if (Number.isNaN(values[halves[from]])) {
      out.set(kNoSample, at);
    } else {
      out[at] = code[halves[from + picked[0]]];
      out[at + 1] = code[halves[from + picked[1]]];
      out[at + 2] = picked[2] < 0 ? 0 : code[halves[from + picked[2]]];
    }
    out[at + 3] = 255;
  }
  return out;
}

function each(halves, channels, put) {
  const out = new Uint8ClampedArray((4 * halves.length) / channels);
  const values = halfValues();
  let from = 0;
  const value = (c) => (c < 0 ? 0 : values[halves[from + c]]);
  for (let at = 0; from < halves.length; from += channels, at += 4) {
    if (Number.isNaN(value(0))) out.set(kNoSample, at);
    else put(value, out, at);
    out[at + 3] = 255;
  }
  return out;
}

const ramped = (halves, scale) => each(halves, 1, (v, out, at) => falseColour(onLogScale(v(0), ...scale), out, at));

/** A colour of an identifier's own: its bits, spread over hues. */
export function idColour(bits) {
  const hue = ((Math.imul(bits, 0x9e3779b1) >>> 8) / 2 ** 24) * 6;
  const channel = (offset) => 70 + 170 * Math.min(1, Math.max(0, Math.abs(((hue + offset) % 6) - 3) - 1));
  return [channel(0), channel(4), channel(2)];
}

function mattes(values, channels, picked) {
  const bits = new Uint32Array(values.buffer);
  const out = new Uint8ClampedArray((4 * values.length) / channels);
  const colours = new Map();
  for (let from = 0, at = 0; from < values.length; from += channels, at += 4) {
    for (let rank = 0; rank < channels; rank += 2) {
      const id = bits[from + rank];
      if (id === 0) continue;
      if (!colours.has(id)) colours.set(id, idColour(id));
      const part = values[from + rank + 1] * (picked.size === 0 || picked.has(id) ? 1 : kDimmed);
      const colour = colours.get(id);
      for (let c = 0; c < 3; c += 1) out[at + c] += part * colour[c];
    }
    out[at + 3] = 255;
  }
  return out;
}

/** Two pictures' blocks as one: how: "difference" (through the curve) or "relmse" (false colours). */
export function paintCompared(a, b, layer, look, how) {
  const [x, y] = [floatsOf(a, layer.format), floatsOf(b, layer.format)];
  const channels = layer.channels.length;
  const out = new Uint8ClampedArray((4 * x.length) / channels);
  const scale = 2 ** look.exposure;
  const code = codesOf(singly(look.curve), 0);
  for (let from = 0, at = 0; from < x.length; from += channels, at += 4) {
    out[at + 3] = 255;
    if (Number.isNaN(x[from]) || Number.isNaN(y[from])) {
      out.set(kNoSample, at);
    } else if (how === "relmse") {
      falseColour(onLogScale(relativeSquare(x, y, from, channels), ...kRelMseScale), out, at);
    } else {
      for (let c = 0; c < 3; c += 1) out[at + c] = code[halfBits(Math.abs(x[from + Math.min(c, channels - 1)] - y[from + Math.min(c, channels - 1)]) * scale)];
    }
  }
  return out;
}

/** (a - b)² / (b² + 0.01), the mean of the channels; b is the reference. */
export function relativeSquare(a, b, from, channels) {
  let sum = 0;
  for (let c = from; c < from + channels; c += 1) sum += (a[c] - b[c]) ** 2 / (b[c] * b[c] + kRelMseDenominator);
  return sum / channels;
}

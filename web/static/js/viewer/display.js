// How colours are shown: by curves of single channels, or by the coordinator's views of OpenColorIO, which come as
// tables (GET /api/v1/views/cube).
import { halfValues } from "./half.js";

const kPlain = "sRGB"; // the coordinator's name of the curve "srgb"
const kCurves = [["srgb", kPlain], ["linear", "Linear"]];

/** [name, label] of all curves and views. displays: the answer of GET /api/v1/views. */
export const curvesOf = (displays) => [...kCurves, ...displays.views.filter((name) => name !== kPlain).map((name) => [name, name])];

/** The curve or view that is shown. asked: that of the address; null: the coordinator's default. */
export function curveOf(asked, displays) {
  const name = asked ?? (displays.default === kPlain ? "srgb" : displays.default);
  return curvesOf(displays).some(([known]) => known === name) ? name : "srgb";
}

export const isView = (curve) => kCurves.every(([name]) => name !== curve);

const kSide = 65;
const kWhite = 255; // of the numbers that cubeFrom() gives

/** The table of a view as floats, from what the coordinator sends. */
export function cubeFrom(buffer) {
  const values = halfValues();
  return Float32Array.from(new Uint16Array(buffer), (bits) => kWhite * values[bits]);
}

let kept = { exposure: null, places: null };

/** Where the light of each half float lies along an axis of the table; NaN for NaN. */
function placesAt(exposure) {
  if (kept.exposure !== exposure) {
    const scale = 2 ** exposure;
    const place = (light) => Math.min(kSide - 1, (Math.log2(1 + 256 * Math.max(0, light)) * (kSide - 1)) / 16);
    kept = { exposure, places: Float32Array.from(halfValues(), (value) => place(value * scale)) };
  }
  return kept.places;
}

/** RGBA of half floats under a view, NaN as `empty`; picked: the channels that are red, green and blue, -1 for none. */
export function viewed(cube, halves, channels, picked, exposure, empty) {
  const places = placesAt(exposure);
  const out = new Uint8ClampedArray((4 * halves.length) / channels);
  const [red, green, blue] = picked;
  const [kGreen, kBlue] = [3 * kSide, 3 * kSide * kSide];
  for (let from = 0, at = 0; from < halves.length; from += channels, at += 4) {
    out[at + 3] = 255;
    const r = places[halves[from + red]];
    const g = places[halves[from + green]];
    const b = blue < 0 ? 0 : places[halves[from + blue]];
    if (r !== r || g !== g || b !== b) { // NaN
      out.set(empty, at);
      continue;
    }
    const i = Math.min(kSide - 2, r | 0);
    const j = Math.min(kSide - 2, g | 0);
    const k = Math.min(kSide - 2, b | 0);
    const x = r - i;
    const y = g - j;
    const z = b - k;
    // Of the six tetrahedra of a cell that which has the colour: from its dark to its bright corner along the axis of
    // the largest of x, y and z first, that of the least last.
    const dark = 3 * i + kGreen * j + kBlue * k;
    const bright = dark + 3 + kGreen + kBlue;
    const most = Math.max(x, y, z);
    const least = Math.min(x, y, z);
    const middle = x + y + z - most - least;
    const one = dark + (x === most ? 3 : y === most ? kGreen : kBlue);
    const two = bright - (z === least ? kBlue : y === least ? kGreen : 3);
    const [p, q, s] = [1 - most, most - middle, middle - least];
    out[at] = p * cube[dark] + q * cube[one] + s * cube[two] + least * cube[bright];
    out[at + 1] = p * cube[dark + 1] + q * cube[one + 1] + s * cube[two + 1] + least * cube[bright + 1];
    out[at + 2] = p * cube[dark + 2] + q * cube[one + 2] + s * cube[two + 2] + least * cube[bright + 2];
  }
  return out;
}

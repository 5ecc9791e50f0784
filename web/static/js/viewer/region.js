// Statistics of a region of one picture, or of two.
import { kRelMseDenominator } from "./paint.js";
import { blockSide, levelSize } from "./place.js";

const kMostSide = 256; // a region is read at a level at which it has at most this many pixels on a side

/** The finest level at which a region has at most kMostSide pixels on a side. */
export const regionLevel = ([x0, y0, x1, y1]) => Math.max(0, Math.ceil(Math.log2(Math.max(x1 - x0, y1 - y0) / kMostSide)));

/** Rectangles of a level, none larger than a block, that cover a region. */
export function pieces(size, [x0, y0, x1, y1], level) {
  const side = blockSide(level);
  const [width, height] = levelSize(size, level);
  const end = [Math.min(width, Math.ceil(x1 / 2 ** level)), Math.min(height, Math.ceil(y1 / 2 ** level))];
  const out = [];
  for (let y = Math.floor(y0 / 2 ** level); y < end[1]; y += side) for (let x = Math.floor(x0 / 2 ** level); x < end[0]; x += side) out.push([x, y, Math.min(x + side, end[0]), Math.min(y + side, end[1])]);
  return out;
}

/**
 * {level, mean, error, relmse}: the mean of each channel with the standard error of that mean, as far as pixels have
 * samples; relmse of `a` against `b`, or null. Above level 0 blocks of pixels stand for the pixels. colour, stderr: the
 * layers of `a`; `b` has the first, or "rgb".
 */
export async function regionFigures(a, b, region, [colour, stderr] = ["rgb", "stderr"]) {
  const level = regionLevel(region);
  const sums = { mean: [0, 0, 0], error: [0, 0, 0], relmse: 0, pixels: 0 };
  for (const rect of pieces(a.size, region, level)) {
    const [x, d, y] = await Promise.all([a.values(colour, level, rect), a.values(stderr, level, rect), b ? b.values(b.layer(colour).name, level, rect) : null]);
    for (let from = 0; from < x.length; from += 3) {
      if (Number.isNaN(x[from]) || (y && Number.isNaN(y[from]))) continue;
      sums.pixels += 1;
      for (let c = 0; c < 3; c += 1) {
        sums.mean[c] += x[from + c];
        sums.error[c] += d[from + c] ** 2;
        if (y) sums.relmse += (x[from + c] - y[from + c]) ** 2 / (y[from + c] ** 2 + kRelMseDenominator) / 3;
      }
    }
  }
  if (sums.pixels === 0) return null;
  return {
    level,
    mean: sums.mean.map((v) => v / sums.pixels),
    error: sums.error.map((v) => Math.sqrt(v) / sums.pixels),
    relmse: b ? sums.relmse / sums.pixels : null,
  };
}

// LDR-FLIP of two pictures as shown on a screen (Andersson et al. 2020, "FLIP: A Difference Evaluator for
// Alternating Images", equations (1) to (14)). The coordinator's implementation is
// core/image/reference/flip.cpp; tests compare both with values of the authors' program.

// For a monitor of 3,840 pixels and 0.7 m width, seen from 0.7 m
export const kPixelsPerDegree = 67.0206432765823;
const kToXyz = [[10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794], [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897], [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382]];
const kToRgb = [[3.241003275, -1.537398934, -0.498615861], [-0.969224334, 1.875930071, 0.041554224], [0.055639423, -0.204011202, 1.057148933]];
const kWhite = [0.950428545, 1, 1.088900371];
const [kQc, kPc, kPt, kQf] = [0.7, 0.4, 0.95, 0.5];
// Terms a sqrt(pi / b) exp(-pi² x² / b) of the contrast sensitivity of each channel, x in degrees.
const kSensitivity = [[[1, 0.0047]], [[1, 0.0053]], [[34.1, 0.04], [13.5, 0.025]]];
const kWidest = 0.04;
const kFeatureDegrees = 0.082;

const times = (m, a, b, c) => [0, 1, 2].map((i) => m[i][0] * a + m[i][1] * b + m[i][2] * c);
const shown = (v) => (v > 0 ? Math.min(v, 1) : 0);

function alongRows(plane, width, height, kernel) {
  const radius = kernel.length >> 1;
  const out = new Float32Array(plane.length);
  const padded = new Float32Array(width + 2 * radius);
  for (let y = 0; y < height; y += 1) {
    const row = plane.subarray(y * width, (y + 1) * width);
    padded.fill(row[0], 0, radius).set(row, radius);
    padded.fill(row[width - 1], radius + width);
    for (let x = 0; x < width; x += 1) {
      let sum = 0;
      for (let i = 0; i < kernel.length; i += 1) sum += kernel[i] * padded[x + i];
      out[y * width + x] = sum;
    }
  }
  return out;
}

function alongColumns(plane, width, height, kernel) {
  const radius = kernel.length >> 1;
  const out = new Float32Array(plane.length);
  for (let y = 0; y < height; y += 1) for (let i = 0; i < kernel.length; i += 1) {
    const from = Math.min(height - 1, Math.max(0, y + i - radius)) * width;
    const to = y * width;
    for (let x = 0; x < width; x += 1) out[to + x] += kernel[i] * plane[from + x];
  }
  return out;
}

function contrastFiltered(plane, width, height, terms, ppd) {
  const radius = Math.ceil(3 * Math.sqrt(kWidest / (2 * Math.PI ** 2)) * ppd);
  const parts = terms.map(([a, b]) => {
    const kernel = Float32Array.from({ length: 2 * radius + 1 }, (_, i) => Math.exp((-(Math.PI ** 2) * ((i - radius) / ppd) ** 2) / b));
    const line = kernel.reduce((sum, v) => sum + v, 0);
    const level = a * Math.sqrt(Math.PI / b);
    return { kernel, level, whole: level * line * line };
  });
  const whole = parts.reduce((sum, part) => sum + part.whole, 0);
  const out = new Float32Array(plane.length);
  for (const { kernel, level } of parts) {
    const part = alongColumns(alongRows(plane, width, height, kernel), width, height, kernel);
    for (let i = 0; i < out.length; i += 1) out[i] += (level / whole) * part[i];
  }
  return out;
}

function balanced(kernel) {
  const positive = kernel.reduce((sum, v) => sum + Math.max(0, v), 0);
  const negative = kernel.reduce((sum, v) => sum + Math.min(0, v), 0);
  return kernel.map((v) => (v > 0 ? v / positive : v / -negative));
}

function featureKernels(ppd) {
  const sigma = 0.5 * kFeatureDegrees * ppd;
  const radius = Math.ceil(3 * sigma);
  const xs = Array.from({ length: 2 * radius + 1 }, (_, i) => i - radius);
  const bell = xs.map((x) => Math.exp((-x * x) / (2 * sigma * sigma)));
  const sum = bell.reduce((all, v) => all + v, 0);
  return {
    across: Float32Array.from(bell, (v) => v / sum),
    along: [balanced(Float32Array.from(xs, (x, i) => -x * bell[i])), balanced(Float32Array.from(xs, (x, i) => ((x * x) / (sigma * sigma) - 1) * bell[i]))],
  };
}

function strength(grey, width, height, along, across) {
  const x = alongColumns(alongRows(grey, width, height, along), width, height, across);
  const y = alongColumns(alongRows(grey, width, height, across), width, height, along);
  return x.map((v, i) => Math.hypot(v, y[i]));
}

function labHunt(r, g, b) {
  const delta = 6 / 29;
  const [x, y, z] = times(kToXyz, r, g, b).map((v, i) => v / kWhite[i]).map((t) => (t > delta ** 3 ? Math.cbrt(t) : t / (3 * delta * delta) + 4 / 29));
  const light = 116 * y - 16;
  return [light, 0.01 * light * 500 * (x - y), 0.01 * light * 200 * (y - z)];
}

const hyab = (p, q) => Math.abs(p[0] - q[0]) + Math.hypot(p[1] - q[1], p[2] - q[2]);

/** Linear light of a picture as a canvas gives it, 8-bit sRGB with alpha. */
export function linearOf(rgba) {
  const linear = Float32Array.from({ length: 256 }, (_, i) => (i / 255 <= 0.04045 ? i / 255 / 12.92 : ((i / 255 + 0.055) / 1.055) ** 2.4));
  const rgb = new Float32Array((3 * rgba.length) / 4);
  for (let from = 0, at = 0; from < rgba.length; from += 4) for (let c = 0; c < 3; c += 1, at += 1) rgb[at] = linear[rgba[from + c]];
  return rgb;
}

function opponents(rgb) {
  const planes = [0, 1, 2].map(() => new Float32Array(rgb.length / 3));
  for (let i = 0, at = 0; at < rgb.length; i += 1, at += 3) {
    const [x, y, z] = times(kToXyz, shown(rgb[at]), shown(rgb[at + 1]), shown(rgb[at + 2])).map((v, c) => v / kWhite[c]);
    planes[0][i] = 116 * y - 16;
    planes[1][i] = 500 * (x - y);
    planes[2][i] = 200 * (y - z);
  }
  return planes;
}

function seen(planes, i) {
  const y = (planes[0][i] + 16) / 116;
  const [r, g, b] = times(kToRgb, (planes[1][i] / 500 + y) * kWhite[0], y * kWhite[1], (y - planes[2][i] / 200) * kWhite[2]);
  return labHunt(shown(r), shown(g), shown(b));
}

/** The error of each pixel, 0 (invisible) to 1, of linear R, G, B row by row. */
export function flip(reference, image, width, height, ppd = kPixelsPerDegree) {
  const [r, t] = [opponents(reference), opponents(image)];
  const [rf, tf] = [r, t].map((planes) => planes.map((plane, c) => contrastFiltered(plane, width, height, kSensitivity[c], ppd)));
  const { across, along } = featureKernels(ppd);
  const [rg, tg] = [r, t].map((planes) => planes[0].map((v) => (v + 16) / 116));
  const features = new Float32Array(width * height);
  for (const kernel of along) {
    const [a, b] = [strength(rg, width, height, kernel, across), strength(tg, width, height, kernel, across)];
    for (let i = 0; i < features.length; i += 1) features[i] = Math.max(features[i], Math.abs(a[i] - b[i]));
  }
  const largest = hyab(labHunt(0, 1, 0), labHunt(0, 0, 1)) ** kQc;
  const bend = kPc * largest;
  return features.map((feature, i) => {
    const e = hyab(seen(rf, i), seen(tf, i)) ** kQc;
    const colour = e < bend ? (kPt / bend) * e : kPt + ((e - bend) / (largest - bend)) * (1 - kPt);
    return colour ** (1 - (feature / Math.SQRT2) ** kQf);
  });
}

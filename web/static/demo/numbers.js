// The storybook's render as numbers: the layers of a viewer's source, computed from formulas. Deterministic.
import { halfBits } from "../js/viewer/half.js";
import { blockRect } from "../js/viewer/place.js";
import { hash, radiance } from "./picture.js";

const kSize = [640, 360];
const kIds = { floor: 0x3e9a1b20, wall: 0x3f123456, lamp: 0x40789abc };

const objectAt = (u, v) => (Math.hypot(u - 0.78, 1.2 * (v - 0.55)) < 0.08 ? "lamp" : v > 0.79 ? "floor" : "wall");

function layers(noise) {
  const noisy = (x, y) => radiance(x / kSize[0], y / kSize[1]).map((v, c) => v * (1 + noise * (2 * hash(x, y, c) - 1)));
  const errors = (x, y) => radiance(x / kSize[0], y / kSize[1]).map((v) => v * noise * 0.5);
  return {
    rgb: { channels: ["R", "G", "B"], value: noisy },
    stderr: { channels: ["R", "G", "B"], value: errors },
    error: { channels: ["Y"], value: (x, y) => [0.03 + 0.5 * noise * hash(x >> 5, y >> 5, 7)] },
    spp: { channels: ["Y"], value: (x, y) => [hash(x >> 5, y >> 5, 3) > 0.4 ? 512 : 64] },
    depth: { channels: ["Z"], value: (x, y) => [y > 284 ? 2 : 6] },
    normal: { channels: ["X", "Y", "Z"], value: (x, y) => (y > 284 ? [0, 1, 0] : [0, 0, 1]) },
    crypto_object: {
      channels: ["id0", "coverage0"], format: "float", blocks: "first", names: Object.fromEntries(Object.entries(kIds).map(([name, id]) => [name, id.toString(16).padStart(8, "0")])),
      value: (x, y) => [kIds[objectAt(x / kSize[0], y / kSize[1])], 1],
    },
  };
}

/** Two thirds of the light are of the lamp, half of them scattered in fog; the rest is of the sky. */
function groupLayers(noise) {
  const part = (share) => ({ channels: ["R", "G", "B"], value: (x, y) => radiance(x / kSize[0], y / kSize[1]).map((v, c) => share * v * (1 + noise * (2 * hash(x, y, c) - 1))) });
  const shares = { RGB_lamp: 2 / 3, "RGB_lamp.volume": 1 / 3, RGB_sky: 1 / 3, "RGB_sky.volume": 0 };
  return Object.fromEntries(Object.entries(shares).flatMap(([name, share]) => [[name, part(share)], [`${name}.delta`, part(0.5 * noise * share)]]));
}

/** noise: of each pixel, relative to it. grouped: with light groups. */
export function numbers(noise, grouped = false) {
  const made = { ...layers(noise), ...(grouped ? groupLayers(noise) : {}) };
  const blocks = new Map();
  const rows = Object.entries(made).map(([name, { value, ...row }]) => ({ name, format: "half", blocks: "mean", ...row }));
  const layer = (name) => rows.find((row) => row.name === name) ?? rows[0];
  function block(name, level, bx, by) {
    const key = `${name} ${level} ${bx} ${by}`;
    if (!blocks.has(key)) blocks.set(key, filled(made[name].value, layer(name), level, blockRect(kSize, level, bx, by)));
    return blocks.get(key);
  }
  return {
    size: kSize, maxLevel: 10, layers: rows, layer, block, want() {}, touch() {}, close() {},
    pixel: async (of, x, y) => made[of.name].value(x, y),
    values: async () => new Float32Array(0),
  };
}

function filled(value, layer, level, rect) {
  const [x0, y0, x1, y1] = rect;
  const ids = layer.blocks === "first";
  const out = new (ids ? Float32Array : Uint16Array)((x1 - x0) * (y1 - y0) * layer.channels.length);
  const bits = new Uint32Array(ids ? out.buffer : 0);
  let at = 0;
  for (let y = y0; y < y1; y += 1) for (let x = x0; x < x1; x += 1) value(x << level, y << level).forEach((v, c) => {
    if (!ids) out[at] = halfBits(v);
    else if (c % 2 === 0) bits[at] = v;
    else out[at] = v;
    at += 1;
  });
  return { buffer: out.buffer, rect, level, version: 1 };
}

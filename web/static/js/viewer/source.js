// Fetches blocks of a picture's layers when they are needed, and keeps them while there is room. All views of
// a picture share one source. If the job still renders, the source is told which areas have changed, and
// fetches these again.
import { blockRect } from "./place.js";
import { pieces } from "./region.js";
import { floatsOf } from "./half.js";

const kAtOnce = 4; // most requests in progress
const kMostBytes = 192 * 2 ** 20;
const kFreshPauseMs = 800; // a changing block is not requested more often
const kFirstRetryMs = 500;
const kLongestRetryMs = 15_000;
const kSurveySide = 256;
const kProbeSide = 16;
const kMostProbes = 2048;

export class PixelSource {
  #fetch;
  #blocks = new Map(); // key -> block; the least recently used first
  #bytes = 0;
  #wanted = [];
  #running = 0;
  #failures = 0;
  #retryAt = 0;
  #timer = 0;
  #probes = new Map();

  /** fetch(layer, level, rect) -> ArrayBuffer. meta: as `layers` says. onChange(problem): something came, or why nothing does. */
  constructor(meta, fetch, onChange) {
    this.size = meta.size;
    this.maxLevel = meta.max_level;
    this.layers = meta.layers;
    this.onChange = onChange;
    this.#fetch = fetch;
  }

  layer(name) {
    return this.layers.find((layer) => layer.name === name) ?? this.layers[0];
  }

  /** {buffer, rect, level, version}, or undefined if it has not come yet. */
  block(layer, level, bx, by) {
    const key = `${layer} ${level} ${bx} ${by}`;
    const block = this.#blocks.get(key);
    if (!block?.buffer) return undefined;
    this.#blocks.delete(key); // inserted again at the end: used most recently
    this.#blocks.set(key, block);
    return block;
  }

  /** What is needed now, the most urgent first: [[layer, level, bx, by], ...]. What was wanted before is not fetched any more. */
  want(list) {
    this.#wanted = list;
    this.#pump();
  }

  /** The image has changed within a rectangle of it; null: anywhere. */
  touch(rect) {
    for (const block of this.#blocks.values()) {
      const side = 2 ** block.level;
      const [x0, y0, x1, y1] = block.rect;
      if (!rect || (rect[0] < x1 * side && rect[2] > x0 * side && rect[1] < y1 * side && rect[3] > y0 * side)) block.stale = true;
    }
    this.#probes.clear();
    this.#pump();
  }

  #pump() {
    clearTimeout(this.#timer);
    const now = performance.now();
    let later = Infinity;
    for (const [layer, level, bx, by] of this.#wanted) {
      if (this.#running >= kAtOnce) return;
      const key = `${layer} ${level} ${bx} ${by}`;
      const block = this.#blocks.get(key) ?? { buffer: null, rect: blockRect(this.size, level, bx, by), level, version: 0, stale: true, running: false, notBefore: 0 };
      if (!block.stale || block.running) continue;
      const when = Math.max(block.notBefore, this.#retryAt);
      if (when > now) later = Math.min(later, when);
      else this.#load(key, layer, block);
    }
    if (later < Infinity) this.#timer = setTimeout(() => this.#pump(), later - now);
  }

  async #load(key, layer, block) {
    this.#running += 1;
    this.#blocks.set(key, block);
    block.running = true;
    block.stale = false;
    let problem = null;
    try {
      const buffer = await this.#fetch(layer, block.level, block.rect);
      this.#bytes += buffer.byteLength - (block.buffer?.byteLength ?? 0);
      block.buffer = buffer;
      block.version += 1;
      block.notBefore = performance.now() + kFreshPauseMs;
      this.#failures = 0;
      this.#forget();
    } catch (error) {
      block.stale = true;
      this.#retryAt = performance.now() + Math.min(kFirstRetryMs * 2 ** this.#failures, kLongestRetryMs);
      this.#failures += 1;
      problem = error;
    }
    block.running = false;
    this.#running -= 1;
    this.onChange(problem);
    this.#pump();
  }

  /** What is wanted now stays, however much it is: a mix of many light groups needs all of them at once. */
  #forget() {
    if (this.#bytes <= kMostBytes) return;
    const wanted = new Set(this.#wanted.map((parts) => parts.join(" ")));
    for (const [key, block] of this.#blocks) {
      if (this.#bytes <= kMostBytes) return;
      if (block.running || wanted.has(key)) continue;
      this.#bytes -= block.buffer?.byteLength ?? 0;
      this.#blocks.delete(key);
    }
  }

  /** The values of one pixel of the image, one for each channel; identifiers as their bits. */
  async pixel(layer, x, y) {
    const [bx, by] = [Math.floor(x / kProbeSide), Math.floor(y / kProbeSide)];
    const key = `${layer.name} ${bx} ${by}`;
    const rect = [bx * kProbeSide, by * kProbeSide, Math.min((bx + 1) * kProbeSide, this.size[0]), Math.min((by + 1) * kProbeSide, this.size[1])];
    if (!this.#probes.has(key)) {
      if (this.#probes.size >= kMostProbes) this.#probes.clear();
      const asked = this.#fetch(layer.name, 0, rect);
      asked.catch(() => this.#probes.delete(key));
      this.#probes.set(key, asked);
    }
    const buffer = await this.#probes.get(key);
    const from = ((y - rect[1]) * (rect[2] - rect[0]) + x - rect[0]) * layer.channels.length;
    const values = layer.blocks === "first" ? alternating(buffer) : floatsOf(buffer, layer.format);
    return [...values.slice(from, from + layer.channels.length)];
  }

  /** All values of a rectangle of a level. */
  async values(name, level, rect) {
    return floatsOf(await this.#fetch(name, level, rect), this.layer(name).format);
  }

  /** {least, most, counts}: the ends of all finite values of a layer, and how many lie in each of `bins` equal parts between them (of positive values by their logarithms). Of a picture reduced to kSurveySide pixels. of: the source that has the layer. */
  async survey(name, bins, of = this) {
    const layer = of.layer(name);
    const level = Math.min(this.maxLevel, Math.max(0, Math.ceil(Math.log2(Math.max(...this.size) / kSurveySide))));
    const parts = await Promise.all(pieces(this.size, [0, 0, ...this.size], level).map((rect) => of.values(layer.name, level, rect)));
    return surveyed(parts.flatMap((part) => [...part]), layer.channels.length, bins);
  }

  close() {
    clearTimeout(this.#timer);
    this.#wanted = [];
    this.onChange = () => {};
  }
}

export function surveyed(values, channels, bins) {
  let [least, most, positive] = [Infinity, -Infinity, Infinity];
  for (const value of values) {
    if (!Number.isFinite(value)) continue;
    least = Math.min(least, value);
    most = Math.max(most, value);
    if (value > 0) positive = Math.min(positive, value);
  }
  if (least > most) return null;
  const logarithmic = least >= 0 && most > positive;
  const [from, to] = logarithmic ? [Math.log(positive), Math.log(most)] : [least, most];
  const counts = Array.from({ length: channels }, () => new Array(bins).fill(0));
  values.forEach((value, i) => {
    if (!Number.isFinite(value) || (logarithmic && value <= 0)) return;
    const at = to > from ? ((logarithmic ? Math.log(value) : value) - from) / (to - from) : 0;
    counts[i % channels][Math.min(bins - 1, Math.floor(at * bins))] += 1;
  });
  return { least, most, from: logarithmic ? positive : least, logarithmic, counts };
}

/** Identifiers as whole numbers, coverages as they are. */
function alternating(buffer) {
  const bits = new Uint32Array(buffer);
  return Array.from(new Float32Array(buffer), (value, i) => (i % 2 === 0 ? bits[i] : value));
}

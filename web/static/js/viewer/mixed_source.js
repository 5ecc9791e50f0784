// A picture with two layers more, which are mixed here of the layers of its light groups: the mix, and its standard
// error. Has the interface of PixelSource. Blocks of the groups are fetched once; a mix of other factors is a sum of
// what is there.
import { halfBits, halfValues } from "./half.js";
import { factorsOf, groupsOf, kMix, kMixError, rowsOf } from "./mix.js";

const kMostMixed = 512; // blocks that are kept
const kMixedLayers = [kMix, kMixError].map((name) => ({ name, channels: ["R", "G", "B"], format: "half", blocks: "mean" }));
const kDelta = ".delta"; // kHalfDifference in final_image.h

export class MixedSource {
  #source;
  #terms = []; // {layer, factors}: the mix is the sum of factors times layers
  #revision = 0; // of the terms
  #version = 0; // of the latest block
  #mixed = new Map(); // key -> {block, made of}; the least recently used first

  constructor(source) {
    this.#source = source;
    this.groups = groupsOf(source.layers);
    this.layers = [source.layers[0], ...kMixedLayers, ...source.layers.slice(1)];
    this.texts = null;
    this.mix([]);
  }

  get size() { return this.#source.size; }
  get maxLevel() { return this.#source.maxLevel; }

  /** Mixes by these texts of an address from now on (mix.js). */
  mix(texts) {
    if (String(texts) === this.texts) return;
    this.texts = String(texts);
    const rows = rowsOf(texts, this.groups);
    const terms = this.groups.flatMap(({ name }) => {
      const { surface, volume } = factorsOf(rows, name);
      // The layer of the group has the light of media in it
      return [{ layer: `RGB_${name}`, factors: surface }, { layer: `RGB_${name}.volume`, factors: volume.map((v, c) => v - surface[c]) }];
    });
    const seen = terms.filter(({ factors }) => factors.some((v) => v !== 0));
    this.#terms = seen.length > 0 ? seen : terms.slice(0, 1); // black, but where there are samples
    this.#revision += 1;
  }

  layer(name) {
    return this.layers.find((layer) => layer.name === name) ?? this.layers[0];
  }

  /** As that of PixelSource. `late`: of an earlier mix, because a part of this one has not come yet. */
  block(layer, level, bx, by) {
    const names = this.#parts(layer);
    if (!names) return this.#source.block(layer, level, bx, by);
    const blocks = names.map((name) => this.#source.block(name, level, bx, by));
    const key = `${layer} ${level} ${bx} ${by}`;
    const kept = this.#mixed.get(key);
    if (!blocks.every(Boolean)) return kept && { ...kept.block, late: true };
    const madeOf = `${this.#revision} ${blocks.map(({ version }) => version)}`;
    this.#mixed.delete(key);
    const mixed = kept?.madeOf === madeOf ? kept : { madeOf, block: this.#made(layer, blocks) };
    this.#mixed.set(key, mixed); // at the end: used most recently
    if (this.#mixed.size > kMostMixed) this.#mixed.delete(this.#mixed.keys().next().value);
    return mixed.block;
  }

  /** The layers that a layer is mixed of, in the order of the terms; null: it is none of the mixed ones. */
  #parts(layer) {
    return layer === kMix || layer === kMixError ? this.#terms.map((term) => term.layer + (layer === kMix ? "" : kDelta)) : null;
  }

  #made(layer, blocks) {
    const sums = summed(layer, this.#terms, blocks.map(({ buffer }) => new Uint16Array(buffer)), halfValues());
    const halves = new Uint16Array(sums.length);
    for (let i = 0; i < sums.length; i += 1) halves[i] = halfBits(sums[i]);
    this.#version += 1;
    return { buffer: halves.buffer, rect: blocks[0].rect, level: blocks[0].level, version: this.#version };
  }

  want(list) {
    this.#source.want(list.flatMap(([layer, ...place]) => (this.#parts(layer) ?? [layer]).map((name) => [name, ...place])));
  }

  touch(rect) { this.#source.touch(rect); }

  close() { this.#source.close(); }

  async pixel(layer, x, y) {
    const of = (name) => this.#source.pixel(this.#source.layer(name), x, y);
    return this.#parts(layer.name) ? [...(await this.#whole(layer.name, of))] : of(layer.name);
  }

  async values(name, level, rect) {
    const of = (part) => this.#source.values(part, level, rect);
    return this.#parts(name) ? this.#whole(name, of) : of(name);
  }

  /** of: the values of a layer. */
  async #whole(layer, of) {
    const terms = this.#terms; // others may come on the way
    return summed(layer, terms, await Promise.all(this.#parts(layer).map(of)));
  }

  survey(name, bins) { return this.#source.survey(name, bins, this); }
}

/** parts: of each term three numbers for each pixel: values, or indices of values. */
function summed(layer, terms, parts, values = null) {
  const sums = new Float32Array(parts[0].length);
  parts.forEach((part, term) => {
    const [r, g, b] = terms[term].factors;
    for (let i = 0; i < part.length; i += 3) {
      sums[i] += r * (values ? values[part[i]] : part[i]);
      sums[i + 1] += g * (values ? values[part[i + 1]] : part[i + 1]);
      sums[i + 2] += b * (values ? values[part[i + 2]] : part[i + 2]);
    }
  });
  // The difference of the halves of a mix is the mix of the differences, and its size the standard error
  return layer === kMix ? sums : sums.map(Math.abs);
}

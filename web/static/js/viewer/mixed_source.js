// A picture with two layers more, which are mixed here of the layers of its light groups: the mix, and its standard
// error. Has the interface of PixelSource. Blocks of the groups are fetched once; a mix of other factors is a sum of
// what is there.
import { halfValues, halvesOf } from "./half.js";
import { factorsOf, groupsOf, kMix, kMixError, rowsOf } from "./mix.js";

const kMostMixed = 512; // blocks that are kept
const kMostRests = 96; // 75 MB
const kMixedLayers = [kMix, kMixError].map((name) => ({ name, channels: ["R", "G", "B"], format: "half", blocks: "mean" }));
const kDelta = ".delta"; // kHalfDifference in final_image.h

let scratch = new Float32Array(0); // sums of the block that is being mixed

export class MixedSource {
  #source;
  #terms = []; // {layer, factors}: the mix is the sum of factors times layers
  #revision = 0; // of the terms
  #version = 0; // of the latest block
  #moving = new Set(); // layers whose factors the last change has changed
  #rests = new Map(); // key -> {sums, madeOf}: of the terms that do not move
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
    const before = new Map(this.#terms.map((term) => [term.layer, String(term.factors)]));
    this.#moving = new Set(terms.filter(({ layer, factors }) => before.get(layer) !== String(factors)).map(({ layer }) => layer));
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
    const mixed = kept?.madeOf === madeOf ? kept : { madeOf, block: this.#made(layer, key, blocks, kept?.block.buffer) };
    this.#mixed.set(key, mixed); // at the end: used most recently
    if (this.#mixed.size > kMostMixed) this.#mixed.delete(this.#mixed.keys().next().value);
    return mixed.block;
  }

  /** The layers that a layer is mixed of, in the order of the terms; null: it is none of the mixed ones. */
  #parts(layer) {
    return layer === kMix || layer === kMixError ? this.#terms.map((term) => term.layer + (layer === kMix ? "" : kDelta)) : null;
  }

  /** buffer: of the mix that this one replaces, or undefined. */
  #made(layer, key, blocks, buffer = undefined) {
    const parts = this.#terms.map((term, i) => ({ ...term, block: blocks[i], halves: new Uint16Array(blocks[i].buffer) }));
    const moves = ({ layer: name }) => this.#moving.has(name);
    const { length } = parts[0].halves;
    if (scratch.length < length) scratch = new Float32Array(length);
    const sums = scratch.subarray(0, length);
    sums.set(this.#rest(key, parts.filter((part) => !moves(part)), length));
    for (const part of parts.filter(moves)) addHalves(sums, part.halves, part.factors);
    this.#version += 1;
    const halves = new Uint16Array(buffer?.byteLength === 2 * length ? buffer : length);
    return { buffer: halvesOf(finished(layer, sums), halves).buffer, rect: blocks[0].rect, level: blocks[0].level, version: this.#version };
  }

  /** The sum of the terms that stay as they are while a slider moves, so that each frame adds one term, not all. */
  #rest(key, parts, length) {
    const madeOf = parts.map(({ layer, factors, block }) => `${layer} ${factors} ${block.version}`).join();
    let rest = this.#rests.get(key);
    if (rest?.madeOf !== madeOf) {
      rest = { sums: new Float32Array(length), madeOf };
      for (const { halves, factors } of parts) addHalves(rest.sums, halves, factors);
    }
    this.#rests.delete(key);
    this.#rests.set(key, rest);
    if (this.#rests.size > kMostRests) this.#rests.delete(this.#rests.keys().next().value);
    return rest.sums;
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
    const parts = await Promise.all(this.#parts(layer).map(of));
    return finished(layer, Float32Array.from(parts[0], (_, i) => parts.reduce((sum, part, term) => sum + terms[term].factors[i % 3] * part[i], 0)));
  }

  survey(name, bins) { return this.#source.survey(name, bins, this); }
}

function addHalves(sums, halves, [r, g, b]) {
  const values = halfValues();
  for (let i = 0; i < halves.length; i += 3) {
    sums[i] += r * values[halves[i]];
    sums[i + 1] += g * values[halves[i + 1]];
    sums[i + 2] += b * values[halves[i + 2]];
  }
}

/** The difference of the halves of a mix is the mix of the differences; its size is the standard error. */
const finished = (layer, sums) => (layer === kMix ? sums : sums.map(Math.abs));

// A picture from a local file, with the interface of PixelSource. The file is never sent anywhere.
import { blockRect } from "./place.js";
import { floatsOf, halfBits } from "./half.js";
import { readExr } from "./exr.js";

export class FileSource {
  #rgb;
  #blocks = new Map();

  constructor(picture) {
    this.size = picture.size;
    this.maxLevel = 10;
    this.layers = [{ name: "rgb", channels: ["R", "G", "B"], format: "half", blocks: "mean" }];
    this.#rgb = picture.rgb;
  }

  layer() {
    return this.layers[0];
  }

  block(layer, level, bx, by) {
    if (layer !== "rgb") return undefined;
    const key = `${level} ${bx} ${by}`;
    if (!this.#blocks.has(key)) this.#blocks.set(key, this.#made(level, blockRect(this.size, level, bx, by)));
    return this.#blocks.get(key);
  }

  #made(level, rect) {
    const [x0, y0, x1, y1] = rect;
    const halves = new Uint16Array(3 * (x1 - x0) * (y1 - y0));
    const side = 2 ** level;
    let at = 0;
    for (let y = y0; y < y1; y += 1) for (let x = x0; x < x1; x += 1) for (let c = 0; c < 3; c += 1, at += 1) halves[at] = halfBits(this.#mean(x * side, y * side, side, c));
    return { buffer: halves.buffer, rect, level, version: 1 };
  }

  #mean(x0, y0, side, c) {
    const [x1, y1] = [Math.min(x0 + side, this.size[0]), Math.min(y0 + side, this.size[1])];
    let sum = 0;
    for (let y = y0; y < y1; y += 1) for (let x = x0; x < x1; x += 1) sum += this.#rgb[3 * (y * this.size[0] + x) + c];
    return sum / ((x1 - x0) * (y1 - y0));
  }

  async pixel(layer, x, y) {
    return [...this.#rgb.slice(3 * (y * this.size[0] + x), 3 * (y * this.size[0] + x) + 3)];
  }

  async values(name, level, rect) {
    return floatsOf(this.#made(level, rect).buffer, "half");
  }

  want() {}
  touch() {}
  close() {}
}

export const openFile = async (file) => new FileSource(await readExr(await file.arrayBuffer()));

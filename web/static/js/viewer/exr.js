// Reads the colour of an OpenEXR file in the browser: scanlines of half floats or floats, without compression
// or with ZIP, as this farm and most renderers write them. The file is untrusted: every length is checked
// before it is used.
import { halfValues } from "./half.js";

const kMagic = 20000630;
const kLines = { 0: 1, 2: 1, 3: 16 }; // rows per chunk for each compression: none, ZIPS, ZIP
const kBytes = { 0: 4, 1: 2, 2: 4 }; // bytes per value: UINT, HALF, FLOAT
const kMostPixels = 2 ** 27;
const kRec709 = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329]; // x, y of red, green, blue and white

class Reader {
  constructor(buffer) {
    this.view = new DataView(buffer);
    this.at = 0;
  }
  int() {
    this.at += 4;
    return this.view.getInt32(this.at - 4, true);
  }
  text() {
    let text = "";
    for (let code; (code = this.view.getUint8(this.at++)) !== 0;) text += String.fromCharCode(code);
    return text;
  }
}

/** {size, rgb: Float32Array}; an Error says what is wrong with the file. */
export async function readExr(buffer) {
  try {
    return await read(buffer);
  } catch (cause) {
    if (cause instanceof RangeError) throw new Error("The file ends too early: it is damaged.");
    throw cause;
  }
}

async function read(buffer) {
  const reader = new Reader(buffer);
  if (reader.int() !== kMagic) throw new Error("This is no OpenEXR file.");
  if (reader.int() & 0x1a00) throw new Error("Tiled, deep and multi-part OpenEXR files can't be read here.");
  const header = headerOf(reader);
  const { channels, compression, window: [x0, y0, x1, y1] } = header;
  const [width, height] = [x1 - x0 + 1, y1 - y0 + 1];
  if (!(width > 0 && height > 0 && width * height <= kMostPixels)) throw new Error("The picture has no size that can be shown.");
  if (!(compression in kLines)) throw new Error("Only OpenEXR files with ZIP compression or none can be read here.");
  const rgb = new Float32Array(3 * width * height);
  const places = placesOf(channels);
  const rowBytes = channels.reduce((sum, channel) => sum + kBytes[channel.type] * width, 0);
  const chunks = Math.ceil(height / kLines[compression]);
  const table = Array.from({ length: chunks }, (_, i) => Number(reader.view.getBigUint64(reader.at + 8 * i, true)));
  for (const at of table) {
    const row = reader.view.getInt32(at, true) - y0;
    const length = reader.view.getInt32(at + 4, true);
    const rows = Math.min(kLines[compression], height - row);
    if (!(row >= 0 && row < height && length >= 0)) throw new Error("A part of the file lies outside of the picture.");
    const packed = new Uint8Array(buffer, at + 8, length);
    const bytes = length < rows * rowBytes ? await unzipped(packed, rows * rowBytes) : packed;
    if (bytes.length !== rows * rowBytes) throw new RangeError();
    for (let y = 0; y < rows; y += 1) takeRow(bytes, y * rowBytes, width, places, rgb, 3 * (row + y) * width);
  }
  return { size: [width, height], rgb };
}

function headerOf(reader) {
  const header = { channels: null, compression: null, window: null };
  for (let name; (name = reader.text()) !== "";) {
    reader.text(); // skips the attribute's type
    const length = reader.int();
    const end = reader.at + length;
    if (length < 0) throw new RangeError();
    if (name === "compression") header.compression = reader.view.getUint8(reader.at);
    if (name === "dataWindow") header.window = [reader.int(), reader.int(), reader.int(), reader.int()];
    if (name === "channels") header.channels = channelsOf(reader);
    if (name === "chromaticities" && !isRec709(reader.view, reader.at)) throw new Error("The colours are not those of Rec. 709, by the file's chromaticities: write it with the color_space rec709.");
    reader.at = end;
  }
  if (!header.channels || header.compression === null || !header.window) throw new Error("The header lacks channels, compression or size.");
  return header;
}

// Primaries that differ by less than this are the same, written with fewer digits (core/image/exr/read.cpp).
const isRec709 = (view, at) => kRec709.reduce((sum, value, i) => sum + (view.getFloat32(at + 4 * i, true) - value) ** 2, 0) < 1e-6;

function channelsOf(reader) {
  const channels = [];
  for (let name; (name = reader.text()) !== "";) {
    const type = reader.int();
    reader.int(); // skips pLinear
    if (!(type in kBytes) || reader.int() !== 1 || reader.int() !== 1) throw new Error(`The channel ${name} has an unknown type or is subsampled.`);
    channels.push({ name, type });
  }
  return channels;
}

/** For each channel, in the order of the file: its type, and where it goes: 0, 1, 2, or null. Y alone goes to all three. */
function placesOf(channels) {
  const grey = !channels.some(({ name }) => name === "R");
  if (!["R", "G", "B"].every((name) => channels.some((channel) => channel.name === name)) && !(grey && channels.some(({ name }) => name === "Y"))) throw new Error("The file has neither the channels R, G and B nor Y.");
  return channels.map(({ name, type }) => ({ type, to: grey ? (name === "Y" ? [0, 1, 2] : []) : [["R", "G", "B"].indexOf(name)].filter((c) => c >= 0) }));
}

function takeRow(bytes, from, width, places, rgb, at) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const halves = halfValues();
  for (const { type, to } of places) {
    for (let x = 0; to.length > 0 && x < width; x += 1) {
      const place = from + x * kBytes[type];
      const value = type === 1 ? halves[view.getUint16(place, true)] : type === 2 ? view.getFloat32(place, true) : view.getUint32(place, true);
      for (const c of to) rgb[at + 3 * x + c] = value;
    }
    from += width * kBytes[type];
  }
}

/** ZIP of OpenEXR: deflated differences of bytes, of which first all even ones are stored, then all odd ones. */
async function unzipped(packed, length) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const coded = new Uint8Array(length);
  let got = 0;
  const reader = stream.getReader();
  for (let part; !(part = await reader.read().catch(() => { throw new Error("The file is damaged: a part can't be unpacked."); })).done;) {
    if (got + part.value.length > length) throw new Error("The file is damaged: a part is too long.");
    coded.set(part.value, got);
    got += part.value.length;
  }
  if (got !== length) throw new RangeError();
  for (let i = 1; i < length; i += 1) coded[i] = coded[i - 1] + coded[i] - 128;
  const out = new Uint8Array(length);
  const half = (length + 1) >> 1;
  for (let i = 0; i < length; i += 1) out[i] = coded[i % 2 === 0 ? i >> 1 : half + (i >> 1)];
  return out;
}

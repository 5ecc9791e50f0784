// Half floats in the coordinator's format: 1 bit sign, 5 bits exponent, 10 bits fraction.

let table = null;

/** The value of each of the 65,536 bit patterns. */
export function halfValues() {
  if (table) return table;
  table = new Float32Array(65536);
  for (let bits = 0; bits < 65536; bits += 1) {
    const exponent = (bits >> 10) & 31;
    const fraction = bits & 1023;
    const size = exponent === 31 ? (fraction ? NaN : Infinity) : exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15);
    table[bits] = bits & 0x8000 ? -size : size;
  }
  return table;
}

/** Floats of what came: format "half" or "float". */
export function floatsOf(buffer, format) {
  if (format === "float") return new Float32Array(buffer);
  const values = halfValues();
  return Float32Array.from(new Uint16Array(buffer), (bits) => values[bits]);
}

const scratch = new Float32Array(1);
const scratchBits = new Uint32Array(scratch.buffer);

/** The half floats nearest to values, as halfBits() gives them, but sooner; into `halves`. */
export function halvesOf(floats, halves = new Uint16Array(floats.length)) {
  const bits = new Uint32Array(floats.buffer, floats.byteOffset, floats.length);
  for (let i = 0; i < halves.length; i += 1) {
    const size = bits[i] & 0x7fffffff;
    const usual = size >= 0x38800000 && size < 0x477ff000; // 2^-14 to where halves end
    halves[i] = usual ? ((bits[i] >>> 16) & 0x8000) | ((size - 0x38000000 + 0xfff + ((size >> 13) & 1)) >> 13) : halfBits(floats[i]);
  }
  return halves;
}

/** The half float nearest to a value; beyond 65504 that. */
export function halfBits(value) {
  if (Number.isNaN(value)) return 0x7e00;
  const sign = value < 0 ? 0x8000 : 0;
  const size = Math.min(Math.abs(value), 65504);
  if (size < 2 ** -14) return sign | Math.round(size * 2 ** 24);
  scratch[0] = size;
  const bits = scratchBits[0] - 0x38000000;
  return sign | ((bits + 0xfff + ((bits >> 13) & 1)) >> 13);
}

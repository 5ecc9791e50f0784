// SHA-256 of a file, as lower-case hexadecimal digits. The browser's own implementation is used where it is
// available (in a secure context: https or localhost) and the file fits into memory. Otherwise, for example
// on a plain http address, the implementation below reads the file piece by piece.

const kInMemoryBytes = 256 * 2 ** 20;
const kPieceBytes = 4 * 2 ** 20; // a multiple of the 64-byte block

export async function sha256(file, onProgress = () => {}) {
  if (globalThis.crypto?.subtle && file.size <= kInMemoryBytes) {
    const digest = await crypto.subtle.digest("SHA-256", await file.arrayBuffer());
    onProgress(file.size);
    return hex(new Uint8Array(digest));
  }
  return sha256Streaming(file, onProgress);
}

export async function sha256Streaming(file, onProgress = () => {}) {
  const hash = Uint32Array.from(kInitial);
  let at = 0;
  for (; at + kPieceBytes <= file.size; at += kPieceBytes) {
    compress(hash, new Uint8Array(await file.slice(at, at + kPieceBytes).arrayBuffer()));
    onProgress(at + kPieceBytes);
  }
  const rest = new Uint8Array(await file.slice(at).arrayBuffer());
  compress(hash, padded(rest, file.size));
  onProgress(file.size);
  const bytes = new DataView(new ArrayBuffer(32));
  hash.forEach((word, i) => bytes.setUint32(4 * i, word));
  return hex(new Uint8Array(bytes.buffer));
}

const hex = (bytes) => Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");

// FIPS 180-4: the constants are the first 32 bits of the fractional parts of the square roots (initial state) and cube
// roots (rounds) of the first primes, so they are computed rather than listed: exactly, in integers.
function integerRoot(n, degree) {
  let root = BigInt(Math.floor(Number(n) ** (1 / degree)));
  const k = BigInt(degree);
  while (root ** k > n) root -= 1n;
  while ((root + 1n) ** k <= n) root += 1n;
  return root;
}
const fraction32 = (prime, degree) => Number(BigInt.asUintN(32, integerRoot(BigInt(prime) << BigInt(32 * degree), degree)));
function firstPrimes(count) {
  const primes = [];
  for (let n = 2; primes.length < count; n += 1) if (primes.every((p) => n % p !== 0)) primes.push(n);
  return primes;
}
const kPrimes = firstPrimes(64);
const kInitial = kPrimes.slice(0, 8).map((prime) => fraction32(prime, 2));
const kRounds = Uint32Array.from(kPrimes, (prime) => fraction32(prime, 3));

function padded(rest, totalBytes) {
  const out = new Uint8Array(Math.ceil((rest.length + 9) / 64) * 64);
  out.set(rest);
  out[rest.length] = 0x80;
  new DataView(out.buffer).setBigUint64(out.length - 8, BigInt(totalBytes) * 8n);
  return out;
}

const rotate = (x, n) => (x >>> n) | (x << (32 - n));

function compress(hash, bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const w = new Int32Array(64);
  for (let at = 0; at < bytes.length; at += 64) {
    for (let i = 0; i < 16; i += 1) w[i] = view.getInt32(at + 4 * i);
    for (let i = 16; i < 64; i += 1) {
      const s0 = rotate(w[i - 15], 7) ^ rotate(w[i - 15], 18) ^ (w[i - 15] >>> 3);
      const s1 = rotate(w[i - 2], 17) ^ rotate(w[i - 2], 19) ^ (w[i - 2] >>> 10);
      w[i] = w[i - 16] + s0 + w[i - 7] + s1;
    }
    let [a, b, c, d, e, f, g, k] = hash;
    for (let i = 0; i < 64; i += 1) {
      const t1 = (k + (rotate(e, 6) ^ rotate(e, 11) ^ rotate(e, 25)) + ((e & f) ^ (~e & g)) + kRounds[i] + w[i]) | 0;
      const t2 = ((rotate(a, 2) ^ rotate(a, 13) ^ rotate(a, 22)) + ((a & b) ^ (a & c) ^ (b & c))) | 0;
      k = g; g = f; f = e; e = (d + t1) | 0; d = c; c = b; b = a; a = (t1 + t2) | 0;
    }
    [a, b, c, d, e, f, g, k].forEach((word, i) => { hash[i] += word; });
  }
}

// A mix of light groups as the panel sets it: for each group a gain, a colour and a colour temperature, of all its
// light or of surfaces and media apart, mute and solo. Its texts are in the address, its factors in the
// files that `lightshaft fetch --mix` reads. Pure functions.

export const kMix = "mix"; // the layers that are mixed here
export const kMixError = "mix.stderr";
export const kMostStops = 20; // 2^20 is a little more than the largest factor
export const kKelvin = [1000, 15000]; // what Krystek's formula is for
const kMostFactor = 1e6; // as in light_mix.h
const kPrefix = "RGB_";
const kVolume = ".volume";
const kDigits = 9; // of factors in addresses and files

export const kPlainPart = { gain: 0, colour: [1, 1, 1], kelvin: null };
/** volume: of light that was last scattered in a medium; null: as `surface`, which then is of all light. */
const kPlainRow = { solo: false, mute: false, surface: kPlainPart, volume: null };

/** Of the layers of a picture: [{name, apart}], apart: the light of its media has a layer. */
export function groupsOf(layers) {
  const names = new Set(layers.map(({ name }) => name));
  const groups = [...names].filter((name) => name.startsWith(kPrefix) && !name.includes("."));
  return groups.map((name) => ({ name: name.slice(kPrefix.length), apart: names.has(name + kVolume) }));
}

// ---- colours ----

const luminance = ([r, g, b]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

/**
 * Linear sRGB of a black body of this temperature, with luminance 1. The chromaticity is M. Krystek's, "An algorithm to
 * calculate correlated colour temperature", Color Research & Application 10 (1985) 38-40: u and v within 9e-5 of the
 * Planckian locus. Below 1900 K it has no blue in sRGB, and gets none.
 */
export function kelvinColour(t) {
  const u = (0.860117757 + 1.54118254e-4 * t + 1.28641212e-7 * t * t) / (1 + 8.42420235e-4 * t + 7.08145163e-7 * t * t);
  const v = (0.317398726 + 4.22806245e-5 * t + 4.20481691e-8 * t * t) / (1 - 2.89741816e-5 * t + 1.61456053e-7 * t * t);
  const [x, y] = [3 * u, 2 * v].map((part) => part / (2 * u - 8 * v + 4));
  const [X, Z] = [x / y, (1 - x - y) / y];
  // IEC 61966-2-1
  const rgb = [3.2406 * X - 1.5372 - 0.4986 * Z, -0.9689 * X + 1.8758 + 0.0415 * Z, 0.0557 * X - 0.204 + 1.057 * Z].map((part) => Math.max(0, part));
  return rgb.map((part) => part / luminance(rgb));
}

/** "#rrggbb" of a linear colour whose largest part is 1, and back. */
export const hexOf = (colour) => `#${colour.map((v) => Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055)).toString(16).padStart(2, "0")).join("")}`;
export const colourOf = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));

// ---- rows and factors ----

const isPlainPart = ({ gain, colour, kelvin }) => gain === 0 && kelvin === null && colour.every((v) => v === 1);
export const rowOf = (rows, name) => rows.get(name) ?? kPlainRow;

function partFactors({ gain, colour, kelvin }) {
  const black = kelvin === null ? [1, 1, 1] : kelvinColour(kelvin);
  return colour.map((v, c) => Math.min(kMostFactor, Number((v * black[c] * 2 ** gain).toPrecision(kDigits))));
}

/** {surface, volume}: three factors each, of a group among these rows. */
export function factorsOf(rows, name) {
  const row = rowOf(rows, name);
  if (row.mute || (!row.solo && [...rows.values()].some(({ solo }) => solo))) return { surface: [0, 0, 0], volume: [0, 0, 0] };
  const surface = partFactors(row.surface);
  return { surface, volume: row.volume ? partFactors(row.volume) : surface };
}

const same = (a, b) => a.every((v, c) => v === b[c]);
const short = (factors) => (same(factors, [factors[0], factors[0], factors[0]]) ? factors[0] : factors);

/** The mix as the coordinator reads it: {group: factors}, without groups that keep their light. */
export function mixOf(rows, groups) {
  const mix = {};
  for (const { name } of groups) {
    const { surface, volume } = factorsOf(rows, name);
    if (!same(surface, volume)) mix[name] = { surface: short(surface), volume: short(volume) };
    else if (!same(surface, [1, 1, 1])) mix[name] = short(surface);
  }
  return mix;
}

/** The rows of such a mix; an Error says what is wrong with it. */
export function rowsOfMix(mix, groups) {
  if (mix === null || typeof mix !== "object" || Array.isArray(mix)) throw new Error("It is no JSON object of light groups and factors, as {\"sun\": 2}.");
  const rows = new Map();
  for (const [name, value] of Object.entries(mix)) {
    const group = groups.find((one) => one.name === name);
    if (!group) throw new Error(`The image has no light group "${name}"; it has ${groups.map((one) => one.name).join(", ")}.`);
    const parted = value !== null && typeof value === "object" && !Array.isArray(value);
    if (parted && Object.keys(value).some((key) => key !== "surface" && key !== "volume")) throw new Error(`The light group "${name}" has more than "surface" and "volume".`);
    const surface = partOf(parted ? value.surface ?? 1 : value, name);
    const volume = parted ? partOf(value.volume ?? 1, name) : null;
    if (volume && !group.apart) throw new Error("The image does not have the light of media apart: render it with --aov volume_light_groups.");
    rows.set(name, { ...kPlainRow, surface, volume });
  }
  return rows;
}

function partOf(value, name) {
  const factors = Array.isArray(value) ? value : [value, value, value];
  if (factors.length !== 3 || !factors.every((v) => typeof v === "number" && v >= 0 && v <= kMostFactor)) throw new Error(`A factor of the light group "${name}" is no number from 0 to ${kMostFactor} and no list of three.`);
  const most = Math.max(...factors);
  return most === 0 ? { ...kPlainPart, colour: [0, 0, 0] } : { gain: Math.log2(most), colour: factors.map((v) => v / most), kelvin: null };
}

// ---- texts of the address: sun*s*g1.5*c1_0.5_0.2*k3200*v*vg2 ----

const brief = (v) => String(Number(v.toPrecision(kDigits)));
const partTexts = ({ gain, colour, kelvin }, of) => [
  gain === 0 ? null : `${of}g${brief(gain)}`, colour.every((v) => v === 1) ? null : `${of}c${colour.map(brief).join("_")}`, kelvin === null ? null : `${of}k${brief(kelvin)}`];

export function textsOf(rows) {
  return [...rows].map(([name, row]) => [name, row.solo ? "s" : null, row.mute ? "m" : null, ...partTexts(row.surface, ""), ...(row.volume ? ["v", ...partTexts(row.volume, "v")] : [])].filter((part) => part !== null))
    .filter((parts) => parts.length > 1).map((parts) => parts.join("*"));
}

/** What the texts say of these groups, as far as it makes sense. */
export function rowsOf(texts, groups) {
  const rows = new Map();
  for (const text of texts) {
    const [name, ...parts] = text.split("*");
    const group = groups.find((one) => one.name === name);
    if (!group) continue;
    const row = { ...kPlainRow, surface: { ...kPlainPart } };
    for (const part of parts) {
      const [, of, what, value] = /^(v?)([smgck]?)([\d._e+-]*)$/.exec(part) ?? [];
      if (of && !group.apart) continue;
      if (of) row.volume ??= { ...kPlainPart };
      if (what === "s" || what === "m") row[what === "s" ? "solo" : "mute"] = true;
      else if (what) Object.assign(of ? row.volume : row.surface, fieldOf(what, value));
    }
    rows.set(name, row);
  }
  return rows;
}

function fieldOf(what, value) {
  const numbers = value.split("_").map(Number);
  if (!numbers.every(Number.isFinite) || value === "") return {};
  if (what === "g") return { gain: Math.min(kMostStops, Math.max(-kMostStops, numbers[0])) };
  if (what === "k") return { kelvin: Math.min(kKelvin[1], Math.max(kKelvin[0], numbers[0])) };
  return numbers.length === 3 && numbers.every((v) => v >= 0 && v <= 1) ? { colour: numbers } : {};
}

/** The rows with one changed; one that says nothing more is left out. */
export function withRow(rows, name, more) {
  const next = new Map(rows);
  const row = { ...rowOf(rows, name), ...more };
  if (!row.solo && !row.mute && !row.volume && isPlainPart(row.surface)) next.delete(name);
  else next.set(name, row);
  return next;
}

// Turns dropped files into a job: finds the scene among them, the files that it names, missing and unused
// files. Only files that the scene names are sent, or all where it can't be read here.

const kIncludeDepth = 15; // the same limits as in the coordinator's reader
const kIncludes = 256;

/** Files of a drop or of an <input type=file>, with their paths: [{path, file}]. Folders are walked. */
export async function filesOfDrop(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (entries.length === 0) return filesOfList(transfer.files);
  return (await Promise.all(entries.map(walk))).flat();
}

export const filesOfList = (list) => [...list].map((file) => ({ path: file.webkitRelativePath || file.name, file }));

async function walk(entry) {
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    return [{ path: entry.fullPath.replace(/^\//, ""), file }];
  }
  const reader = entry.createReader();
  const children = [];
  for (;;) { // readEntries returns at most 100 entries per call
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) break;
    children.push(...some);
  }
  return (await Promise.all(children.map(walk))).flat();
}

const folderOf = (path) => path.split("/").slice(0, -1);
const baseOf = (path) => path.split("/").pop();

const kUsd = /\.usd[acz]?$/i;
const kScenes = [/\.xml$/i, /\.gltf$/i, /\.glb$/i, /\.pbrt$/i, kUsd, /\.zip$/i, /\.(tar|tar\.gz|tgz)$/i]; // the most likely first
export const kSceneEndings = ".xml, .gltf, .glb, .pbrt, .usd, .usda, .usdc, .usdz, .zip, .tar or .tar.gz";
const kArchive = /\.(zip|tar|tgz|tar\.gz)$/i;
const kindOf = (path) => kScenes.findIndex((ending) => ending.test(path));

/** Scene files among them, the least nested first, and then archives, which may hold anything. */
export function scenesAmong(files) {
  return files
    .map(({ path }) => path)
    .filter((path) => kindOf(path) >= 0)
    .sort((a, b) => kArchive.test(a) - kArchive.test(b) || folderOf(a).length - folderOf(b).length || kindOf(a) - kindOf(b) || byName(a, b));
}

/** smoke.2 before smoke.10. */
const byName = (a, b) => a.localeCompare(b, "en", { numeric: true }) || (a < b ? -1 : 1);

/** What to do with files of which none is a scene. */
export const kNoScene = `There is no scene among these files. Add it: ${kSceneEndings}.`;

/**
 * {main, assets: [{name, file}], missing: [name], unused: [path], frames, archive, allSent}: `name` is where the coordinator looks for the file
 * first among the places that have it. A file is found by its path relative to the scene, or else by its base name if
 * that is unique (files dropped without their folders). A scene that can't be read, or names that hold $parameters,
 * take all files along: allSent. frames: the numbers of the files that stand for frames, as the form of a job says them; "" if
 * there are none. archive: the type of an archive, which has all files in itself; null of a scene.
 */
export async function plan(files, main) {
  const scene = files.find(({ path }) => path === main);
  const others = files.filter((file) => file !== scene);
  const found = await planned(scene, others, main);
  return {
    main: scene.file, frames: "", archive: null, allSent: false, ...found,
    assets: [...found.assets].sort((a, b) => byName(a.name, b.name)), missing: [...found.missing].sort(byName), unused: [...found.unused].sort(byName),
  };
}

const everything = (others, main) => ({ assets: others.map(({ path, file }) => ({ name: relative(path, main), file })), missing: [], unused: [], allSent: true });

async function planned(scene, others, main) {
  if (kArchive.test(main)) return { archive: /\.zip$/i.test(main) ? "application/zip" : "application/x-tar", assets: [], missing: [], unused: others.map(({ path }) => path) };
  if (/\.pbrt$/i.test(main) || kUsd.test(main)) return everything(others, main);
  if (/\.gl(tf|b)$/i.test(main)) return planOfGltf(scene, others, main);
  const survey = new Survey(others, main);
  if (!(await survey.read(scene.file, [])) || survey.hasParameters) {
    return everything(others, main);
  }
  survey.resolveStrings();
  const used = new Set(survey.found.values());
  return {
    frames: framesOf(survey.numbers),
    assets: [...survey.found].map(([name, { file }]) => ({ name, file })),
    missing: [...survey.missing],
    unused: others.filter((entry) => !used.has(entry)).map(({ path }) => path),
  };
}

const kGlbHead = 20; // bytes: magic, version, length; then length and type of the first chunk, which is JSON

/** Of a broken name the coordinator says what is wrong with it. */
function decoded(uri) {
  try {
    return decodeURIComponent(uri);
  } catch {
    return uri;
  }
}

/** What a glTF names: its buffers and images, unless they are within it. */
async function planOfGltf(scene, others, main) {
  let described;
  try {
    if (/\.gltf$/i.test(main)) described = JSON.parse(await scene.file.text());
    else {
      const head = new DataView(await scene.file.slice(0, kGlbHead).arrayBuffer());
      described = JSON.parse(await scene.file.slice(kGlbHead, kGlbHead + head.getUint32(12, true)).text());
    }
  } catch {
    return everything(others, main); // the coordinator says what is wrong with it
  }
  const names = [...(described.buffers ?? []), ...(described.images ?? [])].map(({ uri }) => uri).filter((uri) => typeof uri === "string" && !uri.startsWith("data:")).map(decoded);
  const found = new Map([...new Set(names)].map((name) => [joined("", name), others.find(({ path }) => relative(path, main) === joined("", name)) ?? only(others, name)]));
  const used = new Set(found.values());
  return {
    assets: [...found].filter(([, entry]) => entry).map(([name, { file }]) => ({ name, file })),
    missing: [...found].filter(([, entry]) => !entry).map(([name]) => name),
    unused: others.filter((entry) => !used.has(entry)).map(({ path }) => path),
  };
}

/** "1-8", or "1-15x2" for every second one; "" if there is no order in the numbers, or none. */
export function framesOf(numbers) {
  const sorted = [...numbers].sort((a, b) => a - b);
  if (sorted.length < 2) return sorted.length ? String(sorted[0]) : "";
  const by = sorted[1] - sorted[0];
  const last = sorted.at(-1);
  // one that is missing in between is the coordinator's to name
  if (by === 1 || sorted.some((n, i) => n !== sorted[0] + i * by)) return `${sorted[0]}-${last}`;
  return `${sorted[0]}-${last}x${by}`;
}

/** What a scene names, found as the coordinator's reader finds it (formats/reader/load_document.cpp, reader.cpp). */
class Survey {
  found = new Map(); // files found: name -> {path, file}
  missing = new Set();
  numbers = new Set(); // of the files that stand for frames
  hasParameters = false;
  #files;
  #main;
  #paths = []; // folders of <path> elements, the latest first
  #strings = new Set();
  #includes = 0;

  constructor(files, main) {
    this.#files = files;
    this.#main = main;
  }

  /** In document order, since a <path> counts from where it stands. `within`: names of the files that include this one. False: no XML (the coordinator says why). */
  async read(file, within) {
    const document = new DOMParser().parseFromString(await file.text(), "application/xml");
    if (document.querySelector("parsererror")) return false;
    for (const node of document.querySelectorAll('path[value], include[filename], string[name="filename"][value]')) {
      const name = node.getAttribute(node.localName === "include" ? "filename" : "value");
      this.hasParameters ||= name.includes("$");
      if (node.localName === "path") this.#paths.unshift(joined("", name));
      else if (node.localName === "string") this.#strings.add(name);
      else if (name && !(await this.#include(name, within))) return false;
    }
    return true;
  }

  /** Beside the including file, in the <path>s so far, beside the scene. */
  async #include(name, within) {
    this.#includes += 1;
    const beside = within.length ? [joined(`${within.at(-1)}/..`, name)] : [];
    const place = this.#resolve(name, beside);
    if (place === null || within.includes(place) || within.length >= kIncludeDepth || this.#includes > kIncludes) return true;
    return this.read(this.found.get(place).file, [...within, place]);
  }

  /** Meshes, textures and grids: in all <path>s, beside the scene. */
  resolveStrings() {
    for (const name of this.#strings) if (name) this.#resolve(name, []);
  }

  /** A name with # stands for one file per frame: all that fit are taken along; the coordinator says which frames lack one. */
  #resolveNumbered(name, first) {
    const places = [...first, ...this.#paths.map((path) => joined(path, name)), joined("", name)];
    let any = null;
    for (const place of places) {
      for (const entry of this.#files) {
        const path = relative(entry.path, this.#main);
        if (!fits(place, path)) continue;
        this.found.set((any ??= path, path), entry);
        this.numbers.add(numberIn(place, path));
      }
      if (any !== null) return any;
    }
    const alike = this.#files.filter(({ path }) => fits(baseOf(name), baseOf(path)));
    for (const entry of alike) {
      this.found.set(joined(`${places.at(-1)}/..`, baseOf(entry.path)), entry);
      this.numbers.add(numberIn(baseOf(name), baseOf(entry.path)));
    }
    if (alike.length === 0) this.missing.add(name);
    return null;
  }

  #resolve(name, first) {
    const places = [...first, ...this.#paths.map((path) => joined(path, name)), joined("", name)];
    const exact = places.map((place) => [place, this.#files.find(({ path }) => relative(path, this.#main) === place)]).find(([, entry]) => entry);
    if (!exact && name.includes("#")) return this.#resolveNumbered(name, first);
    const [place, entry] = exact ?? [places.at(-1), only(this.#files, name)];
    if (!entry) {
      this.missing.add(name);
      return null;
    }
    this.found.set(place, entry);
    return place;
  }
}

/** "fog.0007.vdb" fits "fog.####.vdb": a number of at least as many digits as there are #. */
export const fits = (pattern, path) => numbered(pattern).test(path);
const numberIn = (pattern, path) => Number(numbered(pattern).exec(path)[1]);

function numbered(pattern) {
  const source = pattern.split(/(#+)/).map((part) => (part.startsWith("#") ? `(\\d{${part.length},})` : part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&")));
  return new RegExp(`^${source.join("")}$`);
}

/** The one file of this base name. */
function only(files, name) {
  const alike = files.filter(({ path }) => baseOf(path) === baseOf(name));
  return alike.length === 1 ? alike[0] : undefined;
}

/** "a/.." and "./b/x.obj" are "b/x.obj". */
function joined(folder, name) {
  const text = folder === "" || name.startsWith("/") ? name : `${folder}/${name}`;
  const parts = [];
  for (const part of text.split("/")) {
    if (part === "" || part === ".") continue;
    if (part === ".." && parts.length > 0 && parts.at(-1) !== "..") parts.pop();
    else parts.push(part);
  }
  return (text.startsWith("/") ? "/" : "") + parts.join("/");
}

/** `path` as seen from the folder of `main`: "a/b/c.obj" from "a/s.xml" is "b/c.obj"; "t/x.png" from "a/s.xml" is "../t/x.png". */
export function relative(path, main) {
  const from = folderOf(main);
  const to = path.split("/");
  let same = 0;
  while (same < from.length && same < to.length - 1 && from[same] === to[same]) same += 1;
  return [...from.slice(same).map(() => ".."), ...to.slice(same)].join("/");
}

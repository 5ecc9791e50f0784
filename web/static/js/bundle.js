// From dropped files to what a job needs: which file is the scene, which files it names, what is missing, what is not
// used. Only what the scene names is sent.

const kIncludeDepth = 16;

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
  for (;;) { // readEntries hands out at most 100 at a time
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) break;
    children.push(...some);
  }
  return (await Promise.all(children.map(walk))).flat();
}

const folderOf = (path) => path.split("/").slice(0, -1);
const baseOf = (path) => path.split("/").pop();

/** Scene files among them, the least nested first. */
export function scenesAmong(files) {
  return files
    .map(({ path }) => path)
    .filter((path) => path.toLowerCase().endsWith(".xml"))
    .sort((a, b) => folderOf(a).length - folderOf(b).length || (a < b ? -1 : 1));
}

/** Names of the files that a scene text mentions, as it writes them; null if it is not XML (the coordinator says why). */
export function namesIn(text) {
  const document = new DOMParser().parseFromString(text, "application/xml");
  if (document.querySelector("parsererror")) return null;
  const strings = [...document.querySelectorAll('string[name="filename"]')].map((node) => node.getAttribute("value"));
  const includes = [...document.querySelectorAll("include[filename]")].map((node) => node.getAttribute("filename"));
  return { names: [...new Set([...strings, ...includes])].filter(Boolean), includes };
}

/**
 * {main, assets: [{name, file}], missing: [name], unused: [path]}: `name` is what the scene calls the file. A file is
 * found by its path relative to the scene, or else by its base name if that is unique (files dropped without their
 * folders). A scene that can't be read, or names that hold $parameters, take all files along.
 */
export async function plan(files, main) {
  const scene = files.find(({ path }) => path === main);
  const others = files.filter((file) => file !== scene);
  const wanted = await namesOf(scene.file, others, main);
  if (wanted === null || wanted.some((name) => name.includes("$"))) {
    return { main: scene.file, assets: others.map(({ path, file }) => ({ name: relative(path, main), file })), missing: [], unused: [] };
  }
  const found = wanted.map((name) => ({ name, entry: find(others, name, main) }));
  const used = new Set(found.map(({ entry }) => entry));
  return {
    main: scene.file,
    assets: found.filter(({ entry }) => entry).map(({ name, entry }) => ({ name, file: entry.file })),
    missing: found.filter(({ entry }) => !entry).map(({ name }) => name),
    unused: others.filter((entry) => !used.has(entry)).map(({ path }) => path),
  };
}

async function namesOf(file, others, main, depth = 0) {
  const own = namesIn(await file.text());
  if (own === null) return null;
  const all = new Set(own.names);
  for (const include of depth < kIncludeDepth ? own.includes : []) {
    const entry = find(others, include, main);
    const inner = entry && entry.file !== file ? await namesOf(entry.file, others, main, depth + 1) : [];
    if (inner === null) return null;
    inner.forEach((name) => all.add(name));
  }
  return [...all];
}

function find(files, name, main) {
  const exact = files.find(({ path }) => relative(path, main) === name.replace(/^\.\//, ""));
  if (exact) return exact;
  const alike = files.filter(({ path }) => baseOf(path) === baseOf(name));
  return alike.length === 1 ? alike[0] : undefined;
}

/** `path` as seen from the folder of `main`: "a/b/c.obj" from "a/s.xml" is "b/c.obj"; "t/x.png" from "a/s.xml" is "../t/x.png". */
export function relative(path, main) {
  const from = folderOf(main);
  const to = path.split("/");
  let same = 0;
  while (same < from.length && same < to.length - 1 && from[same] === to[same]) same += 1;
  return [...from.slice(same).map(() => ".."), ...to.slice(same)].join("/");
}

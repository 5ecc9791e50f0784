// What the user can do in the viewer, and the data that it fetches: at most two pictures, of jobs or of a
// file.
import { kCompared, kMostExposure, kOverlays, queryOf, viewOf } from "./viewer/address.js";
import { kCurves } from "./viewer/tone.js";
import { openFile } from "./viewer/file_source.js";
import { PixelSource } from "./viewer/source.js";
import { regionFigures } from "./viewer/region.js";
import { viewHref } from "./route.js";
import { isOver, mayChange, withJob, withViewer } from "./state.js";

const kLetters = { e: "exposure", c: "curve", l: "layer", o: "overlay", f: "falseColour", b: "by" };
const kExposureStep = 0.5;

const next = (list, value, by) => list[(list.indexOf(value) + by + list.length) % list.length];

export function makeViewerActions({ get, set, attempt, api, snapshot }) {
  const sources = { a: null, b: null };
  let pointing = 0;

  function change(more) {
    if (!get().viewer) return;
    set(withViewer(get(), more));
    const { route, viewer } = get();
    window.history.replaceState(null, "", viewHref(route.id, queryOf(viewer.view)));
  }
  const look = (more) => change({ view: { ...get().viewer.view, ...more } });

  function came(problem) {
    if (get().viewer) set(withViewer(get(), { changed: get().viewer.changed + 1, problem: problem ? problem.message : null }));
  }

  async function openJob(which, id) {
    const meta = await attempt(() => api.layers(id));
    if (!meta || get().viewer === null) return;
    sources[which]?.close();
    sources[which] = new PixelSource(meta, (layer, level, rect) => api.pixels(id, layer, level, rect), came);
    set(withViewer(get(), { [which]: sources[which] }));
    refreshFigures();
  }

  async function compare(id) {
    sources.b?.close();
    sources.b = null;
    change({ b: null, file: null, view: { ...get().viewer.view, other: id || null } });
    if (id) await openJob("b", id);
  }

  async function compareFile(file) {
    let source;
    try {
      source = await openFile(file);
    } catch (error) {
      set(withViewer(get(), { problem: `${file.name}: ${error.message}` }));
      return;
    }
    sources.b?.close();
    sources.b = source;
    change({ b: source, file: file.name, problem: null, view: { ...get().viewer.view, other: null } });
    refreshFigures();
  }

  /** The values under the pointer, and their standard error: of whatever came last, if several are under way. */
  async function point(pixel) {
    pointing += 1;
    const mine = pointing;
    const { a, b, view } = get().viewer;
    if (!pixel || !a) {
      set(withViewer(get(), { probe: pixel && { pixel } }));
      return;
    }
    const of = (source, name) => (source?.layer(name).name === name ? source.pixel(source.layer(name), ...pixel).catch(() => null) : null);
    const [values, error, samples, second] = await Promise.all([of(a, view.layer), view.layer === "rgb" ? of(a, "stderr") : null, of(a, "spp"), of(b, view.layer)]);
    if (mine === pointing && get().viewer) set(withViewer(get(), { probe: { pixel, layer: view.layer, values, error, samples: samples?.[0], second } }));
  }

  async function pick(pixel) {
    const { a, view } = get().viewer;
    const layer = a.layer(view.layer);
    if (layer.blocks !== "first") return;
    const values = await a.pixel(layer, ...pixel).catch(() => null);
    if (!values || values[0] === 0) look({ matte: [] });
    else {
      const name = nameOf(layer, values[0]);
      look({ matte: view.matte.includes(name) ? view.matte.filter((one) => one !== name) : [...view.matte, name] });
    }
  }

  /** Of the region that is framed: its mean, error, and how far the second picture is from the first. */
  async function refreshFigures() {
    const { a, b, view } = get().viewer;
    if (!view.region || !a) return;
    const figures = await regionFigures(a, b, view.region).catch(() => null);
    if (get().viewer?.view.region === view.region) set(withViewer(get(), { figures }));
  }

  function frame(region) {
    look({ region });
    set(withViewer(get(), { figures: null }));
    refreshFigures();
  }

  /** Has the tiles of a rectangle rendered before the others; null: all alike again. */
  async function focus(rect) {
    const { id } = get().viewer;
    await snapshot(`job ${id}`, () => attempt(() => api.change(id, { focus: rect })), withJob);
  }

  /** The region is rendered first; if it is already, or there is none, all tiles are alike again. */
  function toggleFocus() {
    const { viewer, jobs } = get();
    const job = jobs?.get(viewer.id);
    const { region } = viewer.view;
    if (!job || isOver(job) || !mayChange(get())) return;
    if (region && String(region) !== String(job.focus)) focus(region);
    else if (job.focus) focus(null);
  }

  function command(key) {
    const { view, a } = get().viewer;
    const by = key === key.toLowerCase() ? 1 : -1;
    const what = kLetters[key.toLowerCase()];
    if (what === "exposure") look({ exposure: Math.min(kMostExposure, Math.max(-kMostExposure, view.exposure + by * kExposureStep)) });
    else if (what === "falseColour") look({ falseColour: !view.falseColour });
    else if (what === "curve") look({ curve: next(kCurves.map(([name]) => name), view.curve, by) });
    else if (what === "overlay") look({ overlay: next(kOverlays.map(([name]) => name), view.overlay, by) });
    else if (what === "layer" && a) look({ layer: next(a.layers.map((layer) => layer.name), view.layer, by) });
    else if (what === "by" && get().viewer.b) look({ by: next(kCompared.map(([name]) => name), view.by, by) });
    else if (key === "p") toggleFocus();
    else if (key === "x" && get().viewer.b) look({ by: view.by === "a" ? "b" : "a" });
    else if ((key === "[" || key === "]") && get().viewer.b) look({ split: Math.min(1, Math.max(0, view.split + (key === "]" ? 0.05 : -0.05))) });
  }

  return {
    /** Of the address: another job, or another view of the same. */
    openViewer: ({ id, query }) => {
      const view = viewOf(query);
      const before = get().viewer;
      if (before?.id === id) {
        set(withViewer(get(), { view }));
        if (view.other !== before.view.other) compare(view.other);
        return;
      }
      for (const which of ["a", "b"]) sources[which]?.close();
      sources.a = sources.b = null;
      set({ ...get(), viewer: { id, view, a: null, b: null, file: null, others: null, tool: "pan", probe: null, figures: null, flip: null, problem: null, changed: 0 } });
      openJob("a", id);
      // if this fails, the viewer says so for the layers
      snapshot(`job ${id}`, () => api.job(id), (now, job) => (now.viewer?.id === id ? withJob(now, job) : now)).catch(() => {});
      // if this fails, only jobs that are known already are offered
      api.list("sort=-submitted&limit=200").then(({ jobs }) => set(withViewer(get(), { others: jobs })), () => {});
      if (view.other) openJob("b", view.other);
    },
    closeViewer: () => {
      for (const which of ["a", "b"]) sources[which]?.close();
      sources.a = sources.b = null;
      if (get().viewer) set({ ...get(), viewer: null });
    },
    /** An event of the stream, or null: any may have been missed. */
    viewerEvent: (type, data) => {
      const { viewer } = get();
      if (!viewer) return;
      for (const [which, id] of [["a", viewer.id], ["b", viewer.view.other]]) {
        if (type === null) sources[which]?.touch(null);
        else if (type === "tile" && data.job === id && data.state === "folded") sources[which]?.touch(data.rect);
      }
    },
    look,
    point,
    pick,
    frame,
    command,
    focus,
    compare,
    compareFile,
    flipped: (flip) => set(withViewer(get(), { flip })),
    setTool: (tool) => set(withViewer(get(), { tool })),
  };
}

/** The name of an identifier in the manifest of its layer; without one its eight hexadecimal digits. */
export function nameOf(layer, bits) {
  const hex = bits.toString(16).padStart(8, "0");
  return Object.entries(layer.names ?? {}).find(([, id]) => id === hex)?.[0] ?? hex;
}

/** The identifiers of names. */
export const identifiersOf = (layer, names) => new Set(names.map((name) => parseInt(layer.names?.[name] ?? name, 16)).filter((id) => id > 0));

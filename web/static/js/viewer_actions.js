// What the user can do in the viewer, and the data that it fetches: at most two pictures, of jobs or of a
// file.
import { kCompared, kMostExposure, kOverlays, queryOf, viewOf } from "./viewer/address.js";
import { cubeFrom, curveOf, curvesOf, isView } from "./viewer/display.js";
import { openFile } from "./viewer/file_source.js";
import { PixelSource } from "./viewer/source.js";
import { kindOf } from "./viewer/paint.js";
import { regionFigures } from "./viewer/region.js";
import { downloads } from "./api.js";
import { h } from "./dom.js";
import { viewHref } from "./route.js";
import { isOver, mayChange, withJob, withViewer } from "./state.js";

const kLetters = { e: "exposure", c: "curve", l: "layer", o: "overlay", f: "falseColour", b: "by", k: "channel" };
const kBins = 64; // of a histogram
const kExposureStep = 0.5;
const kMostCubes = 8; // tables of views that are kept, of 3.3 MB each

const next = (list, value, by) => list[(list.indexOf(value) + by + list.length) % list.length];

export function makeViewerActions({ get, set, attempt, api, snapshot }) {
  const sources = { a: null, b: null };
  let mixing = null; // of the first picture, if it has light groups
  const newest = { point: 0, survey: 0, figures: 0 }; // number of the latest question of each kind: its answer alone is shown
  const cubes = new Map(); // tables of views by name

  function change(more) {
    if (!get().viewer) return;
    set(withViewer(get(), more));
    const { route, viewer } = get();
    window.history.replaceState(null, "", viewHref(route.id, queryOf(viewer.view, viewer.plain)));
  }

  function look(more) {
    const before = get().viewer?.view;
    if (!before) return;
    change({ view: { ...before, ...more } });
    if (more.mix) remix();
    if (more.curve) needCube();
    if ((more.layer ?? before.layer) !== before.layer) {
      probeAgain();
      survey();
      refreshFigures();
    }
  }

  /** Fetches the table of the view that is shown. Until it is there, the curve of sRGB is shown. */
  async function needCube() {
    const wanted = () => get().viewer && curveOf(get().viewer.view.curve, get().displays);
    const name = wanted();
    if (!isView(name) || get().viewer.cube?.name === name) return;
    let values = cubes.get(name);
    if (!values) {
      const buffer = await attempt(() => api.viewCube(name));
      if (!buffer) return;
      values = cubeFrom(buffer);
      if (cubes.size >= kMostCubes) cubes.delete(cubes.keys().next().value); // the oldest
      cubes.set(name, values);
    }
    if (wanted() === name) set(withViewer(get(), { cube: { name, values } }));
  }

  /** Mixes light groups as the address says. */
  function remix() {
    for (const which of ["a", "b"]) sources[which]?.mix?.(get().viewer.view.mix);
    mixing?.changed();
    probeAgain();
  }

  /** What mixes light groups, which is loaded for the first picture that has some. */
  function mixingOf(layers) {
    return layers.some(({ name }) => name.startsWith("RGB_")) ? import(new URL("./viewer/mixing.js", import.meta.url)) : null;
  }

  function closeSources() {
    for (const which of ["a", "b"]) sources[which]?.close();
    sources.a = sources.b = null;
    mixing?.close();
    mixing = null;
  }

  /** What is read from the pixel under the pointer stays when another layer or picture comes. */
  function probeAgain() {
    const pixel = get().viewer?.probe?.pixel;
    if (pixel) point(pixel);
  }

  /** The ends and the histogram of the layer that is shown, if it needs them. */
  async function survey() {
    const mine = ++newest.survey;
    const { a, view, histogram } = get().viewer ?? {};
    if (!a) return;
    const layer = a.layer(view.layer);
    const kind = kindOf(layer);
    if (kind === "matte" || (kind !== "measure" && !histogram)) return;
    const found = await a.survey(layer.name, kBins).catch(() => null);
    if (found && mine === newest.survey && get().viewer?.a === a) set(withViewer(get(), { survey: { layer: layer.name, ...found } }));
  }

  function came(problem) {
    if (get().viewer) set(withViewer(get(), { changed: get().viewer.changed + 1, problem: problem ? problem.message : null }));
  }

  async function openJob(which, id) {
    const { viewer: opened } = get();
    /** Not if the viewer was closed meanwhile, or another picture was chosen to compare with. */
    const wanted = () => get().viewer?.id === opened.id && (which === "a" || get().viewer.view.other === id);
    let meta;
    let light; // the module
    let plain = opened?.plain;
    try {
      meta = await api.layers(id);
      light = await mixingOf(meta.layers);
      if (which === "a") plain = await bestLayer(id, meta);
    } catch (error) {
      if (error.status === 401) await attempt(() => Promise.reject(error));
      else if (wanted()) set(withViewer(get(), { problem: error.message }));
      return;
    }
    if (!wanted()) return;
    sources[which]?.close();
    const plainSource = new PixelSource(meta, (layer, level, rect) => api.pixels(id, layer, level, rect), came);
    sources[which] = light ? new light.MixedSource(plainSource) : plainSource;
    if (which === "a" && light) {
      mixing = light.makeMixing({
        h, layers: meta.layers, look, get: () => get().viewer, show: (more) => set(withViewer(get(), more)),
        settled: () => { refreshFigures(); survey(); },
        job: {
          error: (mix) => api.mix(id, mix),
          exr: (mix) => downloads.exr(id, mix),
          again: mayChange(get()) ? async (mix) => { location.hash = `#/jobs/${(await api.again(id, { mix })).id}`; } : null,
        },
      });
    }
    const { view } = get().viewer;
    set(withViewer(get(), { [which]: sources[which], plain, ...(which === "a" ? { mixing, view: { ...view, layer: view.layer ?? plain } } : {}) }));
    if (light) remix();
    refreshFigures();
    probeAgain();
    if (which === "a") survey();
  }

  /** The denoised picture of a job that is done, if it has one. */
  async function bestLayer(id, { layers }) {
    if (!layers.some(({ name }) => name === "denoised")) return "rgb";
    const job = get().jobs?.get(id) ?? await api.job(id);
    const report = await api.report(id).catch(() => null);
    if (get().viewer?.id === id) set(withViewer(get(), { report }));
    return job.state === "done" ? "denoised" : "rgb";
  }

  async function compare(id) {
    sources.b?.close();
    sources.b = null;
    change({ b: null, file: null, refused: null, view: { ...get().viewer.view, other: id || null } });
    if (id) await openJob("b", id);
    else probeAgain();
  }

  /** Of the pictures by their numbers: 1 is the first, 2 to 9 are compared with it, in the order of their list. */
  async function showPicture(number) {
    const { viewer } = get();
    if (number === 1) {
      look({ by: "a" });
      return;
    }
    const id = comparable(get(), viewer)[number - 2]?.id;
    if (!id) return;
    look({ by: "b" });
    if (viewer.view.other !== id) await compare(id);
  }

  async function compareFile(file) {
    const { viewer: opened } = get();
    let source;
    try {
      source = await openFile(file);
    } catch (error) {
      set(withViewer(get(), { refused: `${file.name}: ${error.message}` }));  // not `problem`, which goes when pixels of the job come
      return;
    }
    if (get().viewer?.id !== opened.id) return;
    sources.b?.close();
    sources.b = source;
    change({ b: source, file: file.name, refused: null, view: { ...get().viewer.view, other: null } });
    refreshFigures();
  }

  /** The values under the pointer, and their standard error: of whatever came last, if several are under way. */
  async function point(pixel) {
    const mine = ++newest.point;
    const { a, b, view } = get().viewer;
    if (!pixel || !a) {
      set(withViewer(get(), { probe: pixel && { pixel } }));
      return;
    }
    const of = (source, name) => (source?.layer(name).name === name ? source.pixel(source.layer(name), ...pixel).catch(() => null) : null);
    const errors = { rgb: "stderr", mix: "mix.stderr" };
    const [values, error, samples, second] = await Promise.all([of(a, view.layer), errors[view.layer] ? of(a, errors[view.layer]) : null, of(a, "spp"), of(b, view.layer)]);
    if (mine === newest.point && get().viewer) set(withViewer(get(), { probe: { pixel, layer: view.layer, values, error, samples: samples?.[0], second } }));
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
    const mine = ++newest.figures;
    const { a, b, view } = get().viewer ?? {};
    if (!view?.region || !a) return;
    const figures = await regionFigures(a, b, view.region, a.layer(view.layer).name === "mix" ? ["mix", "mix.stderr"] : ["rgb", "stderr"]).catch(() => null);
    if (mine === newest.figures && get().viewer?.view.region === view.region) set(withViewer(get(), { figures }));
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

  function toggleHistogram() {
    set(withViewer(get(), { histogram: !get().viewer.histogram }));
    survey();
  }

  /** What the window of the viewer shows, as a PNG. */
  function savePicture(name) {
    document.querySelector("float-view")?.picture.toBlob((blob) => {
      const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
    });
  }

  function command(key) {
    const { view, a } = get().viewer;
    const by = key === key.toLowerCase() ? 1 : -1;
    const what = kLetters[key.toLowerCase()];
    if (what === "exposure") look({ exposure: Math.min(kMostExposure, Math.max(-kMostExposure, view.exposure + by * kExposureStep)) });
    else if (what === "falseColour") look({ falseColour: !view.falseColour });
    else if (what === "curve") look({ curve: next(curvesOf(get().displays).map(([name]) => name), curveOf(view.curve, get().displays), by) });
    else if (what === "overlay") look({ overlay: next(kOverlays.map(([name]) => name), view.overlay, by) });
    else if (what === "layer" && a) look({ layer: next(a.layers.map((layer) => layer.name), view.layer, by) });
    else if (what === "channel" && a) look({ channel: next([null, 0, 1, 2].slice(0, 1 + a.layer(view.layer).channels.length), view.channel, by) });
    else if (key === "h") toggleHistogram();
    else if (/^[1-9]$/.test(key) && a) showPicture(Number(key));
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
        set(withViewer(get(), { view: { ...view, layer: view.layer ?? (before.a ? before.plain : null) } }));
        probeAgain();
        survey();
        if (String(view.mix) !== String(before.view.mix)) remix();
        needCube();
        if (view.other !== before.view.other) compare(view.other);
        return;
      }
      closeSources();
      set({ ...get(), viewer: { id, view, a: null, b: null, plain: "rgb", report: null, cube: null, survey: null, histogram: false, file: null, others: null, tool: "pan", probe: null, figures: null, flip: null, problem: null, refused: null, changed: 0, mixing: null, mixError: null, mixWaits: false, mixRefused: null } });
      openJob("a", id);
      needCube();
      // if this fails, the viewer says so for the layers
      snapshot(`job ${id}`, () => api.job(id), (now, job) => (now.viewer?.id === id ? withJob(now, job) : now)).catch(() => {});
      // if this fails, only jobs that are known already are offered
      api.list("sort=-submitted&limit=200").then(({ jobs }) => set(withViewer(get(), { others: jobs })), () => {});
      if (view.other) openJob("b", view.other);
    },
    closeViewer: () => {
      closeSources();
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
      if (type === null || (type === "tile" && data.job === viewer.id && data.state === "folded")) mixing?.touched();
    },
    look,
    point,
    pick,
    frame,
    command,
    focus,
    compare,
    compareFile,
    toggleHistogram,
    savePicture,
    flipped: (flip) => set(withViewer(get(), { flip })),
    setTool: (tool) => set(withViewer(get(), { tool })),
  };
}

/** Jobs whose pictures have the size of the first, the newest first. */
export function comparable(state, viewer) {
  const same = (job) => job.id !== viewer.id && !job.frames && job.size?.[0] === viewer.a.size[0] && job.size?.[1] === viewer.a.size[1];
  return [...(viewer.others ?? state.jobs?.values() ?? [])].filter(same).sort((p, q) => q.submitted_unix - p.submitted_unix);
}

/** The name of an identifier in the manifest of its layer; without one its eight hexadecimal digits. */
export function nameOf(layer, bits) {
  const hex = bits.toString(16).padStart(8, "0");
  return Object.entries(layer.names ?? {}).find(([, id]) => id === hex)?.[0] ?? hex;
}

/** The identifiers of names. */
export const identifiersOf = (layer, names) => new Set(names.map((name) => parseInt(layer.names?.[name] ?? name, 16)).filter((id) => id > 0));

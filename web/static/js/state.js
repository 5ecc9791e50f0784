// The state of the page as one value, and its changes: pure functions (state, event) -> state.

import { kOnlyPlain } from "./api.js";
import { kWholeList } from "./job_list.js";
import { kAllWorkers } from "./worker_list.js";

const kFlashes = 48; // most recently folded tiles that are highlighted
export const kPalette = 10; // number of worker colours in css/tokens.css

export function initialState() {
  return {
    session: "unknown", // also "in", "out"
    me: { role: "read", user: "" }, // the role with the fewest rights, until the role is known
    link: "connecting", // also "live", "lost"
    displays: kOnlyPlain, // how colours can be shown: {default, views}
    route: { view: "jobs", id: null, frame: null },
    // a page of the list of jobs; ids: null until it is known; doing: how far what is done to the selected jobs is
    list: { asked: kWholeList, ids: null, total: 0, states: {}, owners: [], picked: new Set(), doing: null },
    jobs: null, // Map id -> job JSON; of frames only the one that is shown; null: not known yet
    announced: [], // jobs that will be submitted once files are complete, see api.js
    workers: null, // Map id -> worker JSON
    join: null, // how further workers join: {address, tls, token_file}
    workerLog: null, // of the worker whose log is open: {id, text}; text is null until it is there
    workerList: kAllWorkers,
    colours: new Map(), // worker name -> index into the palette, in order of appearance
    open: null, // the state of the job that is open, see openJob()
    viewer: null, // the state of the viewer, see viewer_actions.js
    submit: emptySubmission(),
    narrow: false, // true if the page is as narrow as a phone
    ui: { confirming: null, busy: null, notice: null, again: null, renaming: null, signInError: null, signingIn: false, link: null },
  };
}

export const emptySubmission = () => ({
  files: [], // items: {path, file}
  main: null, // path of the scene file
  plan: null, // the plan made by bundle.js
  phase: "choose", // also "hashing", "sending", "refused"
  progress: 0,
  step: "",
  error: null, // {message, diagnostics}
  settings: { name: "", spp: "", target_error: "", time: "", width: "", height: "", frames: "", denoise: false, aov: "", priority: "", seed: "", tags: "" },
});

export const openJob = (id, shown = id) => ({
  id,
  shown, // the job whose image and numbers are shown: the open job, or for a sequence one of its frames
  report: null,
  tiles: new Map(), // tile -> {rect, spp, workers} of the tiles being rendered
  flashes: [], // {key, rect, worker} of recently folded tiles
  folds: 0, // number of folds: a change means that the image has changed
  exposure: 0,
  display: null, // the view in which colours are shown; null: the coordinator's default
  showTiles: true,
  layer: null, // "picture", "denoised", or as a map over the image "error", "samples"; null: the best picture there is
  clock: "seconds", // axis of the plot; or "core_seconds"
  picked: null, // point of the plot under the pointer
  log: null, // of the job that is shown, while its log is open: {text}, null until it is there
  problem: null, // why the job cannot be shown
  film: null, // {id, playing} while frames of a sequence are scrubbed or played: the frame that is seen
  fps: 24, // pictures per second of what is played, and of a video
  video: null, // what the coordinator says of the sequence's video
});

/** The layer that is shown of a job: the one that was chosen, or the denoised picture of a job that is done and has one. */
export const layerOf = ({ layer, report }, job) => layer ?? (job?.denoise && job.state === "done" && !report?.denoised?.error ? "denoised" : "picture");

/** The view in which colours are shown. */
export const displayOf = ({ open, displays }) => open.display ?? displays.default;

/** What the coordinator would not take from this token anyway is not offered. */
export const mayChange = (state) => state.me.role === "admin" || state.me.role === "submit";
export const seesOthers = (state) => state.me.role !== "submit";
export const ownerOf = (job) => job.owner || "admin";

export const withUi = (state, ui) => ({ ...state, ui: { ...state.ui, ...ui } });
export const withOpen = (state, open) => (state.open ? { ...state, open: { ...state.open, ...open } } : state);
export const withList = (state, list) => ({ ...state, list: { ...state.list, ...list } });
/** A page of the list, as the coordinator answers. */
export const withListed = (state, { jobs, total, states, owners }) => withList(withJobs(state, jobs), { ids: jobs.map((job) => job.id), total, states, owners });
export const withViewer = (state, viewer) => (state.viewer ? { ...state, viewer: { ...state.viewer, ...viewer } } : state);
export const withSubmit = (state, submit) => ({ ...state, submit: { ...state.submit, ...submit } });

/** A list has no frames, nor which frames a sequence has: what the open page knows of them stays. */
export function withJobs(state, jobs) {
  const next = new Map(jobs.map((job) => [job.id, withFrames(job, state.jobs?.get(job.id))]));
  // The jobs that are shown need not be in the list
  for (const id of [state.open?.id, state.open?.shown, state.viewer?.id]) {
    if (!next.has(id) && state.jobs?.has(id)) next.set(id, state.jobs.get(id));
  }
  return { ...state, jobs: next };
}

const withFrames = (job, before) => (job.frames && !job.frames.list && before?.frames?.list ? { ...job, frames: { ...job.frames, list: before.frames.list } } : job);

export function withWorkers(state, workers) {
  const names = workers.map((worker) => worker.name).sort();
  return { ...state, workers: new Map(workers.map((worker) => [worker.id, worker])), colours: coloured(state.colours, names) };
}

export function withTiles(state, tiles) {
  if (!state.open) return state;
  const flying = tiles.filter((tile) => tile.workers.length > 0);
  const next = withOpen(state, { tiles: new Map(flying.map((tile) => [tile.tile, tile])) });
  return { ...next, colours: coloured(state.colours, flying.flatMap((tile) => tile.workers)) };
}

function coloured(colours, names) {
  const fresh = names.filter((name) => !colours.has(name));
  if (fresh.length === 0) return colours;
  const next = new Map(colours);
  for (const name of fresh) if (!next.has(name)) next.set(name, next.size % kPalette);
  return next;
}

/** An event of the stream. */
export function withEvent(state, type, data) {
  if (type === "job") return withJob(state, data);
  if (type === "worker") return withWorker(state, data);
  if (type === "tile" && state.open?.shown === data.job) return withTile(state, data);
  return state;
}

export function withJob(state, job) {
  if (job.state === "removed" || job.state === "moved") return withoutJob(state, job.id);
  const jobs = new Map(state.jobs ?? []);
  const sequence = job.sequence ? jobs.get(job.sequence) : null;
  if (sequence?.frames?.list) {
    const list = sequence.frames.list.map((frame) => (frame.id === job.id ? { ...frame, ...sharedFigures(job) } : frame));
    jobs.set(sequence.id, { ...sequence, frames: { ...sequence.frames, list } });
  }
  if (!job.sequence || state.open?.shown === job.id || state.viewer?.id === job.id) jobs.set(job.id, withFrames(job, jobs.get(job.id)));
  const next = { ...state, jobs };
  const over = state.open?.shown === job.id && isOver(job);
  return over ? withOpen(next, { tiles: new Map(), folds: state.open.folds + 1 }) : next;
}

/** A job that somebody removed takes its frames along; a page that shows it says so. */
export function withoutJob(state, id) {
  const jobs = new Map([...(state.jobs ?? [])].filter(([key, job]) => key !== id && job.sequence !== id));
  const next = { ...state, jobs };
  return state.open?.id === id ? withOpen(next, { problem: "Somebody has removed this job, with its image and report.", tiles: new Map() }) : next;
}

const sharedFigures = ({ state, progress, spp_done, relmse, error }) => ({ state, progress, spp_done, relmse, error });

/** The id of the job that the page of `id` shows: of a sequence the frame that was chosen, or that is being rendered. */
export function shownOf(state, id, frame) {
  const frames = state.jobs?.get(id)?.frames;
  const wanted = frame ?? frames?.current;
  return frames?.list?.find((one) => one.frame === wanted)?.id ?? id;
}

function withWorker(state, worker) {
  const workers = new Map(state.workers ?? []);
  if (worker.state === "gone") workers.delete(worker.id);
  else workers.set(worker.id, worker);
  return { ...state, workers, colours: worker.name ? coloured(state.colours, [worker.name]) : state.colours };
}

function withTile(state, { tile, rect, state: what, spp, worker: id }) {
  const open = state.open;
  const worker = state.workers?.get(id)?.name ?? id; // events contain a worker's id, lists its name
  const tiles = new Map(open.tiles);
  const before = tiles.get(tile);
  const others = (before?.workers ?? []).filter((name) => name !== worker);
  const workers = what === "leased" && worker ? [...others, worker] : worker ? others : [];
  if (workers.length > 0) tiles.set(tile, { tile, rect, spp, workers });
  else tiles.delete(tile);
  const change = { tiles };
  if (what === "folded") {
    change.folds = open.folds + 1;
    change.flashes = [...open.flashes, { key: open.folds, rect, worker }].slice(-kFlashes);
  }
  return { ...withOpen(state, change), colours: worker ? coloured(state.colours, [worker]) : state.colours };
}

// ---- what views ask ----

/** The frames of a sequence that are done, in order. */
export const doneFrames = (job) => (job?.frames?.list ?? []).filter((frame) => frame.state === "done");

const kOver = new Set(["done", "failed", "cancelled"]);
export const isOver = (job) => kOver.has(job.state);
/** A job that waits for other jobs is held; one that only waits for a worker is not. */
export const isHeld = (job) => job.state === "queued" && job.after?.length > 0;
export const colourOf = (state, worker) => state.colours.get(worker) ?? 0;

/** Those of the page that is seen; without a page all: running first, then waiting, then what is over; the newest first within each. */
export function jobsInOrder(state) {
  if (state.list.ids) return state.list.ids.map((id) => state.jobs.get(id)).filter(Boolean);
  const rank = { running: 0, paused: 1, queued: 2 };
  return [...(state.jobs?.values() ?? [])].filter((job) => !job.sequence).sort(
    (a, b) => (rank[a.state] ?? 3) - (rank[b.state] ?? 3) || b.submitted_unix - a.submitted_unix || (a.id < b.id ? -1 : 1));
}

/** What is wrong with the numbers of a job: {key, text, place, replay} for each cause; nothing if all is well. */
export function healthComplaints(job) {
  return (job.health?.causes ?? []).map(({ cause, text, first, frame, replay }) => ({ key: cause, text, place: placeOf(first?.[0], frame), replay: replay ?? null }));
}

function placeOf(spot, frame) {
  if (!spot) return null;
  return `first ${frame === null || frame === undefined ? "" : `in frame ${frame} `}at pixel ${spot.pixel.join(",")}, sample ${spot.sample.toLocaleString("en")}`;
}

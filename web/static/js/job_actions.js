// What the user can do with a job and its page.
import { kOnlyPlain } from "./api.js";
import { frameHref } from "./route.js";
import { displayOf, doneFrames, layerOf, withJob, withOpen, withUi, withoutJob } from "./state.js";

const kVideoPauseMs = 1000;
const kNearEnd = 8; // pixels: a log that is scrolled to its end, but for these, stays at its end

export function makeJobActions({ get, set, attempt, api, snapshot, showRoute }) {
  async function change(id, wanted) {
    set(withUi(get(), { busy: id, confirming: null }));
    const changed = await attempt(() => api.setState(id, wanted));
    if (changed) await snapshot(`job ${id}`, () => attempt(() => api.job(id)), withJob);
    set(withUi(get(), { busy: null }));
  }

  /** Tells whether the job has been changed. */
  async function alter(id, changes) {
    let changed;
    set(withUi(get(), { busy: id, confirming: null, notice: null }));
    await snapshot(`job ${id}`, async () => (changed = await attempt(() => api.change(id, changes))), withJob);
    set(withUi(get(), { busy: null }));
    return changed !== undefined;
  }

  function closeRename() {
    set(withUi(get(), { renaming: null }));
    requestAnimationFrame(() => document.getElementById("rename")?.focus());
  }

  async function remove(id) {
    set(withUi(get(), { busy: id, confirming: null }));
    const gone = await attempt(async () => (await api.remove(id), true));
    set(withUi(get(), { busy: null }));
    if (!gone) return;
    set(withoutJob(get(), id));
    window.location.hash = "#/jobs";
  }

  /** That a job is not there any more is told by its event. */
  function unlessGone(error) {
    if (error.status !== 404) throw error;
  }

  /** Who looks at the end of the log goes on to see its end. */
  async function readLog(id) {
    // Those of another page, which this one has not replaced yet, do not count.
    const lines = () => document.querySelector(get().route.view === "log" ? ".log-page pre" : ".job-log:not(.log-page) pre");
    let before = null; // where the reader is, if that is the end
    await snapshot(`log ${id}`, () => attempt(() => api.log(id).catch(unlessGone)), (now, text) => {
      if (now.open?.shown !== id || now.open.log === null) return now;
      const seen = lines();
      const top = seen?.scrollTop ?? 0;
      if (!seen || seen.scrollHeight - top - seen.clientHeight < kNearEnd) before = top;
      return withOpen(now, { log: { text } });
    });
    const { open } = get();
    if (open?.shown === id && open.log && open.log.text === null) set(withOpen(get(), { log: { text: null, failed: true } }));
    if (before === null) return;
    requestAnimationFrame(() => {
      const drawn = lines();
      if (drawn?.scrollTop === before) drawn.scrollTo({ top: drawn.scrollHeight, behavior: "instant" }); // else the reader has moved meanwhile
      if (get().route.view === "log" && document.activeElement === document.body) drawn?.focus({ preventScroll: true }); // keys scroll it
    });
  }

  const shownLayer = () => layerOf(get().open, get().jobs?.get(get().open.shown));

  const film = (more) => set(withOpen(get(), { film: more }));

  /** The frame that is seen becomes the one that the page shows; the address says so without a new step in its history. */
  function settleFilm() {
    const { open, jobs } = get();
    const frame = open?.film && jobs.get(open.id)?.frames?.list?.find((one) => one.id === open.film.id);
    if (frame) turnTo(frameHref(open.id, frame.frame));
  }

  /** The page shows the frame at once: the event of the address comes later, and would end a film that the user has started meanwhile. */
  function turnTo(href) {
    if (window.location.hash === href) film(null);
    else {
      window.location.replace(href);
      showRoute();
    }
  }

  function playFilm() {
    const { open, jobs } = get();
    if (open.film?.playing) return settleFilm();
    const done = doneFrames(jobs.get(open.id));
    const from = done.find((frame) => frame.id === (open.film?.id ?? open.shown)) ?? done[0];
    return film({ id: from.id, playing: true });
  }

  /** Asks for the video again and again until it is made, as long as the page of its sequence is open. */
  async function watchVideo(id, answer) {
    const video = await answer.catch((error) => ({ state: "failed", error: error.message }));
    if (!video || get().open?.id !== id) return;
    set(withOpen(get(), { video }));
    if (video.state === "waiting" || video.state === "making") setTimeout(() => (get().open?.id === id ? watchVideo(id, api.video(id)) : null), kVideoPauseMs);
  }

  /** A view that cannot be shown gives way to the curve of sRGB. */
  function withoutView(error) {
    if (error.status === 400 && get().open && displayOf(get()) !== kOnlyPlain.default) set(withUi(withOpen(get(), { display: kOnlyPlain.default }), { notice: error.message }));
    throw error;
  }

  const pictureOf = (id, exposure, signal) => {
    const layer = shownLayer();
    return layer === "picture" || layer === "denoised" ? api.image(id, exposure, layer, displayOf(get()), signal).catch(withoutView) : api.map(id, layer, signal);
  };

  return {
    playFilm,
    settleFilm,
    scrubFilm: (id) => film({ id, playing: false }),
    turnFilm: (id) => (get().open?.film?.playing ? film({ id, playing: true }) : null),
    setFps: (fps) => set(withOpen(get(), { fps })),
    /** Shows the frame before (by: -1) or after the one that is shown by now. */
    stepFrame: (by) => {
      const { open, jobs } = get();
      const list = jobs.get(open?.id)?.frames?.list ?? [];
      const next = list[Math.max(0, list.findIndex(({ id }) => id === (open.film?.id ?? open.shown))) + by];
      if (next) turnTo(frameHref(open.id, next.frame));
    },
    filmPicture: (id, signal) => pictureOf(id, get().open.exposure, signal),
    /** Of a sequence that was opened: there may be a video already, or one is being made. */
    openVideo: (id) => watchVideo(id, api.video(id).catch(() => null)),
    makeVideo: (id) => {
      const { exposure, fps } = get().open;
      const layer = shownLayer();
      return watchVideo(id, api.makeVideo(id, { exposure, fps, view: displayOf(get()), ...(layer === "denoised" ? { layer } : {}) }));
    },
    setState: change,
    openLog: (id) => {
      set(withOpen(get(), { log: { text: null } }));
      return readLog(id);
    },
    readLog,
    closeLog: () => set(withOpen(get(), { log: null })),
    renderOn: alter,
    setPriority: (id, priority) => alter(id, { priority }),
    openRename: (id) => {
      set(withUi(get(), { renaming: id }));
      requestAnimationFrame(() => document.getElementById("new-name")?.select());
    },
    closeRename,
    rename: async (id, name) => {
      if (await alter(id, { name })) closeRename();
    },
    remove,
    cancel: (id) => change(id, "cancelled"),
    confirm: (id) => set(withUi(get(), { confirming: id })),
    image: (exposure, signal) => pictureOf(get().open.shown, exposure, signal),
    setLayer: (layer) => set(withOpen(get(), { layer })),
    setClock: (clock) => set(withOpen(get(), { clock, picked: null })),
    onExposure: (event) => set(withOpen(get(), { exposure: Number(event.currentTarget.value) })),
    setDisplay: (display) => set(withOpen(get(), { display })),
    resetExposure: () => set(withOpen(get(), { exposure: 0 })),
    toggleTiles: () => set(withOpen(get(), { showTiles: !get().open.showTiles })),
    pickPoint: (wanted) => {
      if (!get().open) return;
      const picked = typeof wanted === "function" ? wanted(get().open.picked) : wanted;
      if (get().open.picked !== picked) set(withOpen(get(), { picked }));
    },
  };
}

// Connects the parts of the page: the state, the actions that change it, the routes, the event stream.
import "./film.js";
import "./live_image.js";
import "./viewer/float_view.js";
import { api } from "./api.js";
import { patch } from "./dom.js";
import { openEvents } from "./events.js";
import { kOfJob, routeOf, takeToken } from "./route.js";
import { makeAgainActions } from "./again_actions.js";
import { makeJobActions } from "./job_actions.js";
import { listOf } from "./job_list.js";
import { makeListActions } from "./list_actions.js";
import { makeSubmitActions } from "./submit_actions.js";
import { makeWorkerActions } from "./worker_actions.js";
import { workersOf } from "./worker_list.js";
import { makeViewerActions } from "./viewer_actions.js";
import { jobName } from "./format.js";
import { askFirst, opened, tryLink } from "./session.js";
import { initialState, isHeld, openJob, shownOf, withEvent, withJob, withList, withListed, withOpen, withTiles, withUi, withWorkers, withoutJob } from "./state.js";
import { page } from "./views/shell.js";

const kReportPauseMs = 2000;
const kListPauseMs = 50;
const kEnded = "Your session has ended: its time is up, or its token was revoked. Sign in again.";
const kPhone = "(max-width: 40rem)";

let state = initialState();
let drawing = false;
let closeEvents = null;
let reportTimer = 0;
let sessions = 0; // number of the present one: what an earlier one was refused does not end it

function set(next) {
  state = next;
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(draw);
}

function draw() {
  drawing = false;
  patch(document.getElementById("app"), ...page(state, actions));
  const job = kOfJob.has(state.route.view) ? state.jobs?.get(state.route.id) : null;
  document.title = state.session === "out" ? "Lightshaft" : `${job ? `${state.route.view === "log" ? "Log of " : ""}${jobName(job)}` : { workers: "Workers", submit: "New job" }[state.route.view] ?? "Jobs"} · Lightshaft`;
}

/** Runs a request; a lost session leads to the sign-in view, any other failure to a notice. Returns undefined then. */
async function attempt(request) {
  const mine = sessions;
  try {
    return await request();
  } catch (error) {
    if (error.status === 401) refusedIn(mine);
    else set(withUi(state, { notice: error.message }));
    return undefined;
  }
}

// ---- session ----

function refusedIn(session) {
  if (session === sessions) signedOut();
}

async function start() {
  const { token, link, first } = opened;
  const route = routeOf(window.location.hash);
  set({ ...state, route, workerList: workersOf(route.view === "workers" ? route.query : "") });
  if (token) await followLink(token, link, first);
  else await enter(first);
}

/**
 * A link with a token signs in at once where nobody is signed in. Where somebody is, another user's link only
 * asks: anybody can write such a link, and who follows it would go on as somebody else without noticing.
 */
async function followLink(token, link = tryLink(token), first = undefined) {
  const { me: now, signing } = await link;
  if (!now) {
    await (signing ? signIn(signing, first) : enter(first));
    return;
  }
  const then = await api.whoIs(token).catch(() => null);
  await enter(first);
  if (!then) set(withUi(state, { notice: "The token of this link is not known here. You are still signed in as before." }));
  else if (then.role !== now.role || then.user !== now.user) set(withUi(state, { link: { token, ...then } }));
}

/** `signing`: what the coordinator answers to a token. `first`: askFirst() after it. */
async function signIn(signing, first) {
  set(withUi(state, { signingIn: true, signInError: null }));
  try {
    await signing;
    const problem = await enter(first);
    if (problem) {
      signedOut(problem.status === 401
        ? "The token is right, but the browser keeps no session: allow cookies for this page."
        : `The token is right, but the jobs can’t be shown: ${problem.message} Try again.`);
    }
  } catch (error) {
    signedOut(error.status === 401 || error.status === 403 ? "This token is not known here." : error.message);
  }
  set(withUi(state, { signingIn: false }));
}

/** Shows the farm. Returns the error if that is not possible. `first`: askFirst(), if that was asked before. */
async function enter(first) {
  let page;
  let me;
  let displays;
  const asked = state.route.view === "jobs" ? listOf(state.route.query) : state.list.asked;
  try {
    [page, me, displays] = await (first ?? askFirst(asked));
  } catch (error) {
    if (error.status === 401) signedOut();
    else if (state.session === "unknown") {
      set(withUi(state, { notice: error.message }));
      setTimeout(enter, kReportPauseMs);
    }
    return error;
  }
  sessions += 1;
  set(withUi({ ...withListed(withList(state, { asked }), page), me, displays, session: "in" }, { signInError: null, notice: null }));
  closeEvents ??= openEvents({ onOpen, onLost, onEvent });
  showRoute();
  return null;
}

/** message: why; without one, that a session that was open has ended. Several requests can find that out: the message stays. */
function signedOut(message = state.session === "in" ? kEnded : state.ui.signInError) {
  closeEvents?.();
  closeEvents = null;
  set(withUi({ ...initialState(), narrow: state.narrow, route: state.route, session: "out" }, { signInError: message }));
}

// ---- events ----

const recordings = new Set();
const newest = new Map(); // for each kind of request, the number of the latest one whose answer is shown
let asked = 0;

/**
 * Puts a fetched list or job under the events that came meanwhile: its answer may be older than they are. Of two
 * requests for the same, the later one holds: answers overtake each other on their way.
 */
async function snapshot(what, fetch, apply) {
  const number = ++asked;
  const events = [];
  recordings.add(events);
  try {
    const answer = await fetch();
    if (answer === undefined || number < (newest.get(what) ?? 0)) return;
    newest.set(what, number);
    set(events.reduce((next, [type, data]) => withEvent(next, type, data), apply(state, answer)));
  } finally {
    recordings.delete(events);
  }
}

async function onOpen() {
  set({ ...state, link: "live" });
  await Promise.all([
    actions.refreshList(),
    snapshot("workers", () => attempt(api.workers), (now, { workers, join = null }) => ({ ...withWorkers(now, workers), join }))]);
  actions.refreshAnnounced(); // after what is seen first
  actions.viewerEvent(null);
  await refreshOpen();
}

function onLost(closed) {
  set({ ...state, link: "lost" });
  // an event stream cannot say why it failed, so another request finds out
  const mine = sessions;
  if (closed) api.workers().catch((error) => (error.status === 401 ? refusedIn(mine) : null));
}

function onEvent(type, data) {
  for (const events of recordings) events.push([type, data]);
  const before = type === "job" ? state.jobs?.get(data.id) : null;
  set(withEvent(state, type, data));
  // The coordinator decides which jobs are listed, and in which order; events only change the numbers in the
  // list.
  if (type === "job" && !data.sequence && (before?.state !== data.state || isHeld(before) !== isHeld(data))) actions.refreshList(kListPauseMs);
  actions.viewerEvent(type, data);
  if (type === "job" && data.id === state.open?.id) showFrame();
  if (type === "job" && data.id === state.open?.shown && !reportTimer) {
    reportTimer = setTimeout(refreshReport, kReportPauseMs);
  }
}

async function refreshReport() {
  reportTimer = 0;
  const id = state.open?.shown;
  if (id && state.open.log !== null) actions.readLog(id);
  if (!id || state.route.view !== "job" || state.jobs?.get(id)?.frames) return; // a sequence whose frames are not known yet
  // there is no report before the first checkpoint
  await snapshot(`report ${id}`, () => api.report(id).catch(() => undefined), (now, report) => (now.open?.shown === id ? withOpen(now, { report }) : now));
}

async function refreshOpen() {
  const id = state.open?.id;
  if (!id) return;
  const mine = sessions;
  try {
    await snapshot(`job ${id}`, () => api.job(id), (now, job) => (now.open?.id === id ? withJob(now, job) : now));
    if (state.open?.id !== id || !state.jobs.has(id)) return; // the job was removed or closed meanwhile
    set(withOpen(state, { problem: null }));
    if (!showFrame()) await refreshShown();
  } catch (error) {
    openFailed(error, mine);
  }
}

function openFailed(error, session) {
  if (error.status === 401) refusedIn(session);
  else if (error.status === 404 && state.jobs?.has(state.open?.id)) set(withoutJob(state, state.open.id));
  // a removed job has its own message
  else if (error.status !== 404 || !state.open?.problem) set(withOpen(state, { problem: error.message }));
}

/** The log is open from the first on its own page alone. */
const logAt = (route) => (route.view === "log" ? { text: null } : null);

/** The image, tiles and figures of the frame that the page is to show. True if that is another one than before. */
function showFrame() {
  const { open, route } = state;
  const shown = open && (route.view === "log" ? open.id : shownOf(state, open.id, route.frame));
  if (!open || open.shown === shown) return false;
  const { exposure, display, showTiles, layer, clock, film, fps, video } = open;
  set({ ...state, open: { ...openJob(open.id, shown), exposure, display, showTiles, layer, clock, film, fps, video, log: logAt(route) } });
  const mine = sessions;
  refreshShown().catch((error) => openFailed(error, mine));
  return true;
}

async function refreshShown() {
  const { id, shown } = state.open;
  if (state.route.view === "log") return refreshReport();
  const job = state.jobs?.get(shown);
  const fetch = () => Promise.all([job && shown === id ? job : api.job(shown), api.tiles(shown)]);
  await snapshot("shown", fetch, (now, [fresh, tiles]) => {
    if (now.open?.shown !== shown) return now;
    const next = withTiles(withJob(now, fresh), tiles);
    return withOpen(next, { folds: next.open.folds + 1, problem: null });
  });
  await refreshReport();
}

// ---- the window ----

const phone = window.matchMedia(kPhone);
phone.addEventListener("change", () => set({ ...state, narrow: phone.matches }));
state = { ...state, narrow: phone.matches };

// ---- routes ----

function showRoute() {
  const route = routeOf(window.location.hash);
  const moved = route.view !== state.route.view || route.id !== state.route.id;
  const turned = !moved && route.frame !== state.route.frame;
  const opens = route.view === "job" || route.view === "log";
  const same = opens && state.open?.id === route.id && state.open;
  const open = !opens ? null : same && !moved ? same : { ...(same || openJob(route.id)), log: logAt(route) };
  const fresh = open && open !== state.open;
  set(withUi({ ...state, route, open }, moved ? { confirming: null, notice: null, again: null, renaming: null } : {}));
  if (moved) window.scrollTo(0, 0);
  if (route.view === "jobs" && state.session === "in") actions.openList(route.query);
  if (route.view === "workers") actions.openWorkers(route.query);
  if (route.view !== "view") actions.closeViewer();
  else if (state.session === "in") actions.openViewer(route);
  if (fresh && state.session === "in") refreshOpen().then(() => (route.view === "job" && state.jobs?.get(route.id)?.frames ? actions.openVideo(route.id) : null));
  else if (turned) {
    set(withOpen(state, { film: null }));
    showFrame();
  }
}
window.addEventListener("hashchange", () => {
  const token = takeToken(window.location, window.history);
  if (token) followLink(token);
  else showRoute();
});

// ---- files dropped on the page ----

const dragsFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
const marked = (over) => document.documentElement.classList.toggle("dragging", over);
document.addEventListener("dragover", (event) => {
  if (!dragsFiles(event)) return;
  event.preventDefault();
  marked(true);
});
document.addEventListener("dragleave", (event) => (event.relatedTarget ? null : marked(false)));
document.addEventListener("drop", (event) => {
  if (!dragsFiles(event)) return;
  event.preventDefault();
  marked(false);
  if (state.session === "in") actions.takeDrop(event);
});

// ---- actions ----

const seam = { get: () => state, set, attempt, api, snapshot, showRoute, compareFile: (file) => actions.compareFile(file) };
const actions = {
  signIn: (token) => signIn(api.signIn(token)),
  takeLink: () => {
    const { token } = state.ui.link;
    closeEvents?.(); // it shows what the session before may see
    closeEvents = null;
    set({ ...initialState(), narrow: state.narrow, route: state.route });
    return signIn(api.signIn(token));
  },
  leaveLink: () => set(withUi(state, { link: null })),
  signOut: async () => {
    await attempt(api.signOut);
    signedOut(null);
  },
  dismiss: () => set(withUi(state, { notice: null })),
  ...makeJobActions(seam),
  ...makeListActions(seam),
  ...makeAgainActions(seam),
  ...makeWorkerActions(seam),
  ...makeSubmitActions(seam),
  ...makeViewerActions(seam),
};

start();

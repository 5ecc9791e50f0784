// The states of the page that the storybook shows, by name. They are made by the same functions as on the
// live page.
import * as data from "./data.js";
import { kPlain } from "../js/viewer/address.js";
import { MixedSource, makeMixing } from "../js/viewer/mixing.js";
import { h } from "../js/dom.js";
import { numbers } from "./numbers.js";
import { kWholeList } from "../js/job_list.js";
import { initialState, openJob, withEvent, withJobs, withList, withListed, withOpen, withSubmit, withTiles, withUi, withWorkers } from "../js/state.js";

const signedIn = (route = { view: "jobs", id: null, frame: null }) => ({ ...initialState(), me: { role: "admin", user: "" }, session: "in", link: "live", route });
const farm = (route) => withWorkers(withJobs(signedIn(route), data.jobs), data.workers);

function jobPage(id, more = {}, jobs = data.jobs) {
  const state = withWorkers(withJobs(signedIn({ view: "job", id, frame: null }), jobs), data.workers);
  return withOpen({ ...state, open: openJob(id) }, { report: data.report, ...more });
}

function rendering() {
  const state = withTiles(jobPage("j-7f3a91c2"), data.tiles);
  return withEvent(withEvent(state, "tile", data.foldedTile(101, "lab-02")), "tile", data.foldedTile(102, "lab-01"));
}

function viewing(view, more = {}) {
  const id = "j-91d2c3f4";
  const state = farm({ view: "view", id, frame: null });
  return { ...state, viewer: { id, view: { ...kPlain, ...view }, a: numbers(0.05), b: null, file: null, tool: "pan", probe: null, figures: null, flip: null, problem: null, changed: 0, ...more } };
}

function mixing(mix) {
  const source = new MixedSource(numbers(0.05, true));
  source.mix(mix);
  const error = { relmse: 0.00231, relmse_ci95: [0.0021, 0.00254], trusted: true, verdict: "trusted" };
  const state = viewing({ layer: "mix", mix }, { a: source, mixError: error });
  const nothing = () => {};
  state.viewer.mixing = makeMixing({ h, layers: source.layers, get: () => state.viewer, show: nothing, look: nothing, settled: nothing, job: { exr: () => "#" } });
  return state;
}

const file = (path, bytes) => ({ path, file: { name: path.split("/").pop(), size: bytes } });
const kFiles = [file("bath/bath.xml", 6120), file("bath/meshes/tub.obj", 812400), file("bath/steam.vdb", 61.4 * 2 ** 20), file("bath/notes.txt", 900)];
const kPlan = {
  main: kFiles[0].file, missing: [], unused: ["bath/notes.txt"],
  assets: [{ name: "meshes/tub.obj", file: kFiles[1].file }, { name: "steam.vdb", file: kFiles[2].file }],
};
const submitting = (more) => withSubmit(farm({ view: "submit", id: null }), { files: kFiles, main: "bath/bath.xml", plan: kPlan, ...more });

const kMarkup = "<img src=x onerror=\"document.title='stolen'\"><b>bold</b>";
function hostile(view) {
  const nasty = { ...data.jobs[0], id: "j-1\"><script>", name: kMarkup, error: kMarkup, warnings: [kMarkup], state: "failed" };
  const workers = [{ ...data.workers[0], name: kMarkup, activity: kMarkup, tags: [kMarkup], job: "j\" onclick=\"x" }];
  const state = withWorkers(withJobs(signedIn({ view, id: nasty.id }), [nasty]), workers);
  return withSubmit({ ...state, open: openJob(nasty.id) }, { error: { message: kMarkup, diagnostics: [{ ...data.diagnostics[0], text: kMarkup, source_line: kMarkup, file: kMarkup }] } });
}

export const stories = {
  signin: () => ({ ...initialState(), session: "out" }),
  "signin-refused": () => withUi({ ...initialState(), session: "out" }, { signInError: "This token is not known here." }),
  "jobs-empty": () => withWorkers(withJobs(signedIn(), []), []),
  jobs: () => farm(),
  "jobs-confirm": () => withUi(farm(), { confirming: "j-7f3a91c2" }),
  "jobs-page": () => withListed(withList(withWorkers(signedIn(), data.workers), { asked: { ...kWholeList, states: ["running", "done"], page: 2 }, picked: new Set(["j-7f3a91c2", "j-91d2c3f4"]) }),
    { jobs: data.jobs, total: 3214, states: { running: 12, queued: 80, held: 9, paused: 1, done: 3080, failed: 30, cancelled: 11 }, owners: ["", "anna", "bert"] }),
  "jobs-lost": () => withUi({ ...farm(), link: "lost" }, { notice: "The coordinator does not answer. Is it still running, and is this machine on its network?" }),
  job: rendering,
  "job-reference": () => withTiles(jobPage("j-7f3a91c2", { report: data.compared }, [data.comparedJob]), data.tiles),
  "job-map": () => withTiles(jobPage("j-7f3a91c2", { layer: "error", clock: "core_seconds" }), data.tiles),
  "job-removed": () => withEvent(jobPage("j-7f3a91c2"), "job", { id: "j-7f3a91c2", state: "removed" }),
  "job-sequence": () => jobPage(data.sequence.id, { shown: data.frame.id }, [data.sequence, data.frame]),
  "job-untrusted": () => jobPage("j-a04be6d1", { report: data.untrustedReport }),
  "job-stopped": () => jobPage("j-0a4417bb"),
  "job-queued": () => jobPage("j-5be0d7aa", { report: null }),
  "job-done": () => jobPage("j-91d2c3f4"),
  "job-failed": () => jobPage("j-c6e8b510", { report: null }),
  "job-unhealthy": () => withTiles(jobPage("j-7f3a91c2", { report: data.doubtful }, [data.unhealthy]), data.tiles),
  "job-log": () => {
    const state = jobPage("j-7f3a91c2", { log: { text: data.log } });
    return { ...state, route: { ...state.route, view: "log" } };
  },
  "job-unknown": () => ({ ...farm({ view: "job", id: "nope" }), open: { ...openJob("nope"), problem: "There is no job \"nope\"." } }),
  viewer: () => viewing({ region: [300, 250, 420, 330] }, {
    probe: { pixel: [233, 120], layer: "rgb", values: [0.7341, 0.5512, 0.3305], error: [0.0184, 0.0138, 0.0083], samples: 512 },
    figures: { level: 0, mean: [0.2113, 0.1672, 0.1104], error: [0.0004, 0.0003, 0.0002], relmse: null } }),
  "viewer-compare": () => viewing({ other: "j-0a4417bb", by: "wipe", split: 0.45, exposure: 1 }, { b: numbers(0.7) }),
  "viewer-error": () => viewing({ layer: "error" }),
  "viewer-mix": () => mixing(["lamp*g-1*k3200*v*vg1.5", "sky*c0.3_0.6_1"]),
  "viewer-objects": () => viewing({ layer: "crypto_object", matte: ["lamp"] }),
  workers: () => farm({ view: "workers", id: null }),
  "workers-empty": () => withWorkers(withJobs(signedIn({ view: "workers", id: null }), []), []),
  submit: () => farm({ view: "submit", id: null }),
  "submit-ready": () => submitting({}),
  "submit-missing": () => submitting({ plan: { ...kPlan, missing: ["textures/tiles.png"] } }),
  "submit-sending": () => submitting({ phase: "sending", step: "Sending steam.vdb", progress: 0.37 }),
  "submit-refused": () => submitting({ phase: "refused", error: { message: "The scene was refused.", diagnostics: data.diagnostics } }),
  "hostile-jobs": () => hostile("jobs"),
  "hostile-job": () => hostile("job"),
  "hostile-workers": () => hostile("workers"),
  "hostile-submit": () => hostile("submit"),
};

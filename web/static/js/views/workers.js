// The list of workers, and how to add one.
import { h } from "../dom.js";
import { colourOf, mayChange, seesOthers } from "../state.js";
import { bytes, count, duration, jobName, plural } from "../format.js";
import { frameOf, jobHref } from "../route.js";
import { safeClass, workerMark } from "./pieces.js";

const kSearchFrom = 8; // workers from which there is a field to search them

/** Columns: name, what they are ordered by, and whether the first press puts the largest first. */
const kColumns = [
  ["Worker", (worker) => worker.name], ["Doing", (worker) => worker.activity ?? ""], ["Threads", (worker) => worker.threads, true], ["Done", (worker) => worker.units_done, true],
  ["CPU time", (worker) => worker.cpu_seconds, true], ["Memory", (worker) => worker.rss_bytes ?? 0, true], ["Last seen", (worker) => worker.last_seen_seconds, true], ["Class", (worker) => worker.numeric_class ?? ""]];

export function workersView(state, actions) {
  if (state.workers === null) return h("p", { class: "waiting", key: "waiting" }, "Fetching the workers …");
  const workers = [...state.workers.values()];
  if (workers.length === 0) return noWorkers(state);
  const threads = workers.filter(alive).reduce((sum, worker) => sum + (worker.threads || 0), 0);
  const shown = ordered(workers.filter((worker) => matches(state, worker)), state.workerList);
  return h("section", { key: "workers", class: "workers" },
    h("div", { class: "heading" }, h("h1", null, "Workers"), h("p", { class: "sub" }, `${plural(workers.length, "worker")} · ${plural(threads, "thread")} connected`)),
    classesApart(workers),
    narrowing(state, workers, actions),
    shown.length === 0 ? h("p", { key: "nothing", class: "waiting" }, "No worker matches.") : h("table", { key: "list", class: "list worker-list" },
      h("thead", null, h("tr", null, kColumns.map((column) => head(column, state.workerList, actions)), mayDrain(state) ? h("th", { key: "actions", scope: "col" }, h("span", { class: "unseen" }, "Actions")) : null)),
      h("tbody", null, shown.flatMap((worker) => [row(state, worker, actions), logRow(state, worker)]))),
    mayChange(state) ? h("details", { key: "add", class: "panel add-worker" }, h("summary", null, "Add a worker"), howToJoin(state)) : null);
}

const leaving = (worker) => worker.state === "draining" || worker.state === "restarting";
const alive = (worker) => worker.state === "connected" || leaving(worker);
const present = (worker) => alive(worker) || worker.state === "sick";
/** Workers serve everybody: only an admin sends them away. */
const mayDrain = (state) => state.me.role === "admin";

/** The fields by which fewer workers are shown: of many workers, or of workers with tags. */
function narrowing({ workerList: { search, tag } }, workers, actions) {
  const tags = [...new Set(workers.flatMap((worker) => worker.tags ?? []).concat(tag || []))].sort();
  if (workers.length < kSearchFrom && !search && tags.length === 0) return null;
  return h("search", { key: "search", class: "list-tools" },
    h("input", { id: "worker-search", type: "search", placeholder: "Search: all words in name, tags, doing", "aria-label": "Search workers; all words must be there", ".value": search, oninput: (event) => actions.searchWorkers(event.currentTarget.value) }),
    tags.length === 0 ? null : h("span", { key: "tag", class: "list-tool" }, h("label", { for: "worker-tag" }, "Tag"),
      h("select", { id: "worker-tag", onchange: (event) => actions.chooseTag(event.currentTarget.value) }, ["", ...tags].map((one) => h("option", { key: one, value: one, selected: one === tag, ".selected": one === tag }, one || "any")))));
}

function matches({ workerList }, worker) {
  if (workerList.tag && !worker.tags?.includes(workerList.tag)) return false;
  const text = [worker.name, worker.id, worker.state, worker.activity, worker.numeric_class, worker.platform, ...(worker.tags ?? [])].join("\n").toLowerCase();
  return workerList.search.toLowerCase().split(/\s+/).every((word) => text.includes(word));
}

function ordered(workers, { sort, descending }) {
  const [, value] = kColumns.find(([name]) => name === sort) ?? kColumns[0];
  const compare = (p, q) => (typeof p === "number" || typeof q === "number" ? (p ?? 0) - (q ?? 0) : String(p).localeCompare(String(q), "en", { numeric: true }));
  return workers.sort((p, q) => (descending ? -1 : 1) * compare(value(p), value(q)) || compare(p.name, q.name) || compare(p.id, q.id));
}

function head([name, , largest = false], { sort, descending }, actions) {
  const way = sort === name ? (descending ? "descending" : "ascending") : null;
  return h("th", { key: name, scope: "col", "aria-sort": way }, h("button", { type: "button", class: "sort", onclick: () => actions.sortWorkers(name, largest) }, name, h("i", { "aria-hidden": "true" }, way ? (descending ? " ↓" : " ↑") : "")));
}

/** A job stays within one numeric class, so it matters to know when there are several. */
function classesApart(workers) {
  const classes = new Set(workers.filter(alive).map((worker) => worker.numeric_class).filter(Boolean));
  return classes.size > 1
    ? h("p", { key: "classes", class: "notice mild" }, `The processors or builds of these workers round numbers in ${classes.size} different ways (numeric classes). A job is rendered by workers of one class, that of the first that took it, so that the same job always gives the same pixels; workers of the other classes take other jobs.`)
    : null;
}

function row(state, worker, actions) {
  const frame = frameOf(worker.job);
  const job = state.jobs?.get(frame ? frame.sequence : worker.job);
  const name = job ? jobName(job) + (frame ? `, frame ${frame.frame}` : "") : worker.job;
  const cell = (label, text) => h("td", { key: label, class: "number", "data-label": label }, text);
  return h("tr", { key: worker.id, class: `worker is-${safeClass(worker.state)}`, "data-worker": worker.id },
    h("td", { class: "name" },
      h("b", null, workerMark(colourOf(state, worker.name), worker.name)), worker.state === "connected" ? null : h("span", { key: "state", class: "pill" }, worker.state),
      worker.fake === true ? h("span", { key: "fake", class: "pill", title: "It invents pixels instead of rendering, for tests" }, "fake") : null,
      worker.tags?.length ? h("p", { class: "tags" }, worker.tags.map((tag) => h("span", { key: tag, class: "tag" }, tag))) : null),
    h("td", { class: "doing" }, present(worker) ? worker.activity || "idle" : "not connected", worker.job ? [" · ", h("a", { key: "job", href: jobHref(worker.job) }, name)] : null,
      seesOthers(state) ? h("button", { key: "log", type: "button", class: "small quiet open-log", "aria-label": `Log: ${worker.name}`, "aria-expanded": String(state.workerLog?.id === worker.id), onclick: () => actions.showWorkerLog(worker.id) }, "Log") : null),
    cell("Threads", count(worker.threads)),
    cell("Done", count(worker.units_done)),
    cell("CPU time", duration(worker.cpu_seconds)),
    cell("Memory", bytes(worker.rss_bytes)),
    cell("Last seen", alive(worker) && worker.last_seen_seconds < 5 ? "now" : `${duration(worker.last_seen_seconds)} ago`),
    cell("Class", h("code", { title: worker.platform || null }, String(worker.numeric_class ?? "–").slice(0, 8))),
    mayDrain(state) ? h("td", { key: "acts", class: "acts" }, drain(state, worker, actions)) : null);
}

/** What happened to a worker, the latest last, below its row. */
const logRow = ({ workerLog, me }, worker) => (workerLog?.id !== worker.id ? null : h("tr", { key: `log ${worker.id}`, class: "worker-log" },
  h("td", { colspan: kColumns.length + (me.role === "admin" ? 1 : 0) },
    workerLog.text === null ? h("p", { key: "waiting", class: "help" }, "Fetching the log …") : h("pre", { key: "lines", tabindex: 0, "aria-label": `Log of ${worker.name}` }, workerLog.text || "Nothing has happened yet."))));

/** A drain asks once more: once the worker has ended, it can't be taken back. A worker that restarts comes back by itself. */
function drain(state, worker, actions) {
  if (!present(worker)) return null;
  const busy = state.ui.busy === `worker ${worker.id}`;
  const button = (key, label, onclick, className) => h("button", { key, type: "button", class: `small ${className}`, disabled: busy, "aria-label": `${label}: ${worker.name}`, onclick }, label);
  if (leaving(worker)) return button("stay", "Keep after all", () => actions.setWorkerState(worker.id, "connected"), "quiet");
  if (state.ui.confirming !== `worker ${worker.id}`) {
    return h("span", { key: "acts", class: "actions" },
      alive(worker) ? button("drain", "Drain", () => actions.confirm(`worker ${worker.id}`), "quiet") : null,
      button("restart", "Restart", () => actions.setWorkerState(worker.id, "restarting"), "quiet"));
  }
  return h("span", { key: "sure", class: "actions" },
    button("yes", "Really finish and end", () => actions.setWorkerState(worker.id, "draining"), "danger"), button("no", "Keep", () => actions.confirm(null), "quiet"));
}

const kEverywhere = new Set(["0.0.0.0", "[::]", "*"]);
const isLoopback = (host) => /^(127\.|localhost$|\[::1\]$)/.test(host);

const kHost = "HOST"; // in place of a name that this page does not know

function addressOf(join) {
  const [, host, port] = /^(.*):(\d+)$/.exec(join?.address ?? "") ?? [null, "0.0.0.0", "50051"];
  return { host, port };
}

/** The command that starts a worker, for the address at which this coordinator takes them. `page`: the host at which the page was opened; a loopback one means another machine elsewhere. */
export function joinCommand(join, page) {
  const { host, port } = addressOf(join);
  const place = !kEverywhere.has(host) ? host : isLoopback(page) ? kHost : page;
  const files = join?.tls ? " --tls-ca ca.pem --tls-cert worker.pem --tls-key worker.key" : "";
  return `lightshaft-worker --coordinator ${place}:${port}${files} --token-file join-token`;
}

const code = (text) => h("code", { key: text }, text);

/** `lightshaft up` takes workers of its own machine alone; with --lan it always has TLS. */
function shortWay(join) {
  const { host, port } = addressOf(join);
  const line = ["prints the line for other machines, which brings all that they need: ", code("lightshaft join HOST --code CODE"), "."];
  if (isLoopback(host)) return h("p", { key: "short" }, "This coordinator takes workers of its own machine alone. Start it as ", code("lightshaft up --lan"), " instead, and it ", ...line, " One that was started without ", code("lightshaft up"), " needs ", code(`--grpc 0.0.0.0:${port}`), ", and a firewall that lets the port through.");
  return join?.tls ? h("p", { key: "short" }, code("lightshaft up --lan"), " ", ...line) : null;
}

function howToJoin({ join }) {
  const short = shortWay(join);
  const command = joinCommand(join, globalThis.location?.hostname || kHost);
  return [
    short,
    h("p", { key: "how" }, `${short ? "Without that line, start" : "Start"} one on ${isLoopback(addressOf(join).host) ? "the coordinator’s machine" : "any machine that reaches this coordinator"}. It renders on all its cores, and may come and go at any time:`),
    h("pre", { key: "command", tabindex: 0 }, command),
    h("p", { key: "token", class: "help" },
      command.includes(kHost) ? [code(kHost), " is the name or address of the coordinator's machine. "] : null,
      "The file ", code("join-token"), " is a copy of ", h("code", { key: "file" }, join?.token_file ?? "join-token"), join?.token_file ? " of the coordinator's machine" : " in the coordinator's data folder",
      join?.tls ? ["; ", code("ca.pem"), ", ", code("worker.pem"), " and ", code("worker.key"), " are copies of those in the folder ", code("tls"), " beside it, or of your own authority."] : ".",
      " The worker must be of the same version as the coordinator.")];
}

const noWorkers = (state) => h("section", { key: "empty", class: "empty" }, h("h1", null, "No worker is connected"), howToJoin(state));

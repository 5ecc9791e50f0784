// The list of workers.
import { h } from "../dom.js";
import { colourOf } from "../state.js";
import { bytes, count, duration, jobName, plural } from "../format.js";
import { frameOf, jobHref } from "../route.js";
import { safeClass, workerMark } from "./pieces.js";

export function workersView(state) {
  if (state.workers === null) return h("p", { class: "waiting", key: "waiting" }, "Fetching the workers …");
  const workers = [...state.workers.values()].sort((a, b) => a.name.localeCompare(b.name, "en", { numeric: true }));
  if (workers.length === 0) return noWorkers();
  const threads = workers.filter(alive).reduce((sum, worker) => sum + (worker.threads || 0), 0);
  return h("section", { key: "workers", class: "workers" },
    h("div", { class: "heading" }, h("h1", null, "Workers"), h("p", { class: "sub" }, `${plural(workers.length, "worker")} · ${plural(threads, "thread")} connected`)),
    classesApart(workers),
    h("ul", { class: "cards" }, workers.map((worker) => card(state, worker))));
}

const alive = (worker) => worker.state === "connected" || worker.state === "draining";

/** A job stays within one numeric class, so it matters to know when there are several. */
function classesApart(workers) {
  const classes = new Set(workers.filter(alive).map((worker) => worker.numeric_class).filter(Boolean));
  return classes.size > 1
    ? h("p", { key: "classes", class: "notice mild" }, `These workers are of ${classes.size} numeric classes (another processor or build rounds differently). A job is rendered by the class that took it first, so that its pixels are reproducible.`)
    : null;
}

function card(state, worker) {
  const frame = frameOf(worker.job);
  const job = state.jobs?.get(frame ? frame.sequence : worker.job);
  const name = job ? jobName(job) + (frame ? `, frame ${frame.frame}` : "") : worker.job;
  return h("li", { key: worker.id, class: `panel worker is-${safeClass(worker.state)}`, "data-worker": worker.id },
    h("h2", null, workerMark(colourOf(state, worker.name), worker.name), worker.state === "connected" ? null : h("span", { key: "state", class: "pill" }, worker.state),
      worker.fake === true ? h("span", { key: "fake", class: "pill", title: "It makes pixels up instead of rendering, for tests" }, "fake") : null),
    h("p", { class: "doing" }, alive(worker) ? worker.activity || "idle" : "not connected", worker.job ? [" · ", h("a", { key: "job", href: jobHref(worker.job) }, name)] : null),
    h("dl", null,
      pair("Threads", count(worker.threads)),
      pair("Units done", count(worker.units_done)),
      pair("CPU time", duration(worker.cpu_seconds)),
      pair("Memory", bytes(worker.rss_bytes)),
      pair("Last seen", alive(worker) && worker.last_seen_seconds < 5 ? "now" : `${duration(worker.last_seen_seconds)} ago`),
      pair("Class", h("code", { title: worker.platform || null }, String(worker.numeric_class ?? "–").slice(0, 8)))),
    worker.tags?.length ? h("p", { class: "tags" }, worker.tags.map((tag) => h("span", { key: tag, class: "tag" }, tag))) : null);
}

const pair = (name, value) => h("div", { key: name }, h("dt", null, name), h("dd", { class: "number" }, value));

function noWorkers() {
  const host = globalThis.location?.hostname || "COORDINATOR";
  return h("section", { key: "empty", class: "empty" },
    h("h1", null, "No worker is connected"),
    h("p", null, "Start one on any machine that reaches this coordinator. It renders on all its cores, and may come and go at any time:"),
    h("pre", null, `lightshaft-worker --coordinator ${host}:50051`),
    h("p", { class: "help" }, "It asks for the join token, which the coordinator keeps in its data folder."));
}

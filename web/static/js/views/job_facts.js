// What a job is made of: who submitted it, and with which settings.
import { h } from "../dom.js";
import { isOver, mayChange, ownerOf } from "../state.js";
import { count, kAbsent, moment } from "../format.js";
import { jobHref } from "../route.js";
import { stateWord } from "./pieces.js";

export function jobFacts(state, job, actions) {
  const report = state.open.report ?? {};
  const waits = Array.isArray(job.after) ? job.after : [];
  return h("section", { key: "settings", class: "panel job-facts" }, h("h2", null, "Settings"), h("dl", null,
    row("Submitted", `${moment(job.submitted_unix)} by ${ownerOf(job)}`),
    job.size ? row("Size", `${job.size[0]} × ${job.size[1]}, tiles of ${job.tile}`) : null,
    row("Integrator", integrator(report)),
    row("Seed", typeof report.seed === "number" ? String(report.seed) : kAbsent),
    row("Denoised", job.denoise ? "yes" : "no"),
    waits.length ? row("After", waits.map(({ id, state: now }, i) => [i ? ", " : null, h("a", { key: id, href: jobHref(id) }, id), now ? ` (${stateWord({ state: now })})` : " (removed)"])) : null,
    job.max_workers ? row("Workers at most", count(job.max_workers)) : null,
    priority(state, job, actions)));
}

/** Absent until the first report. */
function integrator({ integrator: name, max_depth: depth }) {
  if (!name) return kAbsent;
  return depth === undefined ? name : `${name}, ${depth < 0 ? "any depth" : `depth ${depth}`}`;
}

const row = (name, value) => h("div", { key: name }, h("dt", null, name), h("dd", null, value));

function priority(state, job, actions) {
  if (isOver(job) || !mayChange(state)) return row("Priority", String(job.priority ?? 0));
  const set = (event) => (event.currentTarget.value !== "" && event.currentTarget.validity.valid ? actions.setPriority(job.id, Number(event.currentTarget.value)) : null);
  return h("div", { key: "priority" }, h("dt", null, h("label", { for: "priority" }, "Priority")),
    h("dd", null, h("input", { id: "priority", type: "number", step: 1, min: -1000000, max: 1000000, ".value": String(job.priority ?? 0), onchange: set }), h("small", null, "higher comes first")));
}

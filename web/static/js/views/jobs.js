// The list of all jobs.
import { h } from "../dom.js";
import { isNarrowed, kAges, kFilters, kPageSize, kSorts, kStates } from "../job_list.js";
import { isHeld, isOver, jobsInOrder, mayChange, ownerOf, seesOthers } from "../state.js";
import { count, duration, figure, jobName, kAbsent, moment, percent, plural, spp } from "../format.js";
import { causeFirst } from "../failure.js";
import { atLeast, doubtWord, doubtful } from "../verdict.js";
import { jobActions, progressBar, safeClass, statePill, stateWord } from "./pieces.js";

export function jobsView(state, actions) {
  if (state.jobs === null) return h("p", { class: "waiting", key: "waiting" }, "Fetching the jobs …");
  const jobs = jobsInOrder(state);
  const { list } = state;
  const none = list.ids ? list.total === 0 && !isNarrowed(list.asked) : jobs.length === 0;
  if (none && jobs.length === 0 && state.announced.length > 0) return h("section", { key: "jobs", class: "jobs" }, h("div", { class: "heading" }, h("h1", null, "Jobs")), announcedJobs(state));
  if (none && jobs.length === 0) return mayChange(state) ? firstSteps() : h("section", { key: "empty", class: "empty" }, h("h1", null, "Nothing is rendering yet"), h("p", null, "Your token lets you look; jobs are submitted with another one."));
  return h("section", { key: "jobs", class: "jobs" },
    h("div", { class: "heading" }, h("h1", null, "Jobs"), h("p", { class: "sub" }, tally(state, jobs)), mayChange(state) ? h("a", { class: "button primary", href: "#/submit" }, "New job") : null),
    announcedJobs(state),
    narrowing(state, actions),
    mayChange(state) ? picked(state, jobs, actions) : null,
    jobs.length === 0 ? h("p", { key: "nothing", class: "waiting" }, "No job is like this.") : h("table", { key: "list", class: "list" },
      h("thead", null, h("tr", null,
        h("th", { key: "pick", scope: "col" }, mayChange(state) ? h("input", { type: "checkbox", "aria-label": "All jobs of this page", ".checked": jobs.every((job) => list.picked.has(job.id)), onchange: (event) => actions.pickPage(event.currentTarget.checked) }) : h("span", { class: "unseen" }, "Picture")),
        kColumns.filter(([name]) => name !== "Owner" || seesOthers(state)).map(([name, first]) => head(name, first, list, actions)), h("th", { key: "actions", scope: "col" }, h("span", { class: "unseen" }, "Actions")))),
      h("tbody", null, jobs.map((job) => row(state, job, actions)))),
    pager(list, actions));
}

/** Jobs that `lightshaft submit` will submit once files on its machine are complete. */
function announcedJobs(state) {
  if (state.announced.length === 0) return null;
  return h("section", { key: "announced", class: "panel announced" }, h("h2", null, "Waiting for files"),
    h("ul", null, state.announced.map((one) => h("li", { key: one.id },
      h("b", null, one.name), one.frames ? ` · frames ${one.frames}` : null, seesOthers(state) ? ` · ${ownerOf(one)}` : null,
      h("small", null, `needs ${one.files[0]}${one.count > 1 ? ` and ${plural(one.count - 1, "other file")}` : ""}${one.machine ? `, on ${one.machine}` : ""} · since ${moment(one.since_unix)}`)))));
}

/** Columns, and the order after the first press on their heads. */
const kColumns = [["Scene", "name"], ["Owner", "owner"], ["State", "state"], ["Progress", "-progress"], ["Samples"], ["relMSE", "relmse"], ["Time left"]];

function head(name, first, { asked }, actions) {
  if (!first) return h("th", { scope: "col", key: name }, name);
  const way = asked.sort.replace(/^-/, "") !== first.replace(/^-/, "") ? null : asked.sort.startsWith("-") ? "descending" : "ascending";
  return h("th", { scope: "col", key: name, "aria-sort": way }, h("button", { type: "button", class: "sort", onclick: () => actions.sortBy(first) }, name, h("i", { "aria-hidden": "true" }, way ? (way === "ascending" ? " ↑" : " ↓") : "")));
}

/** How many jobs there are in which states: of all that this token may see. */
function tally(state, jobs) {
  const counts = state.list.ids ? state.list.states : {};
  const n = (name) => (state.list.ids ? counts[name] ?? 0 : jobs.filter((job) => (name === "held" ? isHeld(job) : job.state === name)).length);
  const all = kStates.reduce((sum, name) => sum + n(name), 0);
  const parts = [["running", "rendering"], ["queued", "waiting"], ["paused", "paused"], ["failed", "failed"]].map(([name, word]) => (n(name) ? `${count(n(name))} ${word}${name === "queued" && n("held") ? ` (${count(n("held"))} held)` : ""}` : null));
  return [plural(all, "job"), ...parts].filter(Boolean).join(" · ");
}

function narrowing(state, actions) {
  const { asked, owners, states } = state.list;
  const select = (id, label, options, chosen, onChoose) => h("span", { key: id, class: "list-tool" }, h("label", { for: `list-${id}` }, label),
    h("select", { id: `list-${id}`, onchange: (event) => onChoose(event.currentTarget.value) }, options.map(([value, text]) => h("option", { key: value, value, selected: value === chosen, ".selected": value === chosen }, text))));
  return h("search", { key: "narrow", class: "list-tools" },
    h("input", { key: "search", id: "list-search", type: "search", placeholder: "Search: all words in name or id", "aria-label": "Search names and ids; all words must be there", ".value": asked.search, oninput: actions.typeSearch }),
    h("fieldset", { key: "states", class: "choice many" }, h("legend", { class: "unseen" }, "States"), kFilters.map((name) => h("label", { key: name, title: name === "held" ? "They wait for other jobs, and are counted among those that wait, too" : null },
      h("input", { type: "checkbox", name: "state", value: name, ".checked": asked.states.includes(name), onchange: () => actions.toggleState(name) }),
      h("span", null, stateWord({ state: name }), states[name] ? h("i", { class: "of" }, ` ${count(states[name])}`) : null)))),
    seesOthers(state) && (owners.length > 1 || asked.owner !== null) ? select("owner", "Owner", [["*", "everybody"], ...owners.map((owner) => [`=${owner}`, ownerOf({ owner })])], asked.owner === null ? "*" : `=${asked.owner}`, (value) => actions.narrow({ owner: value === "*" ? null : value.slice(1) })) : null,
    select("days", "Submitted", kAges, asked.days, (days) => actions.narrow({ days })),
    select("sort", "Order", kSorts, asked.sort, (sort) => actions.narrow({ sort })));
}

/** What can be done to all jobs that are selected. */
function picked(state, jobs, actions) {
  const n = state.list.picked.size;
  const busy = state.ui.busy === "picked";
  const { total } = state.list;
  const everything = total > n && jobs.every((job) => state.list.picked.has(job.id));
  const confirming = state.ui.confirming;
  const asks = confirming === "cancel picked" ? ["Really cancel", actions.cancelPicked] : confirming === "remove picked" ? ["Really remove, with images", actions.removePicked] : null;
  const button = (key, label, onclick, className = "quiet") => h("button", { key, type: "button", class: `small ${className}`, disabled: busy, onclick }, label);
  // an empty element keeps its space, so that rows do not move
  if (n === 0) return h("div", { key: "picked", class: "list-picked none" }, jobs.length > 1 ? "Select jobs to change several at once; with Shift, all from the one selected before." : null);
  return h("div", { key: "picked", class: "list-picked", role: "status" },
    h("b", null, `${plural(n, "job")} selected`),
    state.list.doing ? h("span", { key: "doing", class: "dim number" }, state.list.doing) : null,
    asks ? [button("yes", asks[0], asks[1], "danger"), button("no", "Keep", () => actions.confirm(null))]
      : [button("cancel", "Cancel", () => actions.confirm("cancel picked")), button("remove", "Remove", () => actions.confirm("remove picked")),
        button("pause", "Pause", actions.pausePicked), button("resume", "Resume", actions.resumePicked), priorityOfPicked(busy, actions)],
    everything ? button("all", `Select all ${count(total)} that match`, actions.pickAll) : null,
    button("none", "Select none", () => actions.pickPage(false)));
}

const priorityOfPicked = (busy, actions) => h("form", { key: "priority", class: "list-tool", onsubmit: (event) => {
  event.preventDefault();
  actions.setPriorityOfPicked(Number(new FormData(event.currentTarget).get("priority")));
} },
h("label", { for: "picked-priority" }, "Priority"), h("input", { id: "picked-priority", name: "priority", type: "number", required: true, step: 1, min: -1000000, max: 1000000, disabled: busy }), h("button", { type: "submit", class: "small quiet", disabled: busy }, "Set"));

function pager({ ids, total, asked: { page } }, actions) {
  if (!ids || (total <= kPageSize && page === 0)) return null;
  const last = Math.max(0, Math.ceil(total / kPageSize) - 1);
  const button = (label, to, off) => h("button", { key: label, type: "button", class: "small", disabled: off, onclick: () => actions.turnPage(to) }, label);
  return h("nav", { key: "pager", class: "pager", "aria-label": "Pages" },
    button("First", 0, page === 0), button("Previous", page - 1, page === 0),
    h("span", { class: "number dim" }, `${count(Math.min(total, page * kPageSize + 1))} – ${count(Math.min(total, page * kPageSize + ids.length))} of ${count(total)}`),
    button("Next", page + 1, page >= last), button("Last", last, page >= last));
}

/** A small picture; again when a twentieth more of the job is there. */
const thumbnail = (state, job, actions) => h("live-image", {
  key: "picture", class: "thumbnail", role: "presentation",
  ".source": job.units_done > 0 ? actions.thumbnail(job.frames?.current !== undefined && job.frames ? `${job.id}-frame${job.frames.current}` : job.id) : null, ".version": `${job.state} ${Math.floor(20 * job.progress)}`,
});

function row(state, job, actions) {
  return h("tr", { key: job.id, class: `is-${safeClass(job.state)}`, "data-job": job.id },
    h("td", { class: "pick" },
      mayChange(state) ? h("input", { key: "pick", type: "checkbox", "aria-label": `Select ${jobName(job)}, ${job.id}`, ".checked": state.list.picked.has(job.id), onclick: (event) => actions.pickJob(job.id, event.shiftKey) }) : null,
      thumbnail(state, job, actions)),
    h("td", { class: "name" },
      h("a", { href: `#/jobs/${encodeURIComponent(job.id)}` }, jobName(job)),
      h("small", null, job.frames ? `${count(job.frames.done)} of ${count(job.frames.total)} frames · ` : null, job.size ? `${job.size[0]} × ${job.size[1]}` : null, " · ", moment(job.submitted_unix)),
      reason(job)),
    seesOthers(state) ? h("td", { key: "owner", class: "owner", "data-label": "Owner" }, ownerOf(job)) : null,
    h("td", { "data-label": "State" }, statePill(job)),
    h("td", { class: "progress" }, progressBar(job.progress, `${jobName(job)}, ${stateWord(job)}`, `in-${safeClass(job.state)}`), h("span", { class: "number" }, percent(job.progress))),
    h("td", { class: "number", "data-label": "Samples" }, spp(job.spp_done), job.spp_asked === null ? goal(job) : h("span", { key: "of", class: "of" }, ` / ${count(job.spp)}`)),
    figureCell("relMSE", figure(job.relmse), doubtful(job.verdict) ? h("small", { key: "doubt", class: "doubt" }, doubtWord(job.verdict)) : null),
    figureCell("Time left", duration(job.state === "running" ? job.eta_seconds : null), null, job.state === "running" && atLeast(job) ? h("small", { key: "least" }, "at least ") : null),
    h("td", { class: "acts" }, jobActions(state, job, actions)));
}

/** Why a job failed, or why it does not go on: as the coordinator says it, its first line. */
function reason(job) {
  const text = job.error || job.waits_for;
  if (typeof text !== "string" || !text || job.state === "done") return null;
  return h("small", { key: "reason", class: job.state === "failed" ? "reason bad" : "reason", title: text }, causeFirst({ error: text, failure: job.failure }).cause.split("\n")[0]);
}

/** What ends a job whose samples nobody asked for. */
const goal = (job) => (isOver(job) ? null : h("small", { key: "goal" }, job.target_error > 0 ? "until the target" : "until its time is up"));

const figureCell = (label, text, after = null, before = null) => h("td", { class: text === kAbsent ? "number absent" : "number", "data-label": label }, before, text, after);

function firstSteps() {
  const origin = globalThis.location?.origin ?? "http://localhost:8080";
  return h("section", { key: "empty", class: "empty" },
    h("h1", null, "Nothing is rendering yet"),
    h("p", null, "Drop a scene with its meshes and volumes anywhere on this page, choose it on ", h("a", { href: "#/submit" }, "New job"), ", or send it from a shell:"),
    h("pre", { tabindex: 0 },
      `curl -H "Authorization: Bearer $(cat DATA/token)" \\\n     -H "Content-Type: application/xml" \\\n     --data-binary @scene.xml \\\n     "${origin}/api/v1/jobs?spp=64"`),
    h("p", null, "A scene that names other files goes up with them by"),
    h("pre", { tabindex: 0 }, `lightshaft submit scene.xml --to ${origin} --wait -o image.exr`),
    h("p", { class: "help" }, "It then appears here, and its image fills in tile by tile."),
    h("a", { class: "button primary", href: "#/submit" }, "New job"));
}

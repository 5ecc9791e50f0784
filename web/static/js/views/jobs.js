// All jobs.
import { h } from "../dom.js";
import { isOver, jobsInOrder, mayChange, ownerOf, seesOthers } from "../state.js";
import { count, duration, figure, jobName, kAbsent, moment, percent, plural, spp } from "../format.js";
import { atLeast, doubtful, kDoubt } from "../verdict.js";
import { jobActions, progressBar, safeClass, statePill, stateWord } from "./pieces.js";

export function jobsView(state, actions) {
  if (state.jobs === null) return h("p", { class: "waiting", key: "waiting" }, "Fetching the jobs …");
  const jobs = jobsInOrder(state);
  if (jobs.length === 0) return mayChange(state) ? firstSteps() : h("section", { key: "empty", class: "empty" }, h("h1", null, "Nothing is rendering yet"), h("p", null, "Your token lets you look; jobs are handed in with another one."));
  return h("section", { key: "jobs", class: "jobs" },
    h("div", { class: "heading" }, h("h1", null, "Jobs"), h("p", { class: "sub" }, tally(jobs)), mayChange(state) ? h("a", { class: "button primary", href: "#/submit" }, "New job") : null),
    h("table", { class: "list" },
      h("thead", null, h("tr", null, ["Scene", seesOthers(state) ? "Owner" : null, "State", "Progress", "Samples", "relMSE", "Time left"].filter(Boolean).map((name) => h("th", { scope: "col", key: name }, name)), h("th", { key: "actions", scope: "col" }, h("span", { class: "unseen" }, "Actions")))),
      h("tbody", null, jobs.map((job) => row(state, job, actions)))));
}

function tally(jobs) {
  const n = (state) => jobs.filter((job) => job.state === state).length;
  const parts = [["running", "rendering"], ["queued", "waiting"], ["paused", "paused"], ["failed", "failed"]].map(([state, word]) => (n(state) ? `${n(state)} ${word}` : null));
  return [plural(jobs.length, "job"), ...parts].filter(Boolean).join(" · ");
}

function row(state, job, actions) {
  return h("tr", { key: job.id, class: `is-${safeClass(job.state)}`, "data-job": job.id },
    h("td", { class: "name" },
      h("a", { href: `#/jobs/${encodeURIComponent(job.id)}` }, jobName(job)),
      h("small", null, job.frames ? `${count(job.frames.done)} of ${count(job.frames.total)} frames · ` : null, job.size ? `${job.size[0]} × ${job.size[1]}` : null, " · ", moment(job.submitted_unix))),
    seesOthers(state) ? h("td", { key: "owner", class: "owner", "data-label": "Owner" }, ownerOf(job)) : null,
    h("td", { "data-label": "State" }, statePill(job)),
    h("td", { class: "progress" }, progressBar(job.progress, `${jobName(job)}, ${stateWord(job)}`, `in-${safeClass(job.state)}`), h("span", { class: "number" }, percent(job.progress))),
    h("td", { class: "number", "data-label": "Samples" }, spp(job.spp_done), job.spp_asked === null ? goal(job) : h("span", { key: "of", class: "of" }, ` / ${count(job.spp)}`)),
    figureCell("relMSE", figure(job.relmse), doubtful(job.verdict) ? h("small", { key: "doubt", class: "doubt" }, kDoubt) : null),
    figureCell("Time left", duration(job.state === "running" ? job.eta_seconds : null), null, job.state === "running" && atLeast(job) ? h("small", { key: "least" }, "at least ") : null),
    h("td", { class: "acts" }, jobActions(state, job, actions)));
}

/** What ends a job whose samples nobody asked for. */
const goal = (job) => (isOver(job) ? null : h("small", { key: "goal" }, job.target_error > 0 ? "until the target" : "until its time is up"));

const figureCell = (label, text, after = null, before = null) => h("td", { class: text === kAbsent ? "number absent" : "number", "data-label": label }, before, text, after);

function firstSteps() {
  const origin = globalThis.location?.origin ?? "http://localhost:8080";
  return h("section", { key: "empty", class: "empty" },
    h("h1", null, "Nothing is rendering yet"),
    h("p", null, "Hand in a Mitsuba scene: drop it with its meshes and volumes on the page ", h("a", { href: "#/submit" }, "New job"), ", or send it from a shell:"),
    h("pre", null,
      `curl -H "Authorization: Bearer $(cat DATA/token)" \\\n     -H "Content-Type: application/xml" \\\n     --data-binary @scene.xml \\\n     "${origin}/api/v1/jobs?spp=64"`),
    h("p", null, "A scene that names other files goes up with them by"),
    h("pre", null, `lightshaft submit scene.xml --to ${origin} --wait -o image.exr`),
    h("p", { class: "help" }, "It then appears here, and its image fills in tile by tile."),
    h("a", { class: "button primary", href: "#/submit" }, "New job"));
}

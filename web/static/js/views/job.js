// The page of one job: its image, the image's error, and the workers that render it.
import { h } from "../dom.js";
import { displayOf, healthComplaints, isOver, layerOf, mayChange, ownerOf, seesOthers } from "../state.js";
import { duration, jobName, moment, percent, plural } from "../format.js";
import { downloads } from "../api.js";
import { againButton, againForm } from "./again.js";
import { jobActions, notice, progressBar, statePill, stateWord, wholeNotice } from "./pieces.js";
import { imagePanel } from "./job_image.js";
import { meterPanel } from "./meters.js";
import { timeSplit } from "./time_split.js";
import { figures, inFlight } from "./job_figures.js";
import { goOn } from "./go_on.js";
import { jobFacts } from "./job_facts.js";
import { causeFirst } from "../failure.js";
import { framesStrip } from "./frames.js";
import { logAgain, logLines } from "./log.js";
import { logHref } from "../route.js";
import { errorPlot } from "./plot.js";
import { phrases } from "../phrases.js";
import { doubtWord, doubtful, timeLeft } from "../verdict.js";

const kStopped = { spp: phrases.stoppedSpp, error: phrases.stoppedError, time: phrases.stoppedTime, user: phrases.stoppedUser };
const whyStopped = (job) => (job.stopped === "error" && doubtful(job.verdict) ? `${phrases.stoppedError} by its own estimate: ${doubtWord(job.verdict)}` : kStopped[job.stopped]);

export function jobView(state, actions) {
  const job = state.jobs?.get(state.route.id);
  if (state.open?.problem && !job) return wholeNotice("bad", "This job can't be shown", h("p", null, state.open.problem), h("p", null, h("a", { href: "#/jobs" }, "All jobs")));
  if (!job || !state.open) return h("p", { class: "waiting", key: "waiting" }, "Fetching the job …");
  return h("article", { key: job.id, class: "job" },
    heading(state, job, actions),
    againForm(state, job, actions),
    job.error && job.state === "failed" ? h("div", { key: "error" }, notice("bad", phrases.failed, failure(job))) : null,
    alerts(job),
    framesStrip(state, job, actions),
    shownJob(state, state.jobs.get(state.open.shown), actions));
}

/** Image and figures: of the job itself, or of the frame that was chosen. */
function shownJob(state, job, actions) {
  if (!job || job.frames) return h("p", { class: "waiting", key: "frame" }, "Fetching the frame …");
  const started = job.state !== "failed" || job.units_done > 0; // of a job that failed at once there are no figures
  return [
    job.sequence && job.error ? h("div", { key: "frame-error" }, notice("bad", `Frame ${job.frame}`, failure(job))) : null,
    job.sequence ? h("div", { key: "frame-on", class: "frame-on" }, goOn(state, job, actions, `Frame ${job.frame}: ${sentence(job)}`)) : null,
    h("div", { key: "columns", class: "columns" },
      h("div", { class: "picture" }, job.meters > 0 ? meterPanel(state, job) : imagePanel(state, job, actions), started ? errorPlot(job, state.open, actions, state.narrow) : null, downloadLinks(job, state), logOf(job, state.open, actions)),
      h("div", { class: "facts" }, started ? figures(job, job.denoised ?? state.open.report?.denoised) : null, started ? timeSplit(job) : null, jobFacts(state, job, actions), inFlight(state, job))),
  ];
}

function heading(state, job, actions) {
  return h("div", { class: "job-head" },
    h("p", { class: "crumb" }, h("a", { href: "#/jobs" }, "Jobs"), " / ", h("code", null, job.id), seesOthers(state) ? h("span", { key: "owner", class: "owner" }, ` of ${ownerOf(job)}`) : null),
    h("div", { class: "heading" }, title(state, job, actions), statePill(job), againButton(state, job, actions), jobActions(state, job, actions, true)),
    progressBar(job.progress, `Progress of ${jobName(job)}`, `wide in-${job.state}`),
    // Screen readers announce it when it changes, unlike the numbers
    h("p", { class: "unseen", role: "status" }, stateWord(job)),
    goOn(state, job, actions, sentence(job)));
}

/** The name, and the means to change it. */
function title(state, job, actions) {
  if (state.ui.renaming !== job.id) {
    return [h("h1", { key: "name" }, jobName(job)),
      mayChange(state) ? h("button", { key: "rename", id: "rename", type: "button", class: "small quiet", "aria-label": `Rename: ${jobName(job)}`, onclick: () => actions.openRename(job.id) }, "Rename") : null];
  }
  const rename = (event) => {
    event.preventDefault();
    actions.rename(job.id, new FormData(event.currentTarget).get("name"));
  };
  return [h("h1", { key: "unseen", class: "unseen" }, jobName(job)),
    h("form", { key: "renaming", class: "rename", onsubmit: rename, onkeydown: (event) => (event.key === "Escape" ? actions.closeRename() : null) },
      h("input", { id: "new-name", name: "name", "aria-label": "New name", required: true, maxlength: 256, autocomplete: "off", value: job.name }),
      h("button", { type: "submit", class: "small", disabled: state.ui.busy === job.id }, "Rename"),
      h("button", { type: "button", class: "small quiet", onclick: () => actions.closeRename() }, "Keep the old name"))];
}

function sentence(job) {
  if (job.state === "done") return `Done after ${duration(job.elapsed_seconds)}: ${whyStopped(job) ?? "finished"}.`;
  if (job.state === "running") return `${percent(job.progress)} · ${job.eta_seconds === null ? "time left not known yet" : `${timeLeft(job)} left`} · submitted ${moment(job.submitted_unix)}`;
  if (job.state === "queued") return job.waits_for || "Waiting for a worker that may take it.";
  return `${stateWord(job)[0].toUpperCase()}${stateWord(job).slice(1)} at ${percent(job.progress)}, after ${duration(job.elapsed_seconds)}${isOver(job) && whyStopped(job) ? `: ${whyStopped(job)}` : ""}.`;
}

function alerts(job) {
  const complaints = healthComplaints(job);
  const warnings = job.warnings ?? [];
  return [
    job.error && job.state !== "failed" ? h("div", { key: "unwell" }, notice("bad", phrases.unwell, failure(job))) : null,
    job.fake === true ? h("p", { key: "fake", class: "notice warn" }, "Fake workers (--fake) make up the pixels of this job: it is no picture of the scene.") : null,
    job.few_hits > 0 ? h("p", { key: "few", class: "notice mild" }, `${plural(job.few_hits, "pixel")} ${job.few_hits === 1 ? "has" : "have"} too few samples that found light for the error to be known there: pink in the map of the error.`) : null,
    job.reference_same_seed === true ? h("p", { key: "seed", class: "notice mild" }, phrases.sameSeed) : null,
    complaints.length ? h("div", { key: "health" }, notice("warn", "The numbers of this image are not clean", h("ul", null, complaints.map(complaint)))) : null,
    warnings.length ? h("div", { key: "warnings" }, h("details", { class: "notice mild" }, h("summary", null, warnings.length === 1 ? "1 warning about the scene" : `${warnings.length} warnings about the scene`), h("pre", { tabindex: 0 }, warnings.join("\n")))) : null,
  ];
}

const complaint = ({ key, text, place, replay }) => h("li", { key },
  place ? `${text}; ${place}.` : `${text}.`,
  replay ? h("p", { key: "replay", class: "replay" }, "See it again: ", h("code", null, replay)) : null);

/** The cause, and below it where it happened. */
function failure(job) {
  const { cause, where } = causeFirst(job);
  return [h("pre", { key: "cause", tabindex: 0 }, cause), where ? h("p", { key: "where", class: "failure-where" }, where) : null];
}

/** What happened to the job, the latest last. While it is open it is fetched again when the job changes. */
const logOf = (job, { log }, actions) => h("details", { key: `log ${job.id}`, class: "panel job-log", ontoggle: (event) => (event.currentTarget.open ? actions.openLog(job.id) : actions.closeLog()) },
  h("summary", null, "Log"),
  logLines(log),
  log === null ? null : h("p", { key: "tools", class: "log-tools" }, logAgain(job, log, actions), h("a", { key: "page", class: "button small", href: logHref(job.id) }, "Open as a page")));

function downloadLinks(job, state) {
  const { open } = state;
  const taken = !isOver(job) || job.units_done > 0; // before the end there may be a picture soon
  const shown = layerOf(open, job) === "denoised" ? "denoised" : "picture";
  const link = (href, label, hint, name) => h("a", { key: hint, class: "button", href, download: name }, label, h("small", null, hint));
  const stem = jobName(job).replace(/\.xml$/i, "") + (job.sequence ? `.${job.frame}` : "");
  return h("nav", { class: "downloads", "aria-label": "Downloads" },
    taken && job.meters > 0 ? link(downloads.meters(job.id), "Values", "JSON", `${stem}.json`) : null,
    taken ? link(downloads.exr(job.id), "EXR", "image", `${stem}.exr`) : null,
    taken && isOver(job) && job.deep > 0 ? link(downloads.deep(job.id), "EXR", "deep image", `${stem}.deep.exr`) : null,
    taken ? link(downloads.png(job.id, open.exposure, shown, displayOf(state)), "PNG", shown === "denoised" ? "denoised" : "as shown", `${stem}.png`) : null,
    h("a", { key: "page", class: "button", href: downloads.page(job.id), target: "_blank", rel: "noopener" }, "Report", h("small", null, "page")),
    link(downloads.report(job.id), "Report", "JSON", `${stem}.report.json`),
    link(downloads.csv(job.id), "Convergence", "CSV", `${stem}.convergence.csv`),
    link(downloads.log(job.id), "Log", "text", `${stem}.log`));
}

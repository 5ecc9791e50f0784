// The log of a job: its lines, and a page that they fill.
import { h } from "../dom.js";
import { jobName } from "../format.js";
import { downloads } from "../api.js";
import { jobHref } from "../route.js";
import { statePill, wholeNotice } from "./pieces.js";

/** log: of the open job; null or without a text: it is not there yet, or could not be fetched. */
export const logLines = (log) => (typeof log?.text !== "string"
  ? h("p", { key: "waiting", class: "help" }, log?.failed ? "The log could not be fetched." : "Fetching the log …")
  : h("pre", { key: "lines", tabindex: 0, "aria-label": "Log" }, log.text || "Nothing has happened yet."));

export const logAgain = (job, log, actions) => (typeof log?.text !== "string" && !log?.failed ? null
  : h("button", { key: "again", type: "button", class: "small", onclick: () => actions.readLog(job.id) }, "Read it again"));

export function logView(state, actions) {
  const { route, open } = state;
  const job = state.jobs?.get(route.id);
  if (open?.problem && !job) return wholeNotice("bad", "This log can't be shown", h("p", null, open.problem), h("p", null, h("a", { href: "#/jobs" }, "All jobs")));
  if (!job || !open) return h("p", { class: "waiting", key: "waiting" }, "Fetching the job …");
  return h("section", { key: `log ${job.id}`, class: "job-log log-page" },
    h("p", { class: "crumb" }, h("a", { href: "#/jobs" }, "Jobs"), " / ", h("a", { href: jobHref(job.id) }, h("code", null, job.id)), " / Log"),
    h("div", { class: "heading" }, h("h1", null, `Log of ${jobName(job)}`), statePill(job), logAgain(job, open.log, actions),
      h("a", { key: "text", class: "button small", href: downloads.log(job.id), download: `${jobName(job).replace(/\.xml$/i, "")}.log` }, "Download")),
    logLines(open.log));
}

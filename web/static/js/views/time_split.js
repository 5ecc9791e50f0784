// Where the time of the workers' threads went, and the coordinator's on merging.
import { h } from "../dom.js";
import { duration, percent } from "../format.js";

const kParts = ["load", "build", "render", "transfer", "merge", "idle"];
const kMeanings = {
  load: "getting the files that the scene names", build: "reading them and building the world", render: "tracing", transfer: "packing results to be sent",
  merge: "folding and measuring, in the coordinator", idle: "threads between two units of the job",
};

export function timeSplit(job) {
  const parts = kParts.map((name) => ({ name, seconds: job.time?.[name] })).filter(({ seconds }) => Number.isFinite(seconds) && seconds >= 0);
  const total = parts.reduce((sum, { seconds }) => sum + seconds, 0);
  if (!job.time) return null;
  return h("section", { key: "time", class: "panel time", "aria-labelledby": "time-title" },
    h("h2", { id: "time-title" }, "Where the threads' time went"),
    h("p", { class: "help" }, "Seconds of threads: of render their CPU time, of the others by the clock."),
    h("div", { class: "time-bar", "aria-hidden": "true" }, parts.map(({ name, seconds }) => h("i", { key: name, class: `time-${name}`, style: { "--part": total > 0 ? seconds / total : 0 } }))),
    h("ul", { class: "time-parts" }, parts.map(({ name, seconds }) => h("li", { key: name, title: kMeanings[name] },
      h("i", { class: `swatch time-${name}`, "aria-hidden": "true" }), h("span", null, name), h("b", null, duration(seconds)), h("small", null, percent(total > 0 ? seconds / total : 0))))));
}

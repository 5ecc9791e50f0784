// How the time of the workers' threads was spent, and the coordinator's time for merging.
import { h } from "../dom.js";
import { duration, percent } from "../format.js";
import { phrases } from "../phrases.js";

const kMeanings = {
  load: phrases.timeLoad, build: phrases.timeBuild, render: phrases.timeRender, transfer: phrases.timeTransfer, merge: phrases.timeMerge, idle: phrases.timeIdle,
};

export function timeSplit(job) {
  const parts = Object.keys(kMeanings).map((name) => ({ name, seconds: job.time?.[name] })).filter(({ seconds }) => Number.isFinite(seconds) && seconds >= 0);
  const total = parts.reduce((sum, { seconds }) => sum + seconds, 0);
  if (!job.time) return null;
  return h("section", { key: "time", class: "panel time", "aria-labelledby": "time-title" },
    h("h2", { id: "time-title" }, "Where the threads' time went"),
    h("p", { class: "help" }, phrases.timeUnit),
    h("div", { class: "time-bar", "aria-hidden": "true" }, parts.map(({ name, seconds }) => h("i", { key: name, class: `time-${name}`, style: { "--part": total > 0 ? seconds / total : 0 } }))),
    h("ul", { class: "time-parts" }, parts.map(({ name, seconds }) => h("li", { key: name, title: kMeanings[name] },
      h("i", { class: `swatch time-${name}`, "aria-hidden": "true" }), h("span", null, name), h("b", null, duration(seconds)), h("small", null, percent(total > 0 ? seconds / total : 0))))));
}

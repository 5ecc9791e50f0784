// The frames of a sequence: one small link each, and which of them is shown.
import { h } from "../dom.js";
import { count, percent } from "../format.js";
import { frameHref } from "../route.js";
import { safeClass, stateWord } from "./pieces.js";

const kMost = 400; // links at once; of more those around the one that is shown

export function framesStrip(state, job) {
  const frames = job.frames;
  if (!frames) return null;
  const list = frames.list ?? [];
  const at = Math.max(0, list.findIndex((frame) => frame.id === state.open.shown));
  const first = Math.max(0, Math.min(at - kMost / 2, list.length - kMost));
  const some = list.slice(first, first + kMost);
  const shown = list[at];
  return h("nav", { key: "frames", class: "panel frames", "aria-label": "Frames" },
    h("p", { class: "frames-head" },
      h("b", null, shown ? `Frame ${shown.frame}` : "Frames"),
      h("span", { class: "dim" }, tally(frames)),
      step("previous", "‹", "The frame before", job, list[at - 1]),
      step("next", "›", "The next frame", job, list[at + 1]),
      state.route.frame === null
        ? h("span", { key: "following", class: "dim" }, "following what is rendered")
        : h("a", { key: "follow", class: "follow", href: frameHref(job.id, null) }, "Follow what is rendered")),
    some.length < list.length ? h("p", { key: "part", class: "help" }, `${count(some.length)} of them, around the one that is shown`) : null,
    h("ul", null, some.map((frame) => h("li", { key: frame.id }, cell(job, frame, frame === shown)))));
}

function tally(frames) {
  const more = ["failed", "cancelled"].filter((state) => frames[state] > 0).map((state) => `, ${count(frames[state])} ${state}`);
  return `${count(frames.done)} of ${count(frames.total)} done${more.join("")}`;
}

const step = (key, sign, label, job, frame) =>
  frame ? h("a", { key, class: "step", href: frameHref(job.id, frame.frame), "aria-label": label }, sign) : h("span", { key, class: "step off", "aria-hidden": "true" }, sign);

const cell = (job, frame, here) => h("a", {
  class: `frame is-${safeClass(frame.state)}`, href: frameHref(job.id, frame.frame), "data-frame": frame.frame,
  "aria-current": here ? "true" : null, "aria-label": `Frame ${frame.frame}, ${stateWord(frame)}, ${percent(frame.progress)}`,
  title: frame.error || null, style: { "--part": frame.progress },
}, String(frame.frame));

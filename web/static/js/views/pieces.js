// Small parts that several views share.
import { h } from "../dom.js";
import { isHeld, isOver, mayChange } from "../state.js";
import { percent } from "../format.js";

const kStateWords = { queued: "waiting", held: "held", running: "rendering", paused: "paused", done: "done", failed: "failed", cancelled: "cancelled" };
export const stateWord = (job) => (isHeld(job) ? kStateWords.held : kStateWords[job.state] ?? job.state);

export const statePill = (job) => h("span", { class: `pill state-${safeClass(job.state)}` }, stateWord(job));

/** A name as part of a class: whatever a server says can't add a second class. */
export const safeClass = (name) => String(name).replace(/[^a-z0-9_-]/gi, "");

export function progressBar(fraction, label, className = "") {
  const value = Math.min(1, Math.max(0, fraction || 0));
  return h("div", {
    class: `bar ${className}`, role: "progressbar", "aria-label": label, "aria-valuemin": 0, "aria-valuemax": 100,
    "aria-valuenow": Math.round(value * 100), "aria-valuetext": percent(value), style: { "--part": value },
  }, h("i", null));
}

export const workerMark = (colour, name) => h("span", { class: "worker-name" }, h("i", { class: `dot worker-${colour}`, "aria-hidden": "true" }), name);

const noticeUnder = (heading) => (kind, title, ...body) =>
  h("section", { class: `notice ${kind}`, role: kind === "bad" ? "alert" : null }, h(heading, null, title), ...body);
export const notice = noticeUnder("h2");
export const wholeNotice = noticeUnder("h1"); // in place of a view

/** One of a few: [[value, label], ...], as radio buttons, which the arrow keys walk along. */
export const choice = (name, label, options, chosen, onChoose) =>
  h("fieldset", { class: "choice" }, h("legend", { class: "unseen" }, label), options.map(([value, text]) => h("label", { key: value },
    h("input", { type: "radio", name, value, ".checked": value === chosen, onchange: () => onChoose(value) }), h("span", null, text))));

/** Pause or resume, and cancel; on the page of a job that has ended, remove. What can't be undone asks once more. */
export function jobActions(state, job, actions, large = false) {
  const over = isOver(job);
  if ((over && !large) || !mayChange(state)) return null;
  const busy = state.ui.busy === job.id;
  const button = (key, label, onclick, className = "") =>
    h("button", { key, type: "button", class: `${large ? "" : "small "}${className}`, disabled: busy, onclick, "aria-label": `${label}: ${[job.name, job.id].filter(Boolean).join(", ")}` }, label);
  if (state.ui.confirming === job.id) {
    return h("span", { class: "actions" },
      over ? button("gone", "Really remove, with its images", () => actions.remove(job.id), "danger") : button("yes", "Really cancel", () => actions.cancel(job.id), "danger"),
      button("no", "Keep", () => actions.confirm(null), "quiet"));
  }
  if (over) return h("span", { class: "actions" }, button("remove", "Remove", () => actions.confirm(job.id), "quiet"));
  return h("span", { class: "actions" },
    job.state === "paused"
      ? button("resume", "Resume", () => actions.setState(job.id, "running"), "quiet")
      : button("pause", "Pause", () => actions.setState(job.id, "paused"), "quiet"),
    button("cancel", "Cancel", () => actions.confirm(job.id), "quiet"));
}

/** Diagnostics as the command line prints them: place, text, the line, and a caret under the place. */
export function diagnostics(list) {
  return h("ol", { class: "diagnostics" }, list.map((d, i) => h("li", { key: i, class: d.severity === "warning" ? "warning" : "error" },
    h("p", null,
      h("code", { class: "place" }, [d.file, d.line, d.column].filter((part) => part).join(":")), " ",
      h("b", null, d.severity === "warning" ? "warning" : "error"), " ", d.text),
    d.source_line ? h("pre", { tabindex: 0 }, `${d.source_line}\n`, h("span", { class: "caret" }, caretUnder(d))) : null)));
}

function caretUnder({ source_line, column, length }) {
  const before = source_line.slice(0, Math.max(0, (column || 1) - 1)).replace(/[^\t]/g, " ");
  return `${before}^${"~".repeat(Math.min(200, Math.max(0, (length || 1) - 1)))}`;
}

/** A window and the light that falls through it. */
export const mark = () => h("svg", { class: "mark", viewBox: "0 0 32 32", "aria-hidden": "true" },
  h("defs", null, h("linearGradient", { id: "beam", x1: "0.2", y1: "0", x2: "0.8", y2: "1" }, h("stop", { class: "near", offset: "0" }), h("stop", { class: "far", offset: "1" }))),
  h("path", { class: "mark-beam", d: "M8 5 L15 3 L30 29 L13 29 Z" }),
  h("path", { class: "mark-window", d: "M8 5 L15 3 L16.4 5.5 L8.6 7.8 Z" }));

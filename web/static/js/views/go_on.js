// What a person can do next with a job, below its name: the row says whether the image is good enough, and offers
// to render on.
import { h } from "../dom.js";
import { mayChange } from "../state.js";
import { count, given } from "../format.js";
import { doubtful, kDoubts, kUnsure } from "../verdict.js";

/** How a job that is done goes on: what the coordinator is asked for, and in words; null: it can't. */
export function further(job) {
  if (job.state !== "done" || job.frames) return null;
  // tiles differ in their samples: each gets what half the error takes
  if (job.stopped === "error" && job.target_error > 0) return { changes: { target_error: job.target_error / 2 }, words: `to relMSE ${given(job.target_error / 2)}` };
  const done = Math.ceil(job.spp_asked === null ? job.spp_done : Math.max(job.spp, job.spp_done));
  // of a noisy image as many as the coordinator's advice asks for (core/job/advice.cpp): they halve its noise
  const spp = doubtful(job.verdict) ? Math.max(4 * done, 64) : 2 * done;
  return done > 0 ? { changes: { spp }, words: `${count(spp)} samples` } : null;
}

/** Both keep their height while they are empty, so that what is below does not move when the job ends. */
export function goOn(state, job, actions, sentence) {
  if (job.frames) return [h("p", { key: "sub", class: "sub" }, sentence)];
  const noisy = doubtful(job.verdict) && job.spp_done > 0;
  const next = mayChange(state) ? further(job) : null;
  return [
    h("div", { key: "go-on", class: "go-on" },
      h("p", { class: "sub" }, sentence),
      job.state === "done" && !job.denoise && !job.sequence && mayChange(state) ? h("button", { key: "denoise", type: "button", onclick: () => actions.openDenoise(job) }, "Denoise …") : null,
      next ? h("button", { key: "more", type: "button", class: noisy ? "primary" : "", disabled: state.ui.busy === job.id, onclick: () => actions.renderOn(job.id, next.changes) }, `Render on (${next.words})`) : null),
    job.state === "failed" || job.state === "cancelled" ? null : h("p", { key: "noisy", class: "noisy" }, noisy ? [h("b", { key: "what" }, kDoubts[job.verdict.kind] ?? kUnsure), ". ", h("span", { key: "advice" }, advice(job))] : null),
  ];
}

/** The coordinator's own advice if it gives some. */
function advice({ state, verdict, denoise }) {
  if (typeof verdict.advice === "string" && verdict.advice) return verdict.advice[0].toUpperCase() + verdict.advice.slice(1);
  if (state !== "done") return "It gets better with every sample.";
  return `Rendering on keeps every sample there is.${denoise ? " The denoised picture has an error of its own." : ""}`;
}

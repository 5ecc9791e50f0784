// Actions of the form that submits a job's scene once more, with other samples.
import { withUi } from "./state.js";

export const kAgain = { spp: "", target_error: "", time: "", seed: "", denoise: false };

/** What the form says as the coordinator wants it, or what is wrong with it. */
export function changesOf(form) {
  const changes = {};
  if (form.denoise) changes.denoise = true;
  for (const name of ["spp", "target_error", "time", "seed"]) {
    const text = form[name];
    if (text.trim() === "") continue;
    const value = Number(text);
    const whole = name === "spp" || name === "seed";
    if (!(value > 0 || (name === "seed" && value === 0)) || !Number.isFinite(value) || (whole && !Number.isInteger(value))) return { problem: `“${text}” is no ${whole ? "whole " : ""}number that can be used here.` };
    changes[name] = value;
  }
  return { changes };
}

export function makeAgainActions({ get, set, attempt, api }) {
  return {
    /** To denoise it: with the samples that it has. */
    openDenoise: (job) => set(withUi(get(), { again: { id: job.id, form: { ...kAgain, denoise: true }, problem: null } })),
    openAgain: (job) => set(withUi(get(), { again: { id: job.id, form: { ...kAgain, spp: job.spp_asked === null ? "" : String(2 * job.spp), target_error: job.spp_asked === null && job.target_error ? String(job.target_error / 2) : "" }, problem: null } })),
    closeAgain: () => set(withUi(get(), { again: null })),
    typeAgain: (name, value) => get().ui.again && set(withUi(get(), { again: { ...get().ui.again, form: { ...get().ui.again.form, [name]: value }, problem: null } })),
    submitAgain: async (event) => {
      event.preventDefault();
      if (!get().ui.again || get().ui.busy === get().ui.again.id) return; // pressed twice before the page was drawn
      const { id, form } = get().ui.again;
      const { changes, problem } = changesOf(form);
      if (problem) {
        set(withUi(get(), { again: { ...get().ui.again, problem } }));
        return;
      }
      set(withUi(get(), { busy: id }));
      const made = await attempt(() => api.again(id, changes));
      set(withUi(get(), { busy: null, ...(made ? { again: null } : {}) }));
      if (made) window.location.hash = `#/jobs/${encodeURIComponent(made.id)}`;
    },
  };
}

// The form that submits a job's scene once more.
import { h } from "../dom.js";
import { mayChange } from "../state.js";

const kFields = [["spp", "Samples per pixel"], ["target_error", "Target error"], ["time", "Seconds"], ["seed", "Seed"]];

export const againButton = (state, job, actions) => (mayChange(state)
  ? h("button", { key: "again", type: "button", "aria-expanded": String(state.ui.again?.id === job.id), onclick: () => (state.ui.again?.id === job.id ? actions.closeAgain() : actions.openAgain(job)) }, "Render again …") : null);

export function againForm(state, job, actions) {
  const { again } = state.ui;
  if (again?.id !== job.id) return null;
  return h("form", { key: "again-form", class: "panel again", onsubmit: actions.submitAgain },
    h("p", { class: "help" }, `The same scene${job.frames ? ", with all its frames," : ""} as a new job. It ends at these samples, this error or this time. Leave all three empty to use the limits of this job.`),
    h("div", { class: "settings" },
      kFields.map(([name, label]) => h("div", { key: name, class: "field" }, h("label", { for: `again-${name}` }, label),
        h("input", { id: `again-${name}`, inputmode: "decimal", autocomplete: "off", ".value": again.form[name], oninput: (event) => actions.typeAgain(name, event.currentTarget.value) }))),
      job.denoise ? null : h("label", { key: "denoise", class: "check field-check" }, h("input", { id: "again-denoise", type: "checkbox", ".checked": again.form.denoise, onchange: (event) => actions.typeAgain("denoise", event.currentTarget.checked) }), "Denoise"),
      h("button", { type: "submit", class: "primary", disabled: state.ui.busy === job.id }, "Render again"),
      again.problem ? h("p", { key: "problem", class: "field-error", role: "alert" }, again.problem) : null));
}

// What the user can do on the page "New job".
import { filesOfDrop, filesOfList, plan as planOf, scenesAmong } from "./bundle.js";
import { emptySubmission, mayChange, withSubmit, withUi } from "./state.js";
import { inPlainWords, submitJob } from "./submit.js";

export function makeSubmitActions({ get, set, api, compareFile }) {
  const busy = () => ["hashing", "sending"].includes(get().submit.phase);

  async function take(files, main = null) {
    if (busy()) return; // files cannot be changed while they are being sent
    const all = merged(get().submit.files, files);
    const scene = main ?? get().submit.main ?? scenesAmong(all)[0] ?? null;
    set(withSubmit(get(), { files: all, main: scene, plan: null, phase: "choose", error: null }));
    if (!scene) return;
    try {
      const plan = await planOf(all, scene);
      if (get().submit.files !== all) return;
      const { settings } = get().submit;
      set(withSubmit(get(), { plan, settings: plan.frames && !settings.frames ? { ...settings, frames: plan.frames } : settings }));
    } catch {
      if (get().submit.files === all) set(withSubmit(get(), { error: { message: `The browser can't read ${scene}. If it was moved or changed, choose it again.`, diagnostics: [] } }));
    }
  }

  async function send(event) {
    event.preventDefault();
    if (busy()) return;
    const { plan, settings } = get().submit;
    set(withSubmit(get(), { error: null, phase: "hashing", step: "Reading the files", progress: 0 }));
    try {
      const id = await submitJob(api, plan, settings, (step) => set(withSubmit(get(), step)));
      set({ ...get(), submit: { ...emptySubmission(), settings: { ...settings, name: "", frames: "" } } });
      window.location.hash = `#/jobs/${encodeURIComponent(id)}`;
    } catch (error) {
      set(withSubmit(get(), { phase: "refused", error: { message: inPlainWords(error.message), diagnostics: (error.diagnostics ?? []).map((one) => ({ ...one, text: inPlainWords(one.text) })) } }));
    }
  }

  return {
    onFiles: (event) => {
      take(filesOfList(event.currentTarget.files));
      // Otherwise choosing the same file again, after an edit, would not be a change
      event.currentTarget.value = "";
    },
    /** Of files dropped anywhere on any page: else the browser would open them, and the dashboard would be gone. */
    takeDrop: async (event) => {
      const files = await filesOfDrop(event.dataTransfer);
      if (files.length === 0) return;
      if (get().viewer && files.length === 1 && /\.exr$/i.test(files[0].path)) {
        compareFile(files[0].file);
        return;
      }
      if (!mayChange(get())) {
        set(withUi(get(), { notice: "Your token lets you look; jobs are submitted with another one." }));
        return;
      }
      if (get().route.view !== "submit") window.location.hash = "#/submit";
      take(files);
    },
    onMain: (event) => take([], event.currentTarget.value),
    onSetting: (event) => {
      const { name, type, value, checked } = event.currentTarget;
      set(withSubmit(get(), { settings: { ...get().submit.settings, [name]: type === "checkbox" ? checked : value } }));
    },
    clearFiles: () => busy() || set(withSubmit(get(), { ...emptySubmission(), settings: { ...get().submit.settings, name: "", frames: "" } })),
    onSubmit: send,
  };
}

/** A file chosen again replaces its older self. */
function merged(before, files) {
  const byPath = new Map(before.map((entry) => [entry.path, entry]));
  for (const entry of files) byPath.set(entry.path, entry);
  return [...byPath.values()];
}

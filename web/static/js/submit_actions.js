// What the user can do on the page "New job".
import { filesOfDrop, filesOfList, plan as planOf, scenesAmong } from "./bundle.js";
import { emptySubmission, withSubmit } from "./state.js";
import { submitJob } from "./submit.js";

export function makeSubmitActions({ get, set, api }) {
  const busy = () => ["hashing", "sending"].includes(get().submit.phase);

  async function take(files, main = null) {
    if (busy()) return; // files cannot be changed while they are being sent
    const all = merged(get().submit.files, files);
    const scene = main ?? get().submit.main ?? scenesAmong(all)[0] ?? null;
    set(withSubmit(get(), { files: all, main: scene, plan: null, phase: "choose", error: null }));
    if (!scene) return;
    try {
      const plan = await planOf(all, scene);
      if (get().submit.files === all) set(withSubmit(get(), { plan }));
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
      set({ ...get(), submit: { ...emptySubmission(), settings } });
      window.location.hash = `#/jobs/${encodeURIComponent(id)}`;
    } catch (error) {
      set(withSubmit(get(), { phase: "refused", error: { message: error.message, diagnostics: error.diagnostics ?? [] } }));
    }
  }

  return {
    onFiles: (event) => {
      take(filesOfList(event.currentTarget.files));
      // Otherwise choosing the same file again, after an edit, would not be a change
      event.currentTarget.value = "";
    },
    onDrop: async (event) => {
      event.preventDefault();
      event.currentTarget.classList.remove("over");
      take(await filesOfDrop(event.dataTransfer));
    },
    onDragOver: (event) => {
      event.preventDefault();
      event.currentTarget.classList.add("over");
    },
    onDragLeave: (event) => event.currentTarget.classList.remove("over"),
    onMain: (event) => take([], event.currentTarget.value),
    onSetting: (event) => {
      const { name, value } = event.currentTarget;
      set(withSubmit(get(), { settings: { ...get().submit.settings, [name]: value } }));
    },
    clearFiles: () => busy() || set(withSubmit(get(), { ...emptySubmission(), settings: get().submit.settings })),
    onSubmit: send,
  };
}

/** A file chosen again replaces its older self. */
function merged(before, files) {
  const byPath = new Map(before.map((entry) => [entry.path, entry]));
  for (const entry of files) byPath.set(entry.path, entry);
  return [...byPath.values()];
}

// The page for a new job: drop a scene with its files, choose settings, send.
import { h } from "../dom.js";
import { bytes, plural } from "../format.js";
import { kSceneEndings, kNoScene, scenesAmong } from "../bundle.js";
import { diagnostics, notice, progressBar, wholeNotice } from "./pieces.js";
import { mayChange } from "../state.js";

export function submitView(state, actions) {
  if (!mayChange(state)) return wholeNotice("mild", "This token may look, and submit nothing", h("p", null, h("a", { href: "#/jobs" }, "All jobs")));
  const { submit } = state;
  const busy = submit.phase === "hashing" || submit.phase === "sending";
  return h("section", { key: "submit", class: "submit" },
    h("div", { class: "heading" }, h("h1", null, "New job")),
    dropZone(submit, actions, busy),
    submit.files.length ? bundle(submit, actions, busy) : null,
    submit.error ? refusal(submit.error) : null,
    submit.files.length ? settingsForm(submit, actions, busy) : null,
    busy ? h("div", { key: "progress", class: "panel sending", role: "status" }, progressBar(submit.progress, submit.step), h("p", null, submit.step, " …")) : null);
}

function dropZone(submit, actions, busy) {
  return h("div", { key: "drop", class: submit.files.length ? "drop slim" : "drop" },
    submit.files.length ? null : h("p", { key: "lead", class: "lead" }, "Drop a scene here, with its meshes, textures and volumes"),
    h("div", { class: "choices" },
      chooser("files", submit.files.length ? "Add files" : "Choose files", { multiple: true }, actions, busy),
      chooser("folder", "Choose a folder", { webkitdirectory: true }, actions, busy)),
    submit.files.length ? null : h("p", { key: "help", class: "help" }, `A scene is ${kSceneEndings}. Only the files that it names are sent (beside a .pbrt or a stage of USD all of them, since this page can't read those), and none that the farm has already. Files may be dropped anywhere on any page.`));
}

// A file input on top of its button, but invisible, so that keyboard and screen reader use a real file input.
const chooser = (id, label, attributes, actions, disabled) =>
  h("label", { class: "button chooser", for: id }, label, h("input", { id, type: "file", class: "over", disabled, onchange: actions.onFiles, ...attributes }));

function bundle(submit, actions, busy) {
  const scenes = scenesAmong(submit.files);
  const { plan } = submit;
  return h("section", { key: "bundle", class: "panel bundle" },
    // The name is known immediately and is at the top, so that later content does not move it under the
    // pointer.
    h("div", { key: "head", class: "bundle-head" },
      h("h2", null, plan ? plan.main.name : submit.main?.split("/").at(-1) ?? "No scene yet"),
      h("button", { type: "button", class: "small quiet", disabled: busy, onclick: actions.clearFiles }, "Start over")),
    scenes.length === 0 ? h("p", { class: "field-error", role: "alert" }, kNoScene) : null,
    scenes.length > 1
      ? h("p", null, h("label", { for: "main-scene" }, "Scene "), h("select", { id: "main-scene", disabled: busy, onchange: actions.onMain }, scenes.map((path) => h("option", { key: path, value: path, ".selected": path === submit.main }, path))))
      : null,
    plan ? planned(plan) : null);
}

function planned(plan) {
  const total = plan.assets.reduce((sum, { file }) => sum + file.size, plan.main.size);
  return [
    h("p", { key: "sum", class: "sub" }, plan.archive ? `an archive with a scene and its files, ${bytes(total)}` : plan.assets.length ? `with ${plural(plan.assets.length, "file")}, ${bytes(total)} in all` : `on its own, ${bytes(total)}`),
    plan.allSent && plan.assets.length ? h("p", { key: "all", class: "notice mild" }, "This page can't tell which of these files the scene names, so all of them are sent.") : null,
    h("ul", { key: "files", class: "files" },
      plan.missing.map((name) => h("li", { key: `m${name}`, class: "missing" }, h("code", null, name), h("span", null, "missing: add this file"))),
      plan.assets.map(({ name, file }) => h("li", { key: `a${name}` }, h("code", null, name), h("span", { class: "number dim" }, bytes(file.size)))),
      plan.unused.map((path) => h("li", { key: `u${path}`, class: "unused" }, h("code", null, path), h("span", null, "not named by the scene, stays here")))),
  ];
}

function settingsForm(submit, actions, busy) {
  const why = reason(submit, busy);
  const field = (name, label, hint, attributes = {}) => h("div", { key: name, class: "field" },
    h("label", { for: `set-${name}` }, label),
    h("input", { id: `set-${name}`, name, inputmode: "decimal", autocomplete: "off", placeholder: hint, disabled: busy, ".value": submit.settings[name], oninput: actions.onSetting, ...attributes }));
  return h("form", { key: "settings", class: "panel settings", onsubmit: actions.onSubmit },
    field("spp", "Samples per pixel", "the scene’s"),
    field("target_error", "Stop at relMSE", "no target"),
    field("time", "Stop after seconds", "no limit"),
    field("width", "Width", "the scene’s"),
    field("height", "Height", "the scene’s"),
    field("frames", "Frames", "one image", { inputmode: "text", title: "1-10, or 1-10x2 for every second one" }),
    h("label", { key: "denoise", class: "check field-check" }, h("input", { type: "checkbox", name: "denoise", id: "set-denoise", disabled: busy, ".checked": submit.settings.denoise, onchange: actions.onSetting }), "Denoise"),
    h("details", { key: "more", class: "more-settings" }, h("summary", null, "More settings"), h("div", { class: "settings" },
      field("name", "Name", "the scene file’s", { inputmode: "text" }),
      field("aov", "Further layers", "depth, normal", { inputmode: "text" }),
      field("seed", "Seed", "0"),
      field("priority", "Priority", "0; higher comes first"),
      field("tags", "Tags of workers", "any worker", { inputmode: "text" }))),
    h("p", { key: "go", class: "go" }, h("button", { type: "submit", class: "primary", disabled: why !== null, "aria-describedby": "why-not" }, "Render"), h("span", { id: "why-not", class: "dim", role: "status" }, why)));
}

/** Why the job can't be submitted yet; null if it can. */
function reason({ files, plan, phase }, busy) {
  if (busy) return phase === "hashing" ? "The files are being read." : "The job is being submitted.";
  if (scenesAmong(files).length === 0) return "A scene is missing.";
  if (!plan) return "The scene is being read.";
  return plan.missing.length ? `${plural(plan.missing.length, "file is missing", "files are missing")}: add ${plan.missing.length === 1 ? "it" : "them"}.` : null;
}

function refusal({ message, diagnostics: list }) {
  return h("section", { key: "refused", class: "notice bad", role: "alert" },
    h("h2", null, list.length ? "The scene was refused" : "This did not work"),
    list.length ? diagnostics(list) : h("pre", { tabindex: 0 }, message));
}

// The panel of light groups. The factory of nodes is handed in: there is one for the page.
import { exposure as stops, figure, interval } from "../format.js";
import { colourOf, hexOf, kKelvin, kMostStops, rowOf } from "./mix.js";

const kSliderStops = 8;
const kNeutralKelvin = 6500; // where the slider stands if there is no temperature

loadStyle();

/** The panel's style is loaded with it. */
function loadStyle() {
  const href = new URL("../../css/mix.css", import.meta.url).href;
  if (![...document.querySelectorAll("link")].some((link) => link.href === href)) document.head.append(Object.assign(document.createElement("link"), { rel: "stylesheet", href }));
}

/** panel: {groups, rows, json, error, waits, refused, exr, renders}; renders: the mix may be rendered as a job. */
export function mixPanel(h, panel, actions) {
  const { groups, rows } = panel;
  const neutral = panel.json === "{}";
  return h("section", { key: "mix", class: "panel viewer-mix", "aria-labelledby": "mix-title" },
    h("div", { class: "mix-top" }, h("h2", { id: "mix-title" }, "Light groups"), errorOf(h, panel, neutral)),
    h("div", { key: "groups", class: "mix-groups" }, groups.map((group) => groupRow(h, group, rows, actions))),
    h("div", { key: "files", class: "mix-files" },
      h("button", { key: "reset", type: "button", class: "small", disabled: rows.size === 0, onclick: actions.reset }, "Reset"),
      h("a", { key: "save", class: "button small", href: `data:application/json,${encodeURIComponent(panel.json)}`, download: "mix.json" }, "Save mix"),
      h("span", { key: "load", class: "chooser button small" }, h("label", { for: "mix-file" }, "Load mix …"),
        h("input", { id: "mix-file", type: "file", accept: ".json", onchange: (event) => {
          const [file] = event.currentTarget.files;
          if (file) actions.load(file);
          event.currentTarget.value = ""; // the same file can be loaded again
        } })),
      h("a", { key: "exr", class: "button small", href: panel.exr, download: true }, "Download EXR"),
      panel.renders ? h("button", { key: "render", type: "button", class: "small", disabled: neutral, onclick: actions.render }, "Render as job") : null),
    panel.refused ? h("p", { key: "refused", class: "field-error", role: "alert" }, panel.refused) : null);
}

function errorOf(h, { error, waits }, neutral) {
  const text = neutral ? "as rendered" : waits ? "relMSE …" : !error ? null : error.problem ?? `relMSE ${figure(error.relmse)}${error.trusted ? ` (95 %: ${interval(error.relmse_ci95)})` : ` (${error.verdict})`}`;
  return h("p", { key: "error", class: error?.problem && !waits && !neutral ? "number field-error" : "dim number", role: "status" }, text);
}

function groupRow(h, { name, apart }, rows, actions) {
  const row = rowOf(rows, name);
  const toggle = (key, text) => h("button", { key, type: "button", class: "small", "aria-pressed": String(row[key]), "aria-label": `${text} ${name}`, onclick: () => actions.alter(name, (now) => ({ [key]: !now[key] })) }, text);
  const changes = (key) => (more) => actions.alter(name, (now) => (now[key] ? { [key]: { ...now[key], ...more } } : {}));
  return h("fieldset", { key: name, class: "mix-group" }, h("legend", null, name),
    h("span", { class: "mix-head" }, toggle("solo", "Solo"), toggle("mute", "Mute"),
      apart ? h("label", { class: "check" }, h("input", { type: "checkbox", "aria-label": `${name}: media apart`, ".checked": row.volume !== null, onchange: () => actions.alter(name, (now) => ({ volume: now.volume ? null : now.surface })) }), "Media apart") : null),
    part(h, row.volume ? "Surfaces" : "", name, row.surface, changes("surface")),
    row.volume ? part(h, "Media", name, row.volume, changes("volume")) : null);
}

/** of: what of the group's light; empty: all. */
function part(h, of, name, { gain, colour, kelvin }, change) {
  const label = (what) => `${name}${of ? `, ${of.toLowerCase()}` : ""}: ${what}`;
  const number = (what, value, min, max, step, set) => h("input", { key: `${what}-number`, type: "number", class: "number", "aria-label": label(what), min, max, step, ".value": value, placeholder: what.endsWith("K") ? "K" : "0",
    onchange: (event) => set(event.currentTarget.value === "" ? null : Math.min(max, Math.max(min, event.currentTarget.valueAsNumber))) });
  const slider = (what, value, text, min, max, step, set, plain) => h("input", { key: what, type: "range", "aria-label": label(`${what} slider`), "aria-valuetext": text, min, max, step, ".value": String(value), oninput: (event) => set(event.currentTarget.valueAsNumber), ondblclick: () => set(plain) });
  return h("div", { key: of, class: "mix-part" },
    of ? h("span", { key: "of", class: "mix-of" }, of) : null,
    h("span", { key: "gain", class: "mix-line" }, h("span", { "aria-hidden": "true" }, "Gain"),
      slider("gain", gain, stops(gain), -kSliderStops, kSliderStops, 0.1, (value) => change({ gain: value }), 0),
      number("gain in stops", String(Number(gain.toFixed(2))), -kMostStops, kMostStops, 0.1, (value) => change({ gain: value ?? 0 }))),
    h("span", { key: "colour", class: "mix-line" },
      h("input", { key: "colour", type: "color", "aria-label": label("colour"), ".value": hexOf(colour), oninput: (event) => change({ colour: colourOf(event.currentTarget.value) }) }),
      slider("colour temperature", kelvin ?? kNeutralKelvin, kelvin === null ? "as it is" : `${kelvin} K`, ...kKelvin, 100, (value) => change({ kelvin: value }), null),
      number("colour temperature in K", kelvin === null ? "" : String(Math.round(kelvin)), ...kKelvin, 100, (value) => change({ kelvin: value }))));
}

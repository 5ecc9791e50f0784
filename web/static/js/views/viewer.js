// The viewer: a picture as numbers, with its layers and errors, and optionally a second one for comparison.
import { h } from "../dom.js";
import { exposure as exposureText, figure, interval, jobName, kAbsent, moment, spp } from "../format.js";
import { jobHref } from "../route.js";
import { kCompared, kMostExposure, kOverlays } from "../viewer/address.js";
import { kindOf } from "../viewer/paint.js";
import { curveOf, curvesOf } from "../viewer/display.js";
import { isOver, mayChange } from "../state.js";
import { doubtWord, doubtful } from "../verdict.js";
import { comparable, identifiersOf, nameOf } from "../viewer_actions.js";
import { legend } from "./job_image.js";
import { choice, wholeNotice } from "./pieces.js";

const kLayerNames = { rgb: "Picture", denoised: "Denoised", stderr: "Standard error", error: "Relative error", spp: "Samples", mix: "Mix of light groups", "mix.stderr": "Standard error of the mix", crypto_object: "Objects", crypto_material: "Materials" };
const kKeys = [
  ["arrows", "move; with Shift by one pixel"], ["+ −", "zoom"], ["0", "fit"], ["z", "one to one"], ["1 – 9", "first picture, others of the list to compare"], ["k", "single channels"], ["h", "histogram"], ["e E", "brighter, darker"], ["c", "view of the colours"], ["l L", "layer"],
  ["o", "overlay"], ["f", "false colours"], ["r", "region: what is seen, or none"], ["p", "render the region first, or none first"], ["Enter", "select the object in the middle"], ["b", "way to compare"], ["x", "first, second"], ["[ ]", "wipe"],
];

export const layerName = (layer) => kLayerNames[layer.name] ?? layer.name.replaceAll("_", " ");

export function viewerView(state, actions) {
  const { viewer } = state;
  const job = state.jobs?.get(state.route.id);
  if (!viewer) return h("p", { class: "waiting", key: "waiting" }, "Opening the viewer …");
  const { a, b, view } = viewer;
  if (!a) return viewer.problem ? wholeNotice("bad", "This picture can't be shown", h("p", null, viewer.problem)) : h("p", { class: "waiting", key: "waiting" }, "Asking for the picture's layers …");
  const layer = a.layer(view.layer);
  const fits = b && b.size[0] === a.size[0] && b.size[1] === a.size[1];
  const second = fits && b.layer(layer.name).name === layer.name ? b : null;
  const parts = [tools(viewer, layer, state.displays, actions), compareTools(state, viewer, fits, second, actions)];
  // What comes and goes stands below the picture: it must not move while somebody drags in it.
  const mix = viewer.mixing?.panel(viewer) ?? null;
  const picture = [
    h("div", { key: "side", class: "viewer-side" }, stage(state, viewer, layer, second, job ?? { id: viewer.id }, actions), state.narrow ? null : mix),
    viewer.problem || viewer.refused ? h("p", { key: "problem", class: "toast", role: "alert" }, viewer.problem || viewer.refused) : null,
    focusTools(state, viewer, job, actions), reading(viewer, layer, second), viewer.histogram ? histogram(viewer.survey, layer) : null, state.narrow ? mix : null];
  return h("article", { key: "viewer", class: "viewer" },
    h("div", { class: "viewer-head" },
      h("h1", null, jobName(job ?? { id: viewer.id })),
      h("a", { href: jobHref(viewer.id) }, "Job"),
      h("span", { class: "dim number" }, `${a.size[0]} × ${a.size[1]}`),
      errorText(job, viewer.report, layer),
      h("button", { key: "save", type: "button", class: "small", onclick: () => actions.savePicture(`${jobName(job ?? { id: viewer.id }).replace(/\.xml$/i, "")}-${layer.name}.png`) }, "Save as PNG")),
    state.narrow ? [picture, parts] : [parts, picture], // on a phone the picture comes first
    h("details", { key: "keys", class: "viewer-keys" }, h("summary", null, "Keys"), h("dl", null, kKeys.map(([key, what]) => h("div", { key }, h("dt", null, h("kbd", null, key)), h("dd", null, what))))));
}

/** The error of the picture that is shown. */
function errorText(job, report, layer) {
  const denoised = job?.denoised ?? report?.denoised;
  if (layer.name === "denoised" && typeof denoised?.relmse === "number") return relMse(denoised.relmse, interval(denoised.relmse_ci95));
  if (layer.name !== "rgb" || typeof job?.relmse !== "number") return null;
  return relMse(job.relmse, doubtful(job.verdict) ? null : interval(job.relmse_ci95), doubtful(job.verdict) ? doubtWord(job.verdict) : null);
}
const relMse = (value, known, doubt = null) => h("span", { key: "error", class: "dim number viewer-error" }, `relMSE ${figure(value)}${known ? ` (95 %: ${known})` : ""}${doubt ? ` (${doubt})` : ""}`);

const describe = (job) => [jobName(job), job.spp_done > 0 ? `${spp(job.spp_done)} spp` : null].filter(Boolean).join(", ");

function stage(state, viewer, layer, second, job, actions) {
  const { a, view } = viewer;
  const name = jobName(job);
  const focus = job.focus && !isOver(job) ? job.focus : null;
  const { exposure, falseColour, channel, by, split, region } = view;
  const curve = curveOf(view.curve, state.displays);
  const cube = viewer.cube?.name === curve ? viewer.cube.values : null;
  const overlay = overlaysOf(layer).some(([name]) => name === view.overlay) ? view.overlay : "";
  const range = viewer.survey?.layer === layer.name ? [viewer.survey.least, viewer.survey.most] : null;
  const other = viewer.file ? { name: viewer.file } : [...(viewer.others ?? []), ...(state.jobs?.values() ?? [])].find(({ id }) => id === view.other) ?? { id: view.other ?? "" };
  const sides = [`First: ${describe(job)}`, `Second: ${describe(other)}`];
  const matte = kindOf(layer) === "matte" ? identifiersOf(layer, view.matte) : new Set();
  return h("figure", { key: "stage", class: "panel viewer-stage" }, h("float-view", {
    key: "view", tabindex: 0, role: "application", "aria-label": `${layerName(layer)} of ${name}. ${kKeys.map(([key, what]) => `${key}: ${what}`).join("; ")}`,
    ".model": { a, b: second, layer: layer.name, look: { exposure, curve, cube, falseColour, channel, range, matte }, view, sides, by, split, overlay, region, focus, tool: viewer.tool, changed: viewer.changed },
    onviewed: (event) => actions.look(event.detail), onpointed: (event) => actions.point(event.detail), onpicked: (event) => actions.pick(event.detail),
    onframed: (event) => actions.frame(event.detail), onsplit: (event) => actions.look({ split: event.detail }), onflipped: (event) => actions.flipped(event.detail), oncommand: (event) => actions.command(event.detail),
  }));
}

/** The error that lies over a picture is that of the image itself. */
const overlaysOf = (layer) => (layer.name === "mix" ? kOverlays.filter(([name]) => name !== "error") : kOverlays);

function tools(viewer, layer, displays, actions) {
  const { a, view } = viewer;
  const coloured = kindOf(layer) === "colour";
  return h("div", { key: "tools", class: "viewer-tools" },
    pick("layer", "Layer", a.layers.map((one) => [one.name, layerName(one)]), layer.name, (name) => actions.look({ layer: name })),
    h("span", { key: "exposure", class: "viewer-tool wide" }, h("label", { for: "ev" }, "Exposure"),
      h("input", { id: "ev", type: "range", min: -kMostExposure, max: kMostExposure, step: 0.25, disabled: !coloured, ".value": String(view.exposure), "aria-valuetext": exposureText(view.exposure),
        oninput: (event) => actions.look({ exposure: Number(event.currentTarget.value) }), ondblclick: () => actions.look({ exposure: 0 }) }),
      h("output", { for: "ev", class: "number" }, exposureText(view.exposure))),
    pick("curve", "View", curvesOf(displays), curveOf(view.curve, displays), (curve) => actions.look({ curve }), !coloured || view.falseColour),
    h("label", { key: "false", class: "check" }, h("input", { type: "checkbox", id: "false", disabled: !coloured && kindOf(layer) !== "measure", ".checked": view.falseColour, onchange: (event) => actions.look({ falseColour: event.currentTarget.checked }) }), "False colours"),
    layer.channels.length > 1 && kindOf(layer) !== "matte" ? pick("channel", "Channels", [["", "all"], ...layer.channels.slice(0, 3).map((name, i) => [String(i), name])], view.channel === null ? "" : String(view.channel), (value) => actions.look({ channel: value === "" ? null : Number(value) })) : null,
    pick("overlay", "Overlay", overlaysOf(layer), view.overlay, (overlay) => actions.look({ overlay })),
    choice("tool", "What dragging does", [["pan", "Move"], ["region", "Region"]], viewer.tool, actions.setTool),
    h("span", { key: "zoom", class: "viewer-zoom" },
      zoomButton("−", "Zoom out", "-"), zoomButton("+", "Zoom in", "+"), zoomButton("Fit", "Fit into the window", "0"), zoomButton("1:1", "1:1, one pixel to one", "z")),
    h("label", { key: "histogram", class: "check" }, h("input", { type: "checkbox", id: "histogram", ".checked": viewer.histogram, onchange: actions.toggleHistogram }), "Histogram"));
}

const zoomButton = (text, label, key) => h("button", { key, type: "button", class: "small", "aria-label": label, onclick: () => document.querySelector("float-view")?.press(key) }, text);

const pick = (id, label, options, chosen, onChoose, disabled = false) => h("span", { key: id, class: "viewer-tool" },
  h("label", { for: `view-${id}` }, label),
  h("select", { id: `view-${id}`, disabled, ".value": chosen, onchange: (event) => onChoose(event.currentTarget.value) }, options.map(([value, text]) => h("option", { key: value, value, selected: value === chosen }, text))));

function others(state, viewer) {
  const jobs = comparable(state, viewer);
  const known = jobs.some((job) => job.id === viewer.view.other);
  return [["", "nothing"], ...(viewer.view.other && !known ? [[viewer.view.other, viewer.view.other]] : []), ...jobs.map((job, i) => [job.id, [`${i < 8 ? `${i + 2}: ` : ""}${describe(job)}`, moment(job.submitted_unix), job.id].join(" · ")])];
}

function compareTools(state, viewer, fits, second, actions) {
  const { b, view } = viewer;
  return h("div", { key: "compare", class: "viewer-tools" },
    pick("with", "Compare with", viewer.file ? [["", "nothing"], ["file", viewer.file], ...others(state, viewer).slice(1)] : others(state, viewer), viewer.file ? "file" : view.other ?? "", (id) => (id === "file" ? null : actions.compare(id))),
    h("span", { key: "file", class: "chooser button small" }, h("label", { for: "reference" }, "A file …"),
      h("input", { id: "reference", type: "file", accept: ".exr", onchange: (event) => (event.currentTarget.files[0] ? actions.compareFile(event.currentTarget.files[0]) : null) })),
    b ? choice("by", "How they are compared", kCompared, view.by, (by) => actions.look({ by })) : null,
    b && !fits ? h("p", { key: "size", class: "field-error" }, `The other picture has ${b.size[0]} × ${b.size[1]} pixels: only pictures of the same size can be compared.`) : null,
    fits && !second ? h("p", { key: "layer", class: "field-error" }, "The other picture does not have this layer.") : null);
}

/** Which part of a job that renders gets the next samples first. */
function focusTools(state, viewer, job, actions) {
  const { region } = viewer.view;
  if (!job || isOver(job) || (!job.focus && !(region && mayChange(state)))) return null;
  const fresh = region && String(region) !== String(job.focus);
  const button = (key, label, rect) => h("button", { key, type: "button", class: "small", onclick: () => actions.focus(rect) }, label);
  return h("p", { key: "focus", class: "viewer-tools viewer-focus", role: "status" },
    job.focus ? h("span", { key: "now" }, h("i", { "aria-hidden": "true" }), `Rendered first: ${job.focus[0]}, ${job.focus[1]} to ${job.focus[2]}, ${job.focus[3]}`) : null,
    fresh && mayChange(state) ? button("first", "Render the region first", region) : null,
    job.focus && mayChange(state) ? button("alike", "Render no part first", null) : null);
}

const listed = (values, digits = 4) => (values ? values.map((v) => (Number.isNaN(v) ? kAbsent : figure(v, digits))).join("  ") : kAbsent);

function reading(viewer, layer, second) {
  const { probe, figures, view } = viewer;
  const colours = coloursOf(view, layer, second);
  return h("div", { key: "reading", class: "viewer-reading number", "aria-live": "polite" },
    h("p", { key: "pixel" }, probe?.pixel ? `Pixel ${probe.pixel[0]}, ${probe.pixel[1]}` : "Point at a pixel to read its values."),
    probe?.values && probe.layer === layer.name ? values(probe, layer, second) : null,
    view.matte.length && kindOf(layer) === "matte" ? h("p", { key: "matte" }, "Selected: ", h("b", null, view.matte.join(", "))) : null,
    second && view.by === "flip" && viewer.flip !== null ? h("p", { key: "flip" }, "FLIP ", h("b", null, figure(viewer.flip)), " of what is seen") : null,
    colours ? h("p", { key: "colours", class: "viewer-legend" }, legend(colours)) : null,
    view.region ? regionText(view.region, figures) : null);
}

/** How often which values occur in the layer. */
function histogram(survey, layer) {
  if (survey?.layer !== layer.name) return h("p", { key: "histogram", class: "help" }, kindOf(layer) === "matte" ? "Objects have no histogram." : "Computing the histogram …");
  const { counts, least, most, from, logarithmic } = survey;
  const bins = counts[0].length;
  const highest = Math.max(1, ...counts.flat());
  const line = (row) => row.map((n, i) => `${i},${(40 - (40 * n) / highest).toFixed(2)}`).join(" ");
  return h("figure", { key: "histogram", class: "viewer-histogram" },
    h("svg", { viewBox: `0 0 ${bins - 1} 40`, preserveAspectRatio: "none", role: "img", "aria-label": `Histogram of ${layerName(layer)}, values from ${figure(least)} to ${figure(most)}` },
      counts.map((row, c) => h("polyline", { key: c, class: counts.length === 3 ? `channel-${c}` : "channel", points: line(row) }))),
    h("figcaption", { class: "dim number" }, h("span", null, figure(from)), h("span", null, logarithmic ? "values of the whole picture, logarithmic" : "values of the whole picture"), h("span", null, figure(most))));
}

/** What the colours mean, if they stand for numbers. */
function coloursOf(view, layer, second) {
  if (second && (view.by === "relmse" || view.by === "flip")) return view.by;
  if (kindOf(layer) === "ramp") return layer.name;
  if (view.overlay && overlaysOf(layer).some(([name]) => name === view.overlay)) return view.overlay;
  return view.falseColour && kindOf(layer) === "colour" ? "false" : null;
}

function values(probe, layer, second) {
  if (kindOf(layer) === "matte") {
    const ids = [0, 2, 4].filter((at) => probe.values[at] !== 0);
    return h("p", { key: "values" }, ids.length ? ids.map((at, i) => [i ? ", " : null, h("b", { key: at }, nameOf(layer, probe.values[at])), ` ${Math.round(100 * probe.values[at + 1])} %`]) : "nothing here");
  }
  const row = (v, i) => h("span", { key: i, class: "viewer-value" }, `${layer.channels[i]} `, h("b", null, Number.isNaN(v) ? "no samples yet" : figure(v, 4)), probe.error && !Number.isNaN(v) ? ` ± ${figure(probe.error[i], 2)}` : null);
  return [
    h("p", { key: "values" }, probe.values.map((v, i) => [i ? " " : null, row(v, i)])),
    probe.samples !== null && probe.samples !== undefined && layer.name !== "spp" && !Number.isNaN(probe.samples) ? h("p", { key: "samples" }, `${spp(probe.samples)} samples`) : null,
    second && probe.second ? h("p", { key: "second" }, "Second ", h("b", null, listed(probe.second))) : null,
  ];
}

function regionText(region, figures) {
  const place = `Region ${region[0]}, ${region[1]} to ${region[2]}, ${region[3]}`;
  if (!figures) return h("p", { key: "region" }, place);
  const mean = (v, c) => [h("span", { key: c, class: "viewer-value" }, `${"RGB"[c]} `, h("b", null, figure(v, 4)), ` ± ${figure(figures.error[c], 2)}`), " "];
  return h("p", { key: "region" }, `${place}: mean `, figures.mean.map(mean), figures.relmse === null ? null : ["relMSE ", h("b", { key: "relmse" }, figure(figures.relmse))], figures.level > 0 ? ` of blocks of ${2 ** figures.level} × ${2 ** figures.level} pixels` : null);
}

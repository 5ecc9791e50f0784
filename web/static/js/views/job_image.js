// The live image or a map over it, the tiles being rendered, and the exposure slider or the map's legend.
import { h } from "../dom.js";
import { colourOf, displayOf, doneFrames, isOver, layerOf } from "../state.js";
import { exposure as exposureText, jobName } from "../format.js";
import { viewHref } from "../route.js";
import { choice, safeClass } from "./pieces.js";

const kLayers = [["picture", "Picture"], ["error", "Error"], ["samples", "Samples"]];
const kDenoised = [kLayers[0], ["denoised", "Denoised"], ...kLayers.slice(1)]; // layers of a job with denoising
const isPicture = (layer) => layer === "picture" || layer === "denoised";
const kNames = { picture: "as it is now", denoised: "denoised as it is now", error: "error of each pixel", samples: "samples of each pixel" };
// The values at the ends of the maps' colour scale (core/image/exr/maps.h); the values between are spaced
// by equal factors.
const kLegends = { error: ["0.1 %", "100 % or more", "relative standard error of a pixel"], samples: ["2", "16,384 or more", "samples of a pixel"] };
// Further legends for the viewer (js/viewer/tone.js).
const kFurther = { spp: kLegends.samples, false: ["1/256", "256", "brightness after exposure"], relmse: ["10⁻⁶", "1 or more", "relMSE of a pixel"], flip: ["0", "1", "FLIP, visible difference"] };
const kMarks = 512; // most marks drawn; a thousand workers would not be legible anyway

export function imagePanel(state, job, actions) {
  const { open } = state;
  const layer = layerOf(open, job);
  const [width, height] = job.size ?? [16, 9];
  return h("figure", { class: "panel image" },
    h("div", { class: open.film ? "stage films" : "stage", style: { "--ratio": `${width} / ${height}` } },
      job.sequence ? h("frame-film", { key: "film", "aria-hidden": "true", ".model": filmOf(state, job, actions), onturned: (event) => actions.turnFilm(event.detail) }) : null,
      h("live-image", {
        key: job.id, "aria-label": `${jobName(job)}, ${kNames[layer]}`, role: "img",
        ".size": width * 65536 + height, ".source": actions.image, ".exposure": isPicture(layer) ? open.exposure : 0, ".version": `${layer} ${isPicture(layer) ? displayOf(state) : ""} ${open.folds}`,
      }),
      open.showTiles && !open.film ? overlay(state, width, height) : null,
      job.units_done ? null : h("p", { class: "stage-text" }, stageText(job))),
    h("figcaption", { class: "image-tools" },
      choice("layer", "What is shown", job.denoise ? kDenoised : kLayers, layer, actions.setLayer),
      isPicture(layer) ? [exposureTool(open, actions), displayTool(state, actions)] : legend(layer, job.few_hits),
      h("a", { key: "viewer", class: "to-viewer", href: viewHref(job.id) }, "Open in the viewer"),
      h("label", { class: "check" }, h("input", { type: "checkbox", ".checked": open.showTiles, onchange: actions.toggleTiles }), "Tiles being rendered")));
}

/** What <frame-film> shows; the picture of the frame before stays below an image that has not come yet. */
function filmOf(state, job, actions) {
  const { film, fps, shown, exposure } = state.open;
  const layer = layerOf(state.open, job);
  return {
    ids: doneFrames(state.jobs.get(job.sequence)).map((frame) => frame.id), at: film?.id ?? null, playing: Boolean(film?.playing), fps, shown,
    version: `${layer} ${isPicture(layer) ? `${exposure} ${displayOf(state)}` : 0}`, load: actions.filmPicture, small: smallPicture,
  };
}

const smallPicture = (id) => [...document.querySelectorAll("img[data-small]")].find((img) => img.dataset.small === id && img.complete && img.naturalWidth > 0) ?? null;

const exposureTool = (open, actions) => h("span", { key: "exposure", class: "image-tool" },
  h("label", { for: "exposure" }, "Exposure"),
  h("input", {
    id: "exposure", type: "range", min: -6, max: 6, step: 0.25, ".value": String(open.exposure), "aria-valuetext": exposureText(open.exposure),
    oninput: actions.onExposure, ondblclick: actions.resetExposure,
  }),
  h("output", { for: "exposure", class: "number" }, exposureText(open.exposure)));

const displayTool = (state, actions) => h("span", { key: "display", class: "image-tool" },
  h("label", { for: "display" }, "View"),
  h("select", { id: "display", ".value": displayOf(state), onchange: (event) => actions.setDisplay(event.currentTarget.value) },
    state.displays.views.map((name) => h("option", { key: name, value: name, selected: name === displayOf(state) }, name))));

export function legend(layer, fewHits = 0) {
  const [least, most, meaning] = kLegends[layer] ?? kFurther[layer];
  return h("span", { key: "legend", class: "image-tool legend", title: meaning },
    h("span", { class: "unseen" }, `${meaning}, from `), least, h("i", { "aria-hidden": "true" }), h("span", { class: "unseen" }, " to "), most,
    layer === "error" && fewHits > 0 ? h("span", { key: "few", class: "few-hits" }, "too few samples found light") : null);
}

function stageText(job) {
  if (isOver(job)) return "No sample was taken.";
  if (job.state === "paused") return "Paused before the first tile";
  return job.state === "queued" ? "Waiting for a worker" : "The first tiles are being rendered";
}

function overlay(state, width, height) {
  const { tiles, flashes } = state.open;
  return h("svg", { key: "overlay", class: "overlay", viewBox: `0 0 ${width} ${height}`, "aria-hidden": "true" },
    flashes.map(({ key, rect, worker }) => h("rect", {
      key: `flash${key}`, class: `flash worker-${colourOf(state, worker)}`, x: rect[0], y: rect[1], width: rect[2] - rect[0], height: rect[3] - rect[1],
    })),
    [...tiles.values()].slice(0, kMarks).map((tile) => h("path", {
      key: `tile${tile.tile}`, class: `mark-tile worker-${safeClass(colourOf(state, tile.workers.at(-1)))}`, "data-tile": tile.tile, d: corners(tile.rect),
    })));
}

/** Four corner brackets just inside a rectangle. */
function corners([x0, y0, x1, y1]) {
  const inset = 0.04 * Math.min(x1 - x0, y1 - y0);
  const arm = 0.2 * Math.min(x1 - x0, y1 - y0);
  const [l, t, r, b] = [x0 + inset, y0 + inset, x1 - inset, y1 - inset];
  return `M${l} ${t + arm}V${t}H${l + arm} M${r - arm} ${t}H${r}V${t + arm} M${r} ${b - arm}V${b}H${r - arm} M${l + arm} ${b}H${l}V${b - arm}`;
}

// The storybook: demo.html?view=NAME shows one view from fixed data, without a farm; demo.html lists them.
import "../js/live_image.js";
import "../js/viewer/float_view.js";
import { h, patch } from "../js/dom.js";
import { layerOf, withList, withOpen, withUi, withViewer } from "../js/state.js";
import { page } from "../js/views/shell.js";
import { paint, paintMap } from "./picture.js";
import { stories } from "./stories.js";

const app = document.getElementById("app");
const story = stories[new URLSearchParams(window.location.search).get("view")];

function show(state) {
  const set = (next) => show(next);
  const nothing = () => {};
  const live = {
    confirm: (id) => set(withUi(state, { confirming: id })),
    pickPoint: (wanted) => {
      const picked = typeof wanted === "function" ? wanted(state.open.picked) : wanted;
      if (picked !== state.open.picked) set(withOpen(state, { picked }));
    },
    onExposure: (event) => set(withOpen(state, { exposure: Number(event.currentTarget.value) })),
    toggleTiles: () => set(withOpen(state, { showTiles: !state.open.showTiles })),
    setLayer: (layer) => set(withOpen(state, { layer })),
    setClock: (clock) => set(withOpen(state, { clock, picked: null })),
    look: (more) => set(withViewer(state, { view: { ...state.viewer.view, ...more } })),
    thumbnail: () => async () => paint(80, 45, 1, 0),
    pickJob: (id) => set(withList(state, { picked: new Set([...state.list.picked, id]) })),
    image: imageOf(state),
  };
  // Every other action needs a farm.
  const actions = new Proxy(live, { get: (all, name) => all[name] ?? nothing });
  patch(app, ...page(state, actions));
}

const images = new Map();
function imageOf(state) {
  const job = state.jobs?.get(state.open?.shown ?? state.route.id);
  if (!job) return null;
  const layer = state.open ? layerOf(state.open, job) : "picture";
  const key = `${job.id} ${layer}`;
  if (!images.has(key)) {
    images.set(key, async (exposure) => {
      if (job.units_done === 0) throw new Error("nothing folded yet");
      const done = job.state === "running" ? 0.52 : 1;
      return layer === "picture" || layer === "denoised" ? paint(job.size[0], job.size[1], done, exposure) : paintMap(job.size[0], job.size[1], done, layer);
    });
  }
  return images.get(key);
}

if (story) {
  show({ ...story(), narrow: window.matchMedia("(max-width: 40rem)").matches });
} else {
  patch(app, h("main", null, h("h1", null, "Storybook"), h("ul", null, Object.keys(stories).map((name) => h("li", { key: name }, h("a", { href: `?view=${name}` }, name))))));
}

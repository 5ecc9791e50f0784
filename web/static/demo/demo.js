// The storybook: demo.html?view=NAME shows one view from fixed data, without a farm; demo.html lists them.
import "../js/live_image.js";
import { h, patch } from "../js/dom.js";
import { withOpen, withUi } from "../js/state.js";
import { page } from "../js/views/shell.js";
import { paint } from "./picture.js";
import { stories } from "./stories.js";

const app = document.getElementById("app");
const story = stories[new URLSearchParams(window.location.search).get("view")];

function show(state) {
  const set = (next) => show(next);
  const nothing = () => {};
  const live = {
    confirm: (id) => set(withUi(state, { confirming: id })),
    pick: (picked) => (picked === state.open.picked ? null : set(withOpen(state, { picked }))),
    onExposure: (event) => set(withOpen(state, { exposure: Number(event.currentTarget.value) })),
    toggleTiles: () => set(withOpen(state, { showTiles: !state.open.showTiles })),
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
  if (!images.has(job.id)) {
    images.set(job.id, async (exposure) => {
      if (job.units_done === 0) throw new Error("nothing folded yet");
      return paint(job.size[0], job.size[1], job.state === "running" ? 0.52 : 1, exposure);
    });
  }
  return images.get(job.id);
}

if (story) {
  show(story());
} else {
  patch(app, h("main", null, h("h1", null, "Storybook"), h("ul", null, Object.keys(stories).map((name) => h("li", { key: name }, h("a", { href: `?view=${name}` }, name))))));
}

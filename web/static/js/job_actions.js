// What a person can do to a job and to its page.
import { withJob, withOpen, withUi } from "./state.js";

export function makeJobActions({ get, set, attempt, api }) {
  async function change(id, wanted) {
    set(withUi(get(), { busy: id, confirming: null }));
    const done = await attempt(() => api.setState(id, wanted));
    const job = done && (await attempt(() => api.job(id)));
    const next = withUi(get(), { busy: null });
    set(job ? withJob(next, job) : next);
  }

  return {
    setState: change,
    cancel: (id) => change(id, "cancelled"),
    confirm: (id) => set(withUi(get(), { confirming: id })),
    image: (exposure, signal) => {
      const { shown, layer } = get().open;
      if (layer === "picture" || layer === "denoised") return api.image(shown, exposure, layer, signal);
      return api.map(shown, layer, signal);
    },
    setLayer: (layer) => set(withOpen(get(), { layer })),
    setClock: (clock) => set(withOpen(get(), { clock, picked: null })),
    onExposure: (event) => set(withOpen(get(), { exposure: Number(event.currentTarget.value) })),
    resetExposure: () => set(withOpen(get(), { exposure: 0 })),
    toggleTiles: () => set(withOpen(get(), { showTiles: !get().open.showTiles })),
    pick: (picked) => (get().open && get().open.picked !== picked ? set(withOpen(get(), { picked })) : null),
  };
}

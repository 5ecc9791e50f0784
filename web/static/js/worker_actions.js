// What the user can do with workers and their list.
import { withUi } from "./state.js";

export function makeWorkerActions({ get, set, attempt, api }) {
  const list = (more) => set({ ...get(), workerList: { ...get().workerList, ...more } });
  return {
    searchWorkers: (search) => list({ search }),
    sortWorkers: (sort, descending) => list({ sort, descending }),
    /** The event stream tells when the worker has heard of it. */
    drainWorker: async (id) => {
      set(withUi(get(), { busy: `worker ${id}`, confirming: null }));
      await attempt(() => api.drainWorker(id));
      set(withUi(get(), { busy: null }));
    },
  };
}

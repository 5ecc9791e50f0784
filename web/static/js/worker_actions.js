// What the user can do with workers and their list.
import { withUi } from "./state.js";
import { queryOfWorkers, workersOf } from "./worker_list.js";

export function makeWorkerActions({ get, set, attempt, api }) {
  let typing = false; // the latest step of the history is a search that is being typed

  /** Each change is a step of the browser's history, so that Back undoes it; a word that is typed is one step. */
  function list(more, typed = false) {
    const workerList = { ...get().workerList, ...more };
    set({ ...get(), workerList });
    const query = queryOfWorkers(workerList);
    window.history[typed && typing ? "replaceState" : "pushState"](null, "", `#/workers${query ? `?${query}` : ""}`);
    typing = typed;
  }
  return {
    openWorkers: (query) => {
      typing = false;
      set({ ...get(), workerList: workersOf(query) });
    },
    searchWorkers: (search) => list({ search }, true),
    chooseTag: (tag) => list({ tag }),
    /** largest: the first press puts the largest first; each further one turns the order round. */
    sortWorkers: (name, largest) => {
      const { sort, descending } = get().workerList;
      list({ sort: name, descending: sort === name ? !descending : largest });
    },
    /** Opens the log of a worker, or closes it if it is the one that is open. */
    showWorkerLog: async (id) => {
      if (get().workerLog?.id === id) return set({ ...get(), workerLog: null });
      set({ ...get(), workerLog: { id, text: null } });
      const text = await attempt(() => api.workerLog(id));
      if (get().workerLog?.id === id) set({ ...get(), workerLog: text === undefined ? null : { id, text } });
    },
    /** The event stream tells when the worker has heard of it. */
    setWorkerState: async (id, state) => {
      set(withUi(get(), { busy: `worker ${id}`, confirming: null }));
      await attempt(() => api.setWorkerState(id, state));
      set(withUi(get(), { busy: null }));
    },
  };
}

// What the user can do with the list of jobs: filter it, change the page, and act on several jobs at once.
import { listOf, parametersOf, queryOfList } from "./job_list.js";
import { withList, withListed, withoutJob, withUi } from "./state.js";

const kTypingPauseMs = 250;
const kRefreshPauseMs = 1000;

export function makeListActions({ get, set, attempt, api, snapshot }) {
  let timer = 0;
  let lastMs = -Infinity;

  /** Fetches the page that is to be seen; `after` milliseconds from now at the earliest. */
  function refreshList(after = 0) {
    clearTimeout(timer);
    const wait = Math.max(after, lastMs + kRefreshPauseMs - performance.now());
    if (after === 0) return fetchList();
    timer = setTimeout(fetchList, wait);
    return undefined;
  }

  async function fetchList() {
    clearTimeout(timer);
    lastMs = performance.now();
    const asked = get().list.asked;
    await snapshot("jobs", () => attempt(() => api.list(parametersOf(asked, Date.now() / 1000))), (now, page) => (now.list.asked === asked ? withListed(now, page) : now));
  }

  function narrow(more, pause = 0) {
    const asked = { ...get().list.asked, page: 0, ...more };
    set(withList(get(), { asked, picked: new Set() }));
    const query = queryOfList(asked);
    window.history.replaceState(null, "", `#/jobs${query ? `?${query}` : ""}`);
    refreshList(pause);
  }

  /** Does one thing to all that are picked, one after the other; what can't be done is said, and stays picked. */
  async function forPicked(act) {
    const failed = new Map();
    set(withUi(get(), { busy: "picked", confirming: null }));
    for (const id of get().list.picked) {
      try {
        await act(id);
      } catch (error) {
        failed.set(id, error.message);
      }
    }
    const text = failed.size ? `${failed.size === 1 ? "One job was" : `${failed.size} jobs were`} left as they are: ${[...failed.values()][0]}` : null;
    set(withUi(withList(get(), { picked: new Set(failed.keys()) }), { busy: null, notice: text }));
    await fetchList();
  }

  const pick = (ids, wanted) => {
    const picked = new Set(get().list.picked);
    for (const id of ids) wanted ? picked.add(id) : picked.delete(id);
    set(withList(get(), { picked }));
  };

  return {
    /** Of the address. */
    openList: (query) => {
      const asked = listOf(query);
      if (queryOfList(asked) === queryOfList(get().list.asked) && get().list.ids) return;
      set(withList(get(), { asked, picked: new Set() }));
      refreshList();
    },
    refreshList,
    narrow,
    typeSearch: (event) => narrow({ search: event.currentTarget.value }, kTypingPauseMs),
    toggleState: (state) => {
      const { states } = get().list.asked;
      narrow({ states: states.includes(state) ? states.filter((one) => one !== state) : [...states, state] });
    },
    turnPage: (page) => {
      narrow({ page });
      window.scrollTo(0, 0);
    },
    pickJob: (id) => pick([id], !get().list.picked.has(id)),
    pickPage: (wanted) => pick(get().list.ids, wanted),
    cancelPicked: () => forPicked((id) => api.setState(id, "cancelled")),
    removePicked: () => forPicked(async (id) => {
      await api.remove(id);
      if (get().jobs?.get(id)?.state !== "running") set(withoutJob(get(), id));
    }),
    thumbnail: (id) => (exposure, signal) => api.thumbnail(id, signal),
  };
}

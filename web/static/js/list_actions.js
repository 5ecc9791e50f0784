// What the user can do with the list of jobs: filter it, change the page, and act on several jobs at once.
import { listOf, parametersOf, queryOfList, turned } from "./job_list.js";
import { withList, withListed, withoutJob, withUi } from "./state.js";

const kTypingPauseMs = 250;
const kRefreshPauseMs = 1000;
const kAnnouncedPauseMs = 10000;
const kAtOnce = 4; // requests, of those that change several jobs
const kMostListed = 1000; // jobs that the coordinator lists at once

export function makeListActions({ get, set, attempt, api, snapshot }) {
  let timer = 0;
  let lastMs = -Infinity;
  let typing = false; // the latest step of the history is a search that is being typed
  let anchor = null; // the job that was selected last: where a range begins

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

  /** No event tells of announced jobs, so they are asked for again and again while the list is seen. */
  async function refreshAnnounced() {
    const { me, session, route } = get();
    if (session !== "in" || route.view !== "jobs" || document.hidden) return;
    const announced = await api.announced().catch(() => null); // of an older coordinator: none
    if (announced !== null && get().session === "in" && get().me === me) set({ ...get(), announced });
  }
  setInterval(refreshAnnounced, kAnnouncedPauseMs);
  document.addEventListener("visibilitychange", refreshAnnounced);

  /** Each change is a step of the browser's history, so that Back undoes it; a word that is typed is one step. */
  function narrow(more, typed = false) {
    const asked = { ...get().list.asked, page: 0, ...more };
    set(withList(get(), { asked, picked: new Set() }));
    const query = queryOfList(asked);
    window.history[typed && typing ? "replaceState" : "pushState"](null, "", `#/jobs${query ? `?${query}` : ""}`);
    typing = typed;
    refreshList(typed ? kTypingPauseMs : 0);
  }

  /** Does one thing to all that are picked, a few at once; what can't be done is said, and stays picked. */
  async function forPicked(act) {
    const failed = new Map();
    const { picked } = get().list;
    const left = [...picked];
    set(withUi(get(), { busy: "picked", confirming: null }));
    const work = async () => {
      for (let id = left.shift(); id !== undefined; id = left.shift()) {
        set(withList(get(), { doing: `${picked.size - left.length} of ${picked.size}` }));
        try {
          await act(id);
        } catch (error) {
          failed.set(id, error.message);
        }
      }
    };
    await Promise.all(Array.from({ length: kAtOnce }, work));
    const text = failed.size ? `${failed.size === 1 ? "One job was" : `${failed.size} jobs were`} left as they are: ${[...failed.values()][0]}` : null;
    set(withUi(withList(get(), { picked: new Set(failed.keys()), doing: null }), { busy: null, notice: text }));
    await fetchList();
  }

  const pick = (ids, wanted) => {
    const picked = new Set(get().list.picked);
    for (const id of ids) wanted ? picked.add(id) : picked.delete(id);
    set(withList(get(), { picked }));
  };

  /** All jobs that match, on all pages. */
  async function pickAll() {
    const { asked } = get().list;
    const ids = new Set();
    set(withUi(get(), { busy: "picked" }));
    for (let page = 0; ; page += 1) {
      const part = await attempt(() => api.list(parametersOf({ ...asked, page }, Date.now() / 1000, kMostListed)));
      for (const { id } of part?.jobs ?? []) ids.add(id);
      set(withList(get(), { doing: `${ids.size} found` }));
      if (!part || part.jobs.length === 0 || ids.size >= part.total) break;
    }
    set(withUi(withList(get(), { doing: null, ...(get().list.asked === asked ? { picked: ids } : {}) }), { busy: null }));
  }

  /** With `range`, all from the one that was selected last to this one. */
  function pickJob(id, range) {
    const { ids, picked } = get().list;
    const wanted = !picked.has(id);
    const [from, to] = [anchor, id].map((one) => (ids ?? []).indexOf(one)).sort((a, b) => a - b);
    pick(range && from >= 0 && to >= 0 ? ids.slice(from, to + 1) : [id], wanted);
    anchor = id;
  }

  return {
    /** Of the address. */
    openList: (query) => {
      typing = false;
      if (get().link === "live") refreshAnnounced();
      const asked = listOf(query);
      if (queryOfList(asked) === queryOfList(get().list.asked) && get().list.ids) return;
      set(withList(get(), { asked, picked: new Set() }));
      refreshList();
    },
    refreshList,
    refreshAnnounced,
    narrow,
    typeSearch: (event) => narrow({ search: event.currentTarget.value }, true),
    sortBy: (first) => narrow({ sort: turned(get().list.asked.sort, first) }),
    toggleState: (state) => {
      const { states } = get().list.asked;
      narrow({ states: states.includes(state) ? states.filter((one) => one !== state) : [...states, state] });
    },
    turnPage: (page) => {
      narrow({ page });
      window.scrollTo(0, 0);
    },
    pickJob,
    pickAll,
    pickPage: (wanted) => (wanted ? pick(get().list.ids, true) : set(withList(get(), { picked: new Set() }))),
    pausePicked: () => forPicked((id) => api.setState(id, "paused")),
    resumePicked: () => forPicked((id) => api.setState(id, "running")),
    setPriorityOfPicked: (priority) => forPicked((id) => api.change(id, { priority })),
    cancelPicked: () => forPicked((id) => api.setState(id, "cancelled")),
    removePicked: () => forPicked(async (id) => {
      await api.remove(id);
      if (get().jobs?.get(id)?.state !== "running") set(withoutJob(get(), id));
    }),
    thumbnail: (id) => (exposure, signal) => api.thumbnail(id, signal),
  };
}

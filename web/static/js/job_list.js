// Converts the selection of listed jobs to the address bar and back:
// #/jobs?search=bath&state=running,failed&owner=anna&days=7&sort=-relmse&page=2.

export const kPageSize = 50;
export const kStates = ["running", "queued", "paused", "done", "failed", "cancelled"];
/** By what the list is narrowed: a state, or "held": queued, and waiting for other jobs. */
export const kFilters = ["running", "queued", "held", "paused", "done", "failed", "cancelled"];
export const kSorts = [["active", "Rendering first"], ["-submitted", "Newest first"], ["submitted", "Oldest first"], ["name", "Name"], ["-name", "Name, last first"], ["owner", "Owner"], ["-owner", "Owner, last first"], ["state", "State"], ["-state", "State, last first"],
  ["-progress", "Most progress"], ["progress", "Least progress"], ["relmse", "Smallest error"], ["-relmse", "Largest error"]];
export const kAges = [["", "any time"], ["1", "last day"], ["7", "last 7 days"], ["30", "last 30 days"]];

export const kWholeList = { search: "", states: [], owner: null, days: "", sort: "active", page: 0 };

const one = (options, value, otherwise) => (options.some(([name]) => name === value) ? value : otherwise);

export function listOf(query) {
  const of = new URLSearchParams(query);
  const page = Number(of.get("page") ?? 1);
  return {
    search: (of.get("search") ?? "").slice(0, 200),
    states: (of.get("state") ?? "").split(",").filter((state) => kFilters.includes(state)),
    owner: of.get("owner"),
    days: one(kAges, of.get("days"), ""),
    sort: one(kSorts, of.get("sort"), "active"),
    page: Number.isInteger(page) && page > 0 && page < 1e6 ? page - 1 : 0,
  };
}

/** The list as part of an address; what is as it is at first is left out. */
export function queryOfList({ search, states, owner, days, sort, page }) {
  const of = new URLSearchParams();
  if (search) of.set("search", search);
  if (states.length) of.set("state", states.join());
  if (owner !== null) of.set("owner", owner);
  if (days) of.set("days", days);
  if (sort !== "active") of.set("sort", sort);
  if (page) of.set("page", String(page + 1));
  return of.toString();
}

/** The parameters of the coordinator for it. */
export function parametersOf({ search, states, owner, days, sort, page }, nowSeconds, size = kPageSize) {
  const of = new URLSearchParams({ sort, limit: String(size), offset: String(page * size) });
  if (search) of.set("search", search);
  if (states.length) of.set("state", states.join());
  if (owner !== null) of.set("owner", owner);
  if (days) of.set("since", String(Math.floor(nowSeconds - Number(days) * 86400)));
  return of.toString();
}

/** The order after a press on the head of a column, whose first order is `first`: the other way round at each further press. */
export const turned = (sort, first) => (sort === first ? (first.startsWith("-") ? first.slice(1) : `-${first}`) : first);

export const isNarrowed = ({ search, states, owner, days }) => search !== "" || states.length > 0 || owner !== null || days !== "";

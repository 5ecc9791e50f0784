// Converts the selection of listed workers to the address bar and back: #/workers?search=gpu+lab&tag=night&sort=-Threads.

export const kAllWorkers = { search: "", tag: "", sort: "Worker", descending: false };

export function workersOf(query) {
  const of = new URLSearchParams(query);
  const sort = of.get("sort") ?? kAllWorkers.sort;
  const descending = sort.startsWith("-");
  return { search: (of.get("search") ?? "").slice(0, 200), tag: of.get("tag") ?? "", sort: descending ? sort.slice(1) : sort, descending };
}

/** The list as part of an address; what is as it is at first is left out. */
export function queryOfWorkers({ search, tag, sort, descending }) {
  const of = new URLSearchParams();
  if (search) of.set("search", search);
  if (tag) of.set("tag", tag);
  if (sort !== kAllWorkers.sort || descending) of.set("sort", `${descending ? "-" : ""}${sort}`);
  return of.toString();
}

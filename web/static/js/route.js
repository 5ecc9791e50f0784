// The address bar: #/jobs, #/jobs/ID, #/workers, #/submit, and #token=... which signs in and leaves no trace.

export function routeOf(hash) {
  const [view, id] = hash.replace(/^#\/?/, "").split("/");
  if (view === "jobs" && id) return { view: "job", id: decoded(id) };
  return { view: ["workers", "submit"].includes(view) ? view : "jobs", id: null };
}

function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text; // a mistyped %: no such job, which the page then says
  }
}

/** The token in the fragment, which is taken out of the address bar and its history entry; null without one. */
export function takeToken(location, history) {
  const match = /^#\/?token=(.+)$/.exec(location.hash);
  if (!match) return null;
  history.replaceState(null, "", `${location.pathname}${location.search}#/jobs`);
  return decoded(match[1]);
}

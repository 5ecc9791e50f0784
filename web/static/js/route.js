// The routes in the address bar: #/jobs, #/jobs/ID, #/jobs/ID/FRAME for a frame of a sequence, #/jobs/ID/log, #/view/ID?VIEW,
// #/workers, #/submit, and #token=..., which signs in and is then removed from the address.

/** The views of one job, which the route names. */
export const kOfJob = new Set(["job", "log", "view"]);

const kNoId = /^\.{1,2}$/; // in an address these lead elsewhere, however they are encoded

export function routeOf(hash) {
  const [path, query = ""] = hash.replace(/^#\/?/, "").split("?");
  const [view, part, frame] = path.split("/");
  const id = part && !kNoId.test(decoded(part)) ? part : null;
  if (view === "view" && id) return { view: "view", id: decoded(id), frame: null, query };
  if (view === "jobs" && id && frame === "log") return { view: "log", id: decoded(id), frame: null };
  if (view === "jobs" && id) return { view: "job", id: decoded(id), frame: /^\d{1,7}$/.test(frame) ? Number(frame) : null };
  return { view: ["workers", "submit"].includes(view) ? view : "jobs", id: null, frame: null, query };
}

/** Of one frame, or (null) of the sequence, whose page then follows what is rendered. */
export const frameHref = (id, frame) => `#/jobs/${encodeURIComponent(id)}${frame === null ? "" : `/${frame}`}`;

/** The page of a job's log; a frame has one of its own. */
export const logHref = (id) => `#/jobs/${encodeURIComponent(id)}/log`;

/** The viewer of a job, or of one frame of a sequence, whose id that frame has. */
export const viewHref = (id, query = "") => `#/view/${encodeURIComponent(id)}${query ? `?${query}` : ""}`;

/** The page of a job, which may be a frame: the page of its sequence, at this frame. */
export function jobHref(id) {
  const frame = frameOf(id);
  return frame ? frameHref(frame.sequence, frame.frame) : frameHref(id, null);
}

/** {sequence, frame} of an id that the coordinator gave to a frame; null of any other. */
export function frameOf(id) {
  const match = /^(.+)-frame(\d{1,7})$/.exec(id ?? "");
  return match ? { sequence: match[1], frame: Number(match[2]) } : null;
}

function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text; // an incomplete % code: there is no such job, and the page will say so
  }
}

/** The token in the fragment, which is taken out of the address bar and its history entry; null without one. */
export function takeToken(location, history) {
  const match = /^#\/?token=(.+)$/.exec(location.hash);
  if (!match) return null;
  history.replaceState(null, "", `${location.pathname}${location.search}#/jobs`);
  return decoded(match[1]);
}

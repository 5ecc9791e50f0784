// The address bar: #/jobs, #/jobs/ID, #/jobs/ID/FRAME of a sequence, #/workers, #/submit, and #token=... which signs in and leaves no trace.

export function routeOf(hash) {
  const [view, id, frame] = hash.replace(/^#\/?/, "").split("/");
  if (view === "jobs" && id) return { view: "job", id: decoded(id), frame: /^\d{1,7}$/.test(frame) ? Number(frame) : null };
  return { view: ["workers", "submit"].includes(view) ? view : "jobs", id: null, frame: null };
}

/** Of one frame, or (null) of the sequence, whose page then follows what is rendered. */
export const frameHref = (id, frame) => `#/jobs/${encodeURIComponent(id)}${frame === null ? "" : `/${frame}`}`;

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

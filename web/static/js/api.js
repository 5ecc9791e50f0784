// All requests to the coordinator's HTTP interface. Every failure becomes an ApiError whose message is for
// the user.

const kBase = "/api/v1";

export class ApiError extends Error {
  /** status 0: no answer at all. diagnostics: of a refused scene, [{severity, file, line, column, text, source_line, length}]. */
  constructor(status, message, diagnostics = []) {
    super(message);
    this.status = status;
    this.diagnostics = diagnostics;
  }
}

async function call(method, path, { headers, body, signal } = {}) {
  let response;
  try {
    response = await fetch(kBase + path, { method, headers, body, signal, credentials: "same-origin", cache: "no-store" });
  } catch (cause) {
    if (cause.name === "AbortError") throw cause;
    throw new ApiError(0, "The coordinator does not answer. Is it still running, and is this machine on its network?");
  }
  if (!response.ok) throw await errorOf(response);
  return response;
}

async function errorOf(response) {
  const type = response.headers.get("Content-Type") ?? "";
  if (type.includes("json")) {
    const problem = await response.json().catch(() => ({}));
    const message = problem.detail || problem.title;
    const diagnostics = Array.isArray(problem.diagnostics) ? problem.diagnostics : [];
    if (message || diagnostics.length) return new ApiError(response.status, message ?? "The scene was refused.", diagnostics);
  }
  return new ApiError(response.status, `The coordinator answered ${response.status} ${response.statusText}`.trim() + ".");
}

const json = (value) => ({ headers: { "Content-Type": "application/json" }, body: JSON.stringify(value) });
const lookOf = (exposure, layer, view) => `exposure=${exposure}${layer === "denoised" ? "&layer=denoised" : ""}${view === "sRGB" ? "" : `&view=${encodeURIComponent(view)}`}`;
const jobPath = (id) => `/jobs/${encodeURIComponent(id)}`;

/** The views of a coordinator that does not say which it has. */
export const kOnlyPlain = { default: "sRGB", views: ["sRGB"] };

export const api = {
  signIn: (token) => call("POST", "/session", json({ token })),
  signOut: () => call("DELETE", "/session"),
  /** {role, user} of the session. */
  me: async () => (await call("GET", "/session")).json(),
  /** {role, user} of a token, whoever is signed in. */
  whoIs: async (token) => (await call("GET", "/session", { headers: { Authorization: `Bearer ${token}` } })).json(),
  /** {jobs, total, states, owners} of a page, see job_list.js. */
  list: async (parameters) => (await call("GET", `/jobs?${parameters}`)).json(),
  /** Jobs that will be submitted once files are complete: [{id, name, owner, machine, frames, files, count, since_unix}]. */
  announced: async () => (await (await call("GET", "/announced")).json()).announced,
  job: async (id) => (await call("GET", jobPath(id))).json(),
  tiles: async (id) => (await (await call("GET", `${jobPath(id)}/tiles`)).json()).tiles,
  log: async (id) => (await call("GET", `${jobPath(id)}/log`)).text(),
  report: async (id) => (await call("GET", `${jobPath(id)}/report`)).json(),
  /** {workers, join}: join says how further ones come in. */
  workers: async () => (await call("GET", "/workers")).json(),
  /** state: "draining", "restarting", or "connected" for one that is one of these and is to stay. */
  setWorkerState: (id, state) => call("PATCH", `/workers/${encodeURIComponent(id)}`, json({ state })),
  workerLog: async (id) => (await call("GET", `/workers/${encodeURIComponent(id)}/log`)).text(),
  remove: (id) => call("DELETE", jobPath(id)),
  again: async (id, changes) => (await call("POST", `${jobPath(id)}/again`, json(changes))).json(),
  thumbnail: async (id, signal) => createImageBitmap(await (await call("GET", `${jobPath(id)}/thumbnail.png`, { signal })).blob()),
  /** Changes a job: {state, focus, ...}; what it is then. */
  change: async (id, changes) => (await call("PATCH", jobPath(id), json(changes))).json(),
  setState: (id, state) => call("PATCH", jobPath(id), json({ state })),
  /** layer: "picture" or "denoised"; view: one of views(). */
  image: async (id, exposure, layer, view, signal) => createImageBitmap(await (await call("GET", `${jobPath(id)}/image.png?${lookOf(exposure, layer, view)}`, { signal })).blob()),
  /** {default, views}: how colours can be shown. */
  views: () => call("GET", "/views").then((answer) => answer.json(), () => kOnlyPlain),
  /** A view as a table, see viewer/display.js. */
  viewCube: async (view) => (await call("GET", `/views/cube?view=${encodeURIComponent(view)}`)).arrayBuffer(),
  /** kind: "error" or "samples". */
  map: async (id, kind, signal) => createImageBitmap(await (await call("GET", `${jobPath(id)}/${kind}.png`, { signal })).blob()),
  /** {size, max_level, layers: [{name, channels, format, blocks, names}]}. */
  layers: async (id) => (await call("GET", `${jobPath(id)}/layers`)).json(),
  /** The numbers of a rectangle of a mip level, as an ArrayBuffer. */
  pixels: async (id, layer, level, rect) =>
    (await call("GET", `${jobPath(id)}/pixels?layer=${encodeURIComponent(layer)}&level=${level}&rect=${rect.join()}`)).arrayBuffer(),
  /** {relmse, relmse_ci95, trusted, verdict} of a mix of light groups. */
  mix: async (id, mix) => (await call("GET", `${jobPath(id)}/mix?mix=${encodeURIComponent(mix)}`)).json(),
  /** {state, frames, frames_done, fps, exposure, bytes, error}. */
  video: async (id) => (await call("GET", `${jobPath(id)}/video`)).json(),
  makeVideo: async (id, asked) => (await call("POST", `${jobPath(id)}/video`, json(asked))).json(),
  missingBlobs: async (digests) => (await (await call("POST", "/blobs/missing", json({ digests }))).json()).missing,
  putBlob: (digest, body) =>
    call("PUT", `/blobs/${digest}`, { headers: { "Content-Type": "application/octet-stream" }, body }),
  /** A scene with all its files in one archive; `spec` as in submit, and the job's name. */
  submitArchive: async (file, type, spec) => {
    const text = (value) => (Array.isArray(value) ? value.join(",") : String(value));
    const query = new URLSearchParams(Object.entries(spec).map(([name, value]) => [name, name === "size" ? value.join("x") : text(value)]));
    return (await call("POST", `/jobs?${query}`, { headers: { "Content-Type": type }, body: file })).json();
  },
  submit: async (request) => (await call("POST", "/jobs", json(request))).json(),
};

/** Addresses of files that the browser downloads by itself. */
export const downloads = {
  /** mix: of light groups; without one the image itself. */
  exr: (id, mix = null) => `${kBase}${jobPath(id)}/image.exr${mix === null ? "" : `?mix=${encodeURIComponent(mix)}`}`,
  deep: (id) => `${kBase}${jobPath(id)}/deep.exr`,
  png: (id, exposure, layer, view) => `${kBase}${jobPath(id)}/image.png?${lookOf(exposure, layer, view)}`,
  meters: (id) => `${kBase}${jobPath(id)}/meters`,
  report: (id) => `${kBase}${jobPath(id)}/report`,
  page: (id) => `${kBase}${jobPath(id)}/report.html`,
  csv: (id) => `${kBase}${jobPath(id)}/convergence.csv`,
  thumbnail: (id, version) => `${kBase}${jobPath(id)}/thumbnail.png?v=${version}`,
  video: (id) => `${kBase}${jobPath(id)}/video.mp4`,
  log: (id) => `${kBase}${jobPath(id)}/log`,
};

// Submits a job: computes the SHA-256 of every file, asks the coordinator which ones it lacks, sends these,
// and then the job.
import { sha256 } from "./sha256.js";

/** The `spec` of the contract from the form's texts; empty fields are left to the scene. Throws with a message for people. */
export function specOf({ spp, target_error, time, width, height, frames = "", denoise = false, aov = "", priority = "", seed = "", tags = "" }) {
  const spec = {};
  if (spp) spec.spp = positive(spp, "Samples per pixel", true);
  if (target_error) spec.target_error = positive(target_error, "Target error", false);
  if (time) spec.time = positive(time, "Time limit", false);
  if (Boolean(width) !== Boolean(height)) throw new Error("Give both width and height, or neither.");
  if (width) spec.size = [positive(width, "Width", true), positive(height, "Height", true)];
  if (frames.trim()) spec.frames = range(frames.trim());
  if (denoise) spec.denoise = true;
  for (const [name, text] of [["aov", aov], ["tags", tags]]) if (listIn(text).length) spec[name] = listIn(text);
  if (seed.trim()) spec.seed = whole(seed, "Seed", 0);
  if (priority.trim()) spec.priority = whole(priority, "Priority", -1e6);
  return spec;
}

const listIn = (text) => text.split(/[\s,]+/).filter(Boolean);

function whole(text, what, least) {
  const x = Number(text);
  if (!Number.isInteger(x) || x < least) throw new Error(`${what} must be a whole number${least === 0 ? " of at least 0" : ""}, not “${text}”.`);
  return x;
}

/** The name of the job: the ending of its scene tells the coordinator what kind it is. */
export function nameOf(settings, file) {
  const name = settings.name?.trim();
  const ending = /\.[^.]+$/.exec(file.name)?.[0] ?? "";
  return !name ? file.name : name.toLowerCase().endsWith(ending.toLowerCase()) ? name : `${name}${ending}`;
}

/** The coordinator speaks of blobs and digests to programs; here a person can add the file. */
export const inPlainWords = (text) => text.replace(/was not sent along: name it among the assets, with its SHA-256(; [^\n]*)?/g, "is missing: add this file");

function range(text) {
  if (/^\d+(-\d+(x\d+)?)?$/.test(text)) return text;
  throw new Error(`Frames must be first-last, for example 1-10, or 1-10x2 for every second one, not “${text}”.`);
}

function positive(text, what, whole) {
  const x = Number(text);
  if (!(x > 0) || !Number.isFinite(x) || (whole && !Number.isInteger(x))) {
    throw new Error(`${what} must be a positive ${whole ? "whole number" : "number"}, not “${text}”.`);
  }
  return x;
}

/** plan: of bundle.js. onStep({phase, step, progress}) tells how far it is, progress in 0..1 of the phase. Returns the job's id. */
export async function submitJob(api, plan, settings, onStep) {
  const spec = specOf(settings);
  if (plan.archive) {
    onStep({ phase: "sending", step: `Sending ${plan.main.name}`, progress: 0 });
    const name = settings.name?.trim();
    return (await api.submitArchive(plan.main, plan.archive, { ...spec, ...(name ? { name } : {}) })).id;
  }
  const files = [{ name: null, file: plan.main }, ...plan.assets];
  const digests = await digestAll(files, onStep);
  const missing = new Set(await api.missingBlobs([...new Set(digests)]));
  await sendAll(api, files, digests, missing, onStep);
  const assets = Object.fromEntries(plan.assets.map(({ name }, i) => [name, digests[i + 1]]));
  onStep({ phase: "sending", step: "Submitting the job", progress: 1 });
  return (await api.submit({ name: nameOf(settings, plan.main), scene: digests[0], assets, spec })).id;
}

async function digestAll(files, onStep) {
  const total = files.reduce((sum, { file }) => sum + file.size, 0) || 1;
  const digests = [];
  let before = 0;
  for (const { file } of files) {
    const done = before;
    digests.push(await sha256(file, (n) => onStep({ phase: "hashing", step: `Reading ${file.name}`, progress: (done + n) / total })));
    before += file.size;
  }
  return digests;
}

async function sendAll(api, files, digests, missing, onStep) {
  const toSend = files.filter((_, i) => missing.has(digests[i]) && digests.indexOf(digests[i]) === i);
  const total = toSend.reduce((sum, { file }) => sum + file.size, 0) || 1;
  let sent = 0;
  for (const { file } of toSend) {
    onStep({ phase: "sending", step: `Sending ${file.name}`, progress: sent / total });
    await api.putBlob(digests[files.findIndex((entry) => entry.file === file)], file);
    sent += file.size;
  }
}

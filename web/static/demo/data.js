// Fixed answers of a coordinator, for the storybook and its tests. They have the form of the HTTP interface's
// answers.

const kNow = 1765000000; // unix seconds

const job = (id, name, state, more = {}) => ({
  id, name, state, stopped: "", progress: 0, spp: 512, spp_done: 0, rmse: null, relmse: null, relmse_ci95: null, target_error: null,
  eta_seconds: null, error: "", warnings: [], size: [640, 360], tile: 32, priority: 0, units_done: 0, units_total: 2880,
  elapsed_seconds: 0, core_seconds: 0, submitted_unix: kNow, health: { clean: true, nonfinite: 0, negative: 0, majorant_violations: 0, causes: [] }, ...more,
});

const half = {
  progress: 0.43, spp_done: 214.6, rmse: 0.0312, relmse: 0.00418, relmse_ci95: [0.0039, 0.00448], target_error: 0.001, eta_seconds: 252, eta_ci95: [186, 330], eta_with_more: { workers: 8, seconds: 66, ci95: null },
  units_done: 1240, elapsed_seconds: 187, core_seconds: 742, spp_asked: 512, rmse_ci95: [0.0302, 0.0322], slope: -0.98, slope_ci95: [-1.06, -0.9], efficiency_per_core: 0.322,
  time: { load: 2.1, build: 9.4, render: 742, transfer: 6.2, merge: 3.9, idle: 21.5 },
};

const kTrusted = { kind: "converging", words: "converging as expected", trusted: true };
const kHeavy = { kind: "heavy_tail", words: "don't trust yet: few pixels carry the error (like 16 of 230400; the worst one 25 %); bright outliers may still be missing", trusted: false };
// Only its target ends this job, and its error is unknown because of a few bright pixels.
const untrusted = {
  progress: 0.071, spp: 65536, spp_asked: null, spp_done: 36, rmse: 0.0921, rmse_ci95: [0.0876, 0.0968], relmse: 0.0386, relmse_ci95: [0.0351, 0.0424], target_error: 0.005,
  eta_seconds: 4310, eta_ci95: [3200, 6100], eta_with_more: { workers: 8, seconds: 1140, ci95: [850, 1600] }, units_done: 2448, units_total: 34680, elapsed_seconds: 880, core_seconds: 3490,
  verdict: kHeavy, slope: -0.71, slope_ci95: [-0.95, -0.47], efficiency_per_core: 0.00742, few_hits: 31, size: [1920, 1080],
  numeric_class: "02be77c19d40e3f6", platform: "armv8-a:gcc-14.2.0:embree-4.3.3", class_share: { workers: 1, of_workers: 4, threads: 4, of_threads: 36, share: 4 / 36 },
  time: { load: 0.4, build: 3.1, render: 3490, transfer: 21, merge: 14.2, idle: 38 },
};

export const jobs = [
  job("j-7f3a91c2", "steam-bath.xml", "running", { ...half, verdict: kTrusted, submitted_unix: kNow - 240 }),
  job("j-a04be6d1", "shafts.xml", "running", { ...untrusted, submitted_unix: kNow - 900 }),
  job("j-22c81f09", "cloud.xml", "paused", { progress: 0.31, spp_done: 158.7, relmse: 0.000072, relmse_ci95: [0.000069, 0.000076], submitted_unix: kNow - 1500 }),
  job("j-5be0d7aa", "tint.xml", "queued", { spp: 4096, submitted_unix: kNow - 20 }),
  job("j-91d2c3f4", "fogbox.xml", "done", { progress: 1, spp_done: 512, spp: 512, stopped: "error", rmse: 0.0152, relmse: 0.00098, relmse_ci95: [0.00094, 0.00102], target_error: 0.001, units_done: 2880, elapsed_seconds: 423, core_seconds: 1684, time: { load: 2.1, build: 9.4, render: 1684, transfer: 12.2, merge: 8.1, idle: 33 }, submitted_unix: kNow - 5400 }),
  job("j-c6e8b510", "forge-v12.xml", "failed", {
    progress: 0.02, spp_done: 10, submitted_unix: kNow - 7200, elapsed_seconds: 6, core_seconds: 9,
    error: "unit (tile 37, round 3) ended the renderer with SIGSEGV on 3 workers (lab-01, lab-02, lab-04),\nat pixel 412,96, sample 11. The job was stopped.\nReplay it: lightshaft render forge-v12.xml --pixel 412,96 --sample 11",
  }),
  job("j-0a4417bb", "spotfog.xml", "cancelled", { stopped: "user", progress: 0.55, spp_done: 281, relmse: 0.0021, relmse_ci95: [0.0019, 0.0023], submitted_unix: kNow - 90000, elapsed_seconds: 99 }),
];

export const unhealthy = job("j-7f3a91c2", "steam-bath.xml", "running", {
  ...half, verdict: { ...kHeavy, words: "Don't trust this estimate yet: a few pixels carry most of the error." }, submitted_unix: kNow - 240, health: { clean: false, nonfinite: 3, negative: 0, majorant_violations: 1204, causes: [
    { cause: "not_a_number", effect: "rejected", count: 3, text: "3 samples were not a number (NaN); they count as zero", frame: null, first: [{ pixel: [412, 96], sample: 11 }], replay: "lightshaft render steam-bath.xml --size 640x360 -D density=2.5 --pixel 412,96 --sample 11" },
    { cause: "majorant_violation", effect: "kept", count: 1204, text: "1,204 times a medium was denser than its bound, so the image may be biased", frame: null, first: [{ pixel: [300, 2], sample: 7 }], replay: "lightshaft render steam-bath.xml --size 640x360 -D density=2.5 --pixel 300,2 --sample 7" },
    { cause: "negative_density", effect: "input", count: 37, text: "37 negative values of volumes of the scene were made 0", frame: null, first: [], replay: null },
  ] },
  warnings: ["steam-bath.xml:31:9: warning: 'strict_normals' means nothing here and is ignored", "steam-bath.xml:52:5: warning: 37 voxels of \"steam\" were negative and became 0"],
});

// A sequence, and the frame of it that is shown.
const kSequence = "j-3d90be12";
const frameState = (frame) => (frame < 5 ? "done" : frame === 5 ? "running" : frame === 9 ? "failed" : "queued");
const frameList = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10].map((frame) => ({
  frame, id: `${kSequence}-frame${frame}`, state: frameState(frame), progress: frame < 5 ? 1 : frame === 5 ? 0.43 : 0,
  spp_done: frame < 5 ? 512 : 0, relmse: null, error: frame === 9 ? "smoke.0009.vdb has no grid \"density\"" : null,
}));
export const sequence = job(kSequence, "smoke.xml", "running", {
  ...half, progress: 0.44, eta_seconds: 2040, submitted_unix: kNow - 1900, error: "frame 9: smoke.0009.vdb has no grid \"density\"",
  frames: { range: "1-10", total: 10, done: 4, running: 1, failed: 1, cancelled: 0, current: 5, list: frameList },
});
export const frame = job(`${kSequence}-frame5`, "smoke.xml", "running", { ...half, sequence: kSequence, frame: 5 });

const tileRect = (tile) => {
  const [x, y] = [(tile % 20) * 32, Math.floor(tile / 20) * 32];
  return [x, y, x + 32, Math.min(y + 32, 360)];
};
export const tiles = [[103, "lab-01"], [104, "lab-01"], [105, "lab-02"], [106, "lab-03"], [107, "lab-03"], [109, "attic"]].map(([tile, name]) => ({
  tile, rect: tileRect(tile), rounds: 6, spp: 128, workers: [name],
}));
export const foldedTile = (tile, worker) => ({ job: "j-7f3a91c2", tile, rect: tileRect(tile), state: "folded", spp: 192, worker });

const worker = (id, name, more = {}) => ({
  id, name, build: "lightshaft 0.2.0", numeric_class: "9c41f0aa27d3b85e", threads: 8, tags: [], state: "connected", activity: "rendering tile 104, round 6",
  job: "j-7f3a91c2", units_done: 341, cpu_seconds: 1480, rss_bytes: 412 * 2 ** 20, last_seen_seconds: 0.4, ...more,
});
export const workers = [
  worker("w-1", "lab-01", { tags: ["avx512", "lab"] }),
  worker("w-2", "lab-02", { activity: "rendering tile 105, round 6", units_done: 338, tags: ["lab"] }),
  worker("w-3", "lab-03", { activity: "fetching steam.vdb (61 MiB)", threads: 16, units_done: 702, cpu_seconds: 3012, rss_bytes: 1.3 * 2 ** 30 }),
  worker("w-4", "attic", { numeric_class: "02be77c19d40e3f6", platform: "armv8-a:gcc-14.2.0:embree-4.3.3", threads: 4, activity: "rendering tile 12, round 2", job: "j-a04be6d1", units_done: 90, cpu_seconds: 655 }),
  worker("w-5", "lab-04", { state: "lost", activity: "", job: "", units_done: 17, cpu_seconds: 70, rss_bytes: null, last_seen_seconds: 372 }),
];

// Points of a run: the error falls as 1/time, with the scatter of a real run; [seconds, relative scatter].
const kRun = [[0.9, 1.06], [1.8, 0.97], [3.6, 1.03], [7.1, 1.01], [14.4, 0.985], [28.6, 1.02], [57.8, 0.99], [116, 1.01], [187, 1]];
export const report = {
  target_error: 0.001, slope: -0.98, slope_ci95: [-1.06, -0.9], trend: "converging as expected", trusted: true, verdict: "converging as expected", verdict_kind: "converging",
  forecast: { target: 0.001, asked: true, spp: 896, core_seconds: 1000, core_seconds_ci95: [739, 1310] },
  convergence: kRun.map(([seconds, scatter]) => {
    const relmse = (0.00418 * 187 * scatter) / seconds;
    const spread = 0.07 + 0.35 / Math.sqrt(seconds + 1);
    return { seconds, core_seconds: seconds * 3.97, spp: Math.max(2, 1.147 * seconds), rmse: Math.sqrt(relmse) * 0.48, relmse, relmse_ci95: [relmse / (1 + spread), relmse * (1 + spread)] };
  }),
};
/** The report of the job in data.jobs that is not to be trusted. */
export const untrustedReport = {
  target_error: 0.005, slope: -0.71, slope_ci95: [-0.95, -0.47], trend: "slower than expected", trusted: false, verdict: kHeavy.words, verdict_kind: kHeavy.kind,
  forecast: { target: 0.005, asked: true, spp: 480, core_seconds: 17000, core_seconds_ci95: [12700, 24200] },
  convergence: [[2, 49, 0.21], [4, 98, 0.16], [8, 195, 0.17], [16, 391, 0.068], [32, 783, 0.0402], [36, 880, 0.0386]].map(([samples, seconds, relmse]) => ({
    seconds, core_seconds: seconds * 3.97, spp: samples, rmse: Math.sqrt(relmse) * 0.47, relmse, relmse_ci95: [relmse / 1.4, relmse * 1.4] })),
};
export const doubtful = { ...report, trusted: false, verdict_kind: "heavy_tail", verdict: "Don't trust this estimate yet: a few pixels carry most of the error." };

// With a reference, the true error is shown beside the estimate.
export const compared = { ...report, convergence: report.convergence.map((p, i) => ({ ...p, true_relmse: p.relmse * (1.06 - 0.02 * (i % 4)), true_rmse: p.rmse, true_flip: 0.4 / Math.sqrt(p.spp) })) };
export const comparedJob = job("j-7f3a91c2", "steam-bath.xml", "running", { ...half, submitted_unix: kNow - 240, few_hits: 12, reference: { rmse: 0.0319, relmse: 0.00443, flip: 0.0271 } });

export const diagnostics = [
  { severity: "error", file: "bath.xml", line: 14, column: 16, text: "medium \"grid\" has no parameter 'sigmat'; did you mean 'sigma_t'?", source_line: "    <float name=\"sigmat\" value=\"2\"/>", length: 13 },
  { severity: "error", file: "bath.xml", line: 22, column: 5, text: "no medium has the id \"steem\"; defined here: \"steam\" (line 9)", source_line: "    <ref name=\"interior\" id=\"steem\"/>", length: 4 },
  { severity: "warning", file: "bath.xml", line: 31, column: 9, text: "'strict_normals' means nothing here and is ignored", source_line: "", length: 1 },
];

export const log = Array.from({ length: 400 }, (_, n) => `2026-11-30 12:${String(Math.floor(n / 60)).padStart(2, "0")}:${String(n % 60).padStart(2, "0")} ${n === 0 ? "submitted" : n % 57 === 0 ? `tile ${n} round 2 failed on w-19ab-3: out of memory while rendering, since the scene needs more than the renderer may use` : `checkpoint ${n}: relMSE ${(0.4 / n).toFixed(5)}`}`).join("\n");

// Why a job failed, the cause first, from what the coordinator says of it (openapi.json: Job.failure).

const kHeads = { scene: "the scene cannot be rendered: ", no_worker: "no worker is left that may try: " };

/** {cause, where}: each different cause once; where: what was tried, and how to see it again. An `error` that is not about a unit is a cause as it is. */
export function causeFirst({ error, failure }) {
  if (!failure) return { cause: error, where: "" };
  const workers = new Map(); // cause -> names of workers
  for (const attempt of failure.attempts) {
    const cause = causeOf(attempt);
    workers.set(cause, new Set([...(workers.get(cause) ?? []), attempt.worker]));
  }
  const causes = [...workers].map(([cause, names]) => (workers.size > 1 ? `${cause} (on ${[...names].join(", ")})` : cause));
  return { cause: causes.join("\n"), where: [unitOf(failure), failure.replay ? `See it again: ${failure.replay}` : null].filter(Boolean).join("\n") };
}

function causeOf({ reason, signal, pixel, sample }) {
  const place = pixel ? ` at pixel ${pixel.join(",")}${sample === null ? "" : ` sample ${sample}`}` : "";
  return `${reason ?? "no reason given"}${signal === null ? "" : ` (signal ${signal})`}${place}`;
}

function unitOf({ kind, frame, tile, rect: [x0, y0, x1, y1], round, samples, attempts }) {
  const names = [...new Set(attempts.map(({ worker }) => worker))];
  return `${frame === null ? "" : `frame ${frame}: `}${kHeads[kind] ?? ""}tile ${tile} (pixels ${x0},${y0} to ${x1},${y1}), round ${round} (samples ${samples.join(" to ")}) failed in ${attempts.length} ${attempts.length === 1 ? "attempt" : "attempts"} on ${names.join(", ")}.`;
}

// Why a job failed, with the cause first. The coordinator (describe_failure in coordinator/domain/job.cpp) writes
// "HEAD: tile 0 (...) failed in 2 attempts; on lab-01: CAUSE; on lab-02: CAUSE. Replay it with: COMMAND".

const kAttempts = /^(.*)\b(tile \d+ \(pixels [^)]*\), round \d+ \(samples [^)]*\) failed in \d+ attempts?); on /s;

/** {cause, where}: each different cause once; where: what was tried, and how to see it again. Other texts are a cause as they are. */
export function causeFirst(text) {
  const found = kAttempts.exec(text);
  if (!found) return { cause: text, where: "" };
  const [whole, head, tile] = found;
  const [attempts, replay] = text.slice(whole.length).split(/\.\s+Replay it with: /);
  const workers = new Map(); // cause -> names of workers
  for (const attempt of attempts.split("; on ")) {
    const [, name, cause] = /^(.*?): (.*)$/s.exec(attempt) ?? [null, "", attempt];
    workers.set(cause, new Set([...(workers.get(cause) ?? []), name]));
  }
  const causes = [...workers].map(([cause, names]) => (workers.size > 1 ? `${cause} (on ${[...names].join(", ")})` : cause));
  const said = head.replace(/[:\s]+$/, "");
  const names = [...new Set([...workers.values()].flatMap((some) => [...some]))].filter(Boolean);
  return {
    cause: causes.join("\n"),
    where: [`${said ? `${said}: ` : ""}${tile}${names.length ? ` on ${names.join(", ")}` : ""}.`, replay ? `See it again: ${replay}` : ""].filter(Boolean).join("\n"),
  };
}

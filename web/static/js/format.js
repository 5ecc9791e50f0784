// Figures as people read them. Reports (util/report/number_text.cpp) show them alike: tests/support/shown.json.

export const kAbsent = "–";
const kSuperscript = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

const known = (x) => typeof x === "number" && Number.isFinite(x);
export const superscript = (n) => [...String(n)].map((c) => kSuperscript[c]).join("");

/** Three significant digits: 0.0213, 3.20 × 10⁻⁵. */
export function figure(x, digits = 3) {
  if (!known(x)) return kAbsent;
  if (x === 0) return "0";
  const [mantissa, power] = x.toExponential(digits - 1).split("e"); // rounded first: 9.996 has the exponent of 10.0
  if (power < -3 || power >= 5) return `${mantissa} × 10${superscript(Number(power))}`;
  return x.toLocaleString("en", { minimumSignificantDigits: digits, maximumSignificantDigits: digits });
}

/** A figure that a person chose: with the digits it was given. */
export const given = (x) => (known(x) ? (Math.abs(x) < 1e-4 ? figure(x) : x.toLocaleString("en", { maximumSignificantDigits: 6 })) : kAbsent);

export const interval = (ci) => (Array.isArray(ci) && known(ci[0]) && known(ci[1]) ? `${figure(ci[0])} – ${figure(ci[1])}` : null);

/** 0.4 s, 12 s, 4.2 min, 1 h 12 min, 3 d 4 h. */
export function duration(seconds) {
  if (!known(seconds)) return kAbsent;
  if (seconds < 10) return `${Number(seconds.toFixed(1))} s`;
  if (seconds < 99.5) return `${Math.round(seconds)} s`;
  if (seconds < 3570) return `${Number((seconds / 60).toFixed(seconds < 600 ? 1 : 0))} min`;
  const minutes = Math.round(seconds / 60);
  if (minutes < 48 * 60) return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
  const hours = Math.round(seconds / 3600);
  return `${Math.floor(hours / 24)} d ${hours % 24} h`;
}

export function bytes(n) {
  if (!known(n)) return kAbsent;
  const units = ["B", "KiB", "MiB", "GiB", "TiB"];
  let i = 0;
  while (n >= 1024 && i < units.length - 1) {
    n /= 1024;
    i += 1;
  }
  return `${i === 0 || n >= 100 ? Math.round(n) : n.toFixed(1)} ${units[i]}`;
}

export const count = (n) => (known(n) ? Math.round(n).toLocaleString("en") : kAbsent);
/** 0 % and 100 % are kept for nothing and everything. */
export function percent(x) {
  if (!known(x)) return kAbsent;
  const whole = Math.round(x * 100);
  if (x > 0 && whole === 0) return "< 1 %";
  return x < 1 && whole === 100 ? "> 99 %" : `${whole} %`;
}
export const plural = (n, one, many = `${one}s`) => `${count(n)} ${n === 1 ? one : many}`;
export const spp = (x) => (known(x) ? (x < 100 ? String(Math.round(10 * x) / 10) : count(x)) : kAbsent);
export const exposure = (ev) => `${ev > 0 ? "+" : ev < 0 ? "−" : ""}${Math.abs(ev).toFixed(1)} EV`;
export const shortId = (id) => (id.length > 12 ? id.slice(0, 8) : id);
export const jobName = (job) => job.name || `job ${shortId(job.id)}`;

/** When a job came in, for people: "14:03" today, "12 Nov 14:03" before. */
export function moment(unixSeconds, now = new Date()) {
  if (!known(unixSeconds)) return kAbsent;
  const at = new Date(unixSeconds * 1000);
  const time = at.toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit" });
  if (at.toDateString() === now.toDateString()) return time;
  return `${at.getDate()} ${at.toLocaleString("en", { month: "short" })} ${time}`;
}

// The drawing of error against time: measured points with their 95 % band, the true error if there is a
// reference, the target, and the predicted time at which it will be reached.
import { h } from "../dom.js";
import { errorTicks, logAxis, timeTicks } from "../plot_scale.js";
import { given } from "../format.js";

const kFarthest = 100; // multiple of the last time: a forecast beyond it is not drawn
const kHalfLabel = 22; // half the width of the widest label of time, which must fit into the drawing
const kWide = { width: 680, height: 350, left: 52, right: 668, top: 12, bottom: 316 };
const kNarrow = { width: 330, height: 270, left: 44, right: 324, top: 12, bottom: 230 };

export const boxOf = (narrow) => (narrow ? kNarrow : kWide);

/** {box, x, y}: where times and errors stand. */
export function frameOf({ points, key, target, ahead, narrow }) {
  const box = boxOf(narrow);
  const positive = (values) => values.filter((value) => Number.isFinite(value) && value > 0);
  const errors = positive(points.flatMap((p) => [p.relmse, ...(p.relmse_ci95 ?? []), shown(p, "true_relmse"), target]));
  const farthest = kFarthest * points.at(-1)[key];
  const times = positive([points[0][key], points.at(-1)[key], ...(drawn(ahead, farthest) ? [ahead.x, ahead.hi].map((x) => Math.min(x, farthest)) : [])]);
  return {
    box, farthest,
    x: logAxis(Math.min(...times), Math.max(...times), box.left, box.right),
    y: logAxis(Math.min(...errors), Math.max(...errors), box.bottom, box.top),
  };
}

/** What a reference cannot tell, since it is below its own noise, is not drawn. */
const shown = (point, name) => (name === "true_relmse" && point.true_relmse_below_noise === true ? null : point[name]);

const drawn = (ahead, farthest) => ahead && ahead.x < farthest;

export function drawing({ points, key, target, ahead, chosen }, frame) {
  const { box } = frame;
  return [
    grid(frame),
    h("defs", null, h("clipPath", { id: "plot-inside" }, h("rect", { x: box.left, y: box.top - 6, width: box.right - box.left, height: box.bottom - box.top + 12 }))),
    h("g", { "clip-path": "url(#plot-inside)" },
      band(points, key, frame),
      target > 0 ? targetLine(target, frame) : null,
      target > 0 && drawn(ahead, frame.farthest) ? aheadMarks(points.at(-1), key, target, ahead, frame) : null,
      line(points, key, "relmse", "plot-line", frame), line(points, key, "true_relmse", "plot-true", frame),
      points.map((p, i) => h("circle", { key: `p${i}`, class: i === chosen ? "plot-point chosen" : "plot-point", cx: frame.x.at(p[key]), cy: frame.y.at(p.relmse), r: i === chosen ? 4.5 : 2.6 }))),
  ];
}

function grid({ x, y, box }) {
  return h("g", { class: "plot-grid" },
    timeTicks(x).map((t) => [
      h("line", { key: `x${t.value}`, class: "major", x1: x.at(t.value), x2: x.at(t.value), y1: box.top, y2: box.bottom }),
      t.label ? h("text", { key: `xt${t.value}`, x: Math.min(x.at(t.value), box.width - kHalfLabel), y: box.bottom + 18, "text-anchor": "middle" }, t.label) : null]),
    errorTicks(y).map((t) => [
      h("line", { key: `y${t.value}`, class: t.major ? "major" : null, x1: box.left, x2: box.right, y1: y.at(t.value), y2: y.at(t.value) }),
      t.label ? h("text", { key: `yt${t.value}`, x: box.left - 8, y: y.at(t.value) + 4, "text-anchor": "end" }, t.label) : null]));
}

function band(points, key, { x, y }) {
  const with95 = points.filter((p) => p.relmse_ci95?.[0] > 0 && Number.isFinite(p.relmse_ci95[1]));
  if (with95.length < 2) return null;
  const up = with95.map((p) => `${x.at(p[key])},${y.at(p.relmse_ci95[1])}`);
  const down = with95.map((p) => `${x.at(p[key])},${y.at(p.relmse_ci95[0])}`).reverse();
  return h("polygon", { class: "plot-band", points: [...up, ...down].join(" ") });
}

function line(points, key, name, className, { x, y }) {
  const known = points.filter((p) => shown(p, name) > 0);
  return known.length < 2 ? null : h("polyline", { class: className, points: known.map((p) => `${x.at(p[key])},${y.at(p[name])}`).join(" ") });
}

function targetLine(target, { y, box }) {
  return h("g", { class: "plot-target" },
    h("line", { x1: box.left, x2: box.right, y1: y.at(target), y2: y.at(target) }),
    h("text", { x: box.left + 6, y: y.at(target) - 6 }, `target ${given(target)}`));
}

function aheadMarks(last, key, target, { x: at, lo, hi, more }, { x, y, farthest }) {
  const [x0, y0, level] = [x.at(last[key]), y.at(last.relmse), y.at(target)];
  const ends = lo !== null && hi > lo ? [x.at(Math.max(lo, last[key])), x.at(Math.min(hi, farthest))] : null;
  const diamond = (time, className) => h("path", { key: className, class: className, d: `M${x.at(time)} ${level - 5}l5 5l-5 5l-5 -5z` });
  return h("g", { class: "plot-forecast" },
    ends ? h("polygon", { key: "fan", class: "plot-fan", points: `${x0},${y0} ${ends[0]},${level} ${ends[1]},${level}` }) : null,
    ends ? h("path", { key: "span", class: "plot-span", d: `M${ends[0]} ${level - 5}v10M${ends[0]} ${level}H${ends[1]}M${ends[1]} ${level - 5}v10` }) : null,
    h("line", { key: "ahead", class: "plot-ahead", x1: x0, y1: y0, x2: x.at(at), y2: level }),
    diamond(at, "plot-meets"),
    more?.x > last[key] ? diamond(more.x, "plot-more") : null);
}

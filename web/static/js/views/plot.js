// Error against time, both logarithmic: measured points, their 95 % band, the target, and where the fitted line meets it.
import { h } from "../dom.js";
import { drawable, errorLabel, fit, logAxis, ticks, timeLabel } from "../plot_scale.js";
import { duration, figure, given, interval, spp } from "../format.js";

const kWidth = 440;
const kHeight = 270;
const kBox = { left: 52, right: kWidth - 14, top: 14, bottom: kHeight - 34 };

/** convergence: of the report. target: relMSE or null. picked: index of the point to name, or null. */
export function errorPlot({ convergence, target, picked, onPick }) {
  const points = drawable(convergence);
  if (points.length === 0) {
    return h("p", { class: "plot-empty" }, "The first point appears when every tile has finished two rounds of samples.");
  }
  const frame = axes(points, target);
  const chosen = points[picked] ? picked : points.length - 1;
  return h("figure", { class: "plot" },
    h("svg", {
      viewBox: `0 0 ${kWidth} ${kHeight}`, "aria-label": summary(points, target), tabindex: 0,
      role: "slider", "aria-valuemin": 1, "aria-valuemax": points.length, "aria-valuenow": chosen + 1, "aria-valuetext": spoken(points[chosen]),
      onpointermove: (event) => onPick(nearest(event, points, frame)), onpointerleave: () => onPick(null),
      onkeydown: (event) => onPick(stepped(event, chosen, points.length)), onblur: () => onPick(null),
    },
      grid(frame), band(points, frame), targetLine(target, frame), prediction(points, target, frame),
      series(points, frame, "relmse", "plot-line"), series(points, frame, "true_relmse", "plot-true"),
      points.map((p, i) => h("circle", { key: `p${i}`, class: i === chosen ? "plot-point chosen" : "plot-point", cx: frame.x.at(p.seconds), cy: frame.y.at(p.relmse), r: i === chosen ? 4.5 : 2.6 }))),
    h("figcaption", { class: "plot-reading" }, reading(points[chosen]), slopeText(points)));
}

function axes(points, target) {
  const errors = points.flatMap((p) => [p.relmse, ...(p.relmse_ci95 ?? []), p.true_relmse]).filter((e) => e > 0);
  if (target > 0) errors.push(target);
  const meets = meeting(points, target);
  const last = points.at(-1).seconds;
  return {
    x: logAxis(points[0].seconds, meets && meets < 30 * last ? Math.max(meets, last) : last, kBox.left, kBox.right),
    y: logAxis(Math.min(...errors), Math.max(...errors), kBox.bottom, kBox.top),
  };
}

/** When the fitted line reaches the target; null if it does not, or if it is reached already. */
function meeting(points, target) {
  const line = fit(points);
  const last = points.at(-1);
  if (!line || !(target > 0) || last.relmse <= target || line.slope > -0.2) return null;
  return last.seconds * (last.relmse / target) ** (-1 / line.slope);
}

function grid({ x, y }) {
  return h("g", { class: "plot-grid" },
    ticks(x, timeLabel).map((t) => [
      h("line", { key: `x${t.value}`, class: t.major ? "major" : null, x1: x.at(t.value), x2: x.at(t.value), y1: kBox.top, y2: kBox.bottom }),
      h("text", { key: `xt${t.value}`, x: x.at(t.value), y: kBox.bottom + 20, "text-anchor": "middle" }, t.label)]),
    ticks(y, errorLabel).map((t) => [
      h("line", { key: `y${t.value}`, class: t.major ? "major" : null, x1: kBox.left, x2: kBox.right, y1: y.at(t.value), y2: y.at(t.value) }),
      h("text", { key: `yt${t.value}`, x: kBox.left - 9, y: y.at(t.value) + 4, "text-anchor": "end" }, t.label)]));
}

function band(points, { x, y }) {
  const with95 = points.filter((p) => p.relmse_ci95?.[0] > 0 && p.relmse_ci95[1] > 0);
  if (with95.length < 2) return null;
  const up = with95.map((p) => `${x.at(p.seconds)},${y.at(p.relmse_ci95[1])}`);
  const down = with95.map((p) => `${x.at(p.seconds)},${y.at(p.relmse_ci95[0])}`).reverse();
  return h("polygon", { class: "plot-band", points: [...up, ...down].join(" ") });
}

function series(points, { x, y }, name, className) {
  const known = points.filter((p) => p[name] > 0);
  return known.length < 2 ? null : h("polyline", { class: className, points: known.map((p) => `${x.at(p.seconds)},${y.at(p[name])}`).join(" ") });
}

function targetLine(target, { y }) {
  if (!(target > 0)) return null;
  return h("g", { class: "plot-target" },
    h("line", { x1: kBox.left, x2: kBox.right, y1: y.at(target), y2: y.at(target) }),
    h("text", { x: kBox.left + 6, y: y.at(target) - 6 }, `target ${given(target)}`));
}

function prediction(points, target, { x, y }) {
  const meets = meeting(points, target);
  if (!meets || meets > x.hi) return null;
  const last = points.at(-1);
  return h("line", { class: "plot-ahead", x1: x.at(last.seconds), y1: y.at(last.relmse), x2: x.at(meets), y2: y.at(target) });
}

function nearest(event, points, { x }) {
  const box = event.currentTarget.getBoundingClientRect();
  const at = ((event.clientX - box.left) / box.width) * kWidth;
  const distance = (p) => Math.abs(x.at(p.seconds) - at);
  return points.reduce((best, p, i) => (distance(p) < distance(points[best]) ? i : best), 0);
}

/** The arrow keys walk along the points. */
function stepped(event, chosen, count) {
  const step = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key] ?? 0;
  if (step) event.preventDefault();
  return Math.min(count - 1, Math.max(0, chosen + step));
}

const spoken = (point) => `relMSE ${figure(point.relmse)} after ${duration(point.seconds)}`;

function reading(point) {
  const ci = interval(point.relmse_ci95);
  return [
    h("span", { key: "t" }, h("b", null, duration(point.seconds)), " after the first ray"),
    h("span", { key: "e" }, "relMSE ", h("b", null, figure(point.relmse)), ci ? ` (95 %: ${ci})` : null),
    point.true_relmse > 0 ? h("span", { key: "r", class: "true" }, "against the reference ", h("b", null, figure(point.true_relmse))) : null,
    h("span", { key: "s" }, h("b", null, spp(point.spp)), " samples per pixel")];
}

function slopeText(points) {
  const line = fit(points);
  return line ? h("span", { key: "slope", title: "Slope of the later half of the points; independent samples give −1" }, "slope ", h("b", null, line.slope.toFixed(2).replace("-", "−"))) : null;
}

function summary(points, target) {
  const last = points.at(-1);
  return `Error against time: relMSE ${figure(last.relmse)} after ${duration(last.seconds)}` + (target > 0 ? `, target ${given(target)}` : "");
}

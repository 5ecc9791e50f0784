// The frames of a sequence: a strip with a small picture of each, and the means to scrub and play through those
// that are done and to have a video made of them.
import { h } from "../dom.js";
import { doneFrames, isOver, mayChange } from "../state.js";
import { downloads } from "../api.js";
import { bytes, count, duration, figure, percent, spp } from "../format.js";
import { frameHref } from "../route.js";
import { safeClass, stateWord } from "./pieces.js";

const kMost = 400; // most links; if there are more frames, those around the shown one
const kRates = [6, 12, 24, 25, 30, 60]; // pictures per second

export function framesStrip(state, job, actions) {
  const frames = job.frames;
  if (!frames) return null;
  const { film } = state.open;
  const list = frames.list ?? [];
  const at = Math.max(0, list.findIndex((frame) => (film ? frame.id === film.id : frame.id === state.open.shown)));
  const first = Math.max(0, Math.min(at - kMost / 2, list.length - kMost));
  const over = isOver(job);
  const some = list.slice(first, first + kMost);
  const shown = list[at];
  return h("nav", { key: "frames", class: "panel frames", "aria-label": "Frames", onkeydown: (event) => onKey(event, job, actions) },
    h("p", { class: "frames-head" },
      h("b", null, shown ? `Frame ${shown.frame}` : "Frames"),
      h("span", { class: "dim" }, tally(frames)),
      step("previous", "‹", "The frame before", job, list[at - 1]),
      step("next", "›", "The next frame", job, list[at + 1]),
      state.route.frame === null
        ? over ? null : h("span", { key: "following", class: "dim" }, "following what is rendered")
        : over ? null : h("a", { key: "follow", class: "follow", href: frameHref(job.id, null) }, "Follow what is rendered")),
    whole(job),
    some.length < list.length ? h("p", { key: "part", class: "help" }, `${count(some.length)} of them, around the one that is shown`) : null,
    h("film-strip", { key: "strip", ".current": shown?.id }, h("ul", null, some.map((frame) => h("li", { key: frame.id }, cell(job, frame, frame === shown))))),
    player(state, job, list, at, actions),
    videoTools(state, job, actions));
}

/** Figures of all frames together. */
const whole = (job) => h("p", { key: "whole", class: "frames-whole dim number" }, "Whole sequence: ",
  [`relMSE ${figure(job.relmse)} on average`, `${spp(job.spp_done)} samples per pixel`, `${duration(job.core_seconds)} of core time`, isOver(job) ? `took ${duration(job.elapsed_seconds)}` : `${duration(job.eta_seconds)} left`].join(" · "));

function tally(frames) {
  const more = ["failed", "cancelled"].filter((state) => frames[state] > 0).map((state) => `, ${count(frames[state])} ${state}`);
  return `${count(frames.done)} of ${count(frames.total)} done${more.join("")}`;
}

const step = (key, sign, label, job, frame) =>
  frame ? h("a", { key, class: "step", href: frameHref(job.id, frame.frame), "aria-label": label }, sign) : h("span", { key, class: "step off", "aria-hidden": "true" }, sign);

const cell = (job, frame, here) => h("a", {
  class: `frame is-${safeClass(frame.state)}`, href: frameHref(job.id, frame.frame), "data-frame": frame.frame,
  "aria-current": here ? "true" : null, "aria-label": `Frame ${frame.frame}, ${stateWord(frame)}, ${percent(frame.progress)}`,
  title: frame.error || null, style: { "--part": frame.progress },
},
h("span", { class: "frame-picture" }, frame.progress > 0 ? h("img", { key: "small", src: downloads.thumbnail(frame.id, `${frame.state}${Math.floor(5 * frame.progress)}`), "data-small": frame.id, loading: "lazy", decoding: "async", alt: "" }) : null),
h("span", { class: "frame-number" }, String(frame.frame)));

/** The index among the done frames that lies nearest to the frame that is shown. */
function nearest(done, frame) {
  let best = 0;
  done.forEach((one, i) => {
    if (Math.abs(one.frame - frame) < Math.abs(done[best].frame - frame)) best = i;
  });
  return best;
}

function player(state, job, list, at, actions) {
  const done = doneFrames(job);
  if (done.length < 2) return null;
  const { film, fps } = state.open;
  const index = nearest(done, list[at]?.frame ?? done[0].frame);
  const playing = Boolean(film?.playing);
  return h("div", { key: "player", class: "player" },
    h("button", { key: "play", type: "button", class: "small play", "aria-pressed": String(playing), onclick: actions.playFilm }, playing ? "Pause" : "Play"),
    h("input", {
      key: "scrub", id: "scrub", type: "range", min: 0, max: done.length - 1, step: 1, ".value": String(index), "aria-label": "Finished frames", "aria-valuetext": `Frame ${done[index].frame}`,
      oninput: (event) => actions.scrubFilm(done[Number(event.currentTarget.value)].id), onchange: actions.settleFilm,
    }),
    h("output", { key: "of", for: "scrub", class: "number" }, `${done[index].frame}`),
    h("label", { key: "rate", class: "rate" }, h("select", { "aria-label": "Pictures per second", ".value": String(fps), onchange: (event) => actions.setFps(Number(event.currentTarget.value)) }, kRates.map((rate) => h("option", { key: rate, value: rate, selected: rate === fps }, String(rate)))), "per second"));
}

/** Space plays, the arrows step; a slider and a list of choices have their own use of arrows. */
function onKey(event, job, actions) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const { localName } = event.target;
  const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  if (event.key === " " && localName !== "button" && localName !== "select" && doneFrames(job).length > 1) actions.playFilm();
  else if (by && localName !== "input" && localName !== "select") actions.stepFrame(by);
  else return;
  event.preventDefault();
}

function videoTools(state, job, actions) {
  const { video } = state.open;
  const wanted = mayChange(state) && doneFrames(job).length > 1;
  const busy = video?.state === "waiting" || video?.state === "making";
  if (!wanted && video?.state !== "ready") return null;
  return h("p", { key: "video", class: "video" },
    wanted ? h("button", { key: "make", type: "button", class: "small", disabled: busy, onclick: () => actions.makeVideo(job.id) }, "Make a video") : null,
    h("span", { key: "state", class: "dim", role: "status" }, videoText(video)),
    video?.state === "ready" ? h("a", { key: "file", class: "button small", href: downloads.video(job.id), download: `${job.name.replace(/\.xml$/i, "")}.mp4` }, `Video, ${bytes(video.bytes)}`) : null);
}

function videoText(video) {
  if (!video || video.state === "none") return "of the finished frames, at this exposure and rate";
  if (video.state === "waiting") return "waits for another video";
  if (video.state === "making") return `${count(video.frames_done)} of ${count(video.frames)} frames are in it`;
  if (video.state === "failed") return video.error;
  return `${count(video.frames)} frames, ${video.fps} per second`;
}

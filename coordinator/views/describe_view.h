// The tables of what clients read of jobs, frames, tiles, workers and videos. describe(visitor, view) calls
// visitor.field(name, description, value) for each key of the view's JSON object; a description may be empty
// where name and type say everything. views.cpp writes the JSON by these tables, and a test makes the schemas
// of openapi.json from them (tests/unit/http/job_settings_test.cpp).
//
// A value is a number, a truth value, text, a Word, a pair, array or vector of values, an object with a table
// of its own, or std::optional of one of these: nullopt is null. So is a number that is not finite.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "coordinator/views/views.h"
#include "core/job/advice.h"
#include "core/job/describe.h"

namespace ls::coordinator {

using Interval = std::pair<double, double>;

// A text that is one of `all`.
struct Word {
  std::string_view value;
  std::span<const std::string_view> all;
};

// Objects within a view that have no structure of their own in views.h
struct MoreWorkersView {
  double seconds = 0;
  std::optional<Interval> ci95;
};
struct VerdictView {
  ConvergenceStatus status;
  std::string advice;
};
struct HealthView {  // health_json() writes it (core/job/health_notes.h)
  Health health;
  std::vector<HealthNote> notes;
};

inline std::optional<std::string> unless_empty(std::string text) {
  return text.empty() ? std::nullopt : std::optional(std::move(text));
}
template <class T>
std::optional<T> only_if(bool condition, T value) {
  return condition ? std::optional(std::move(value)) : std::nullopt;
}
inline std::array<int, 4> corners(const PixelRect& r) { return {r.x0, r.y0, r.x1, r.y1}; }
inline Word word(JobState state) {
  static constexpr std::array<std::string_view, 6> kAll{"queued", "running", "paused",
                                                        "done",   "failed",  "cancelled"};
  return {to_string(state), kAll};
}
std::string advice_of(const JobView& job);  // what to do about figures that are not trusted; empty: nothing

template <class V, job::Of<TimeSplit> T>
void describe(V& v, T& t) {
  for (const TimePart& part : kTimeParts) v.field(part.name, part.doc, t.*part.seconds);
}

template <class V, job::Of<DenoisedCheck> T>
void describe(V& v, T& c) {
  v.field("spp", "Samples per pixel at that time, averaged over the pixels.", c.spp);
  v.field("relmse", "Estimated from the image itself.", std::max(0.0, c.relmse));
  v.field("at_most", "Upper end of the 95 % interval, which is compared with the target. null: unknown.",
          c.at_most);
}

template <class V, job::Of<DenoisedFigure> T>
void describe(V& v, T& d) {
  v.field("relmse", "", d.relmse);
  v.field("relmse_ci95", "[low, high]: the 95 % interval of relmse. null: unknown.", d.relmse_ci95);
}

template <class V, job::Of<ReferenceError> T>
void describe(V& v, T& e) {
  v.field("rmse", "", e.rmse);
  v.field("relmse", "", e.relmse);
  v.field("flip", "Mean HDR-FLIP, the visible difference from 0 to 1. null: not computed.", e.flip);
  v.field("below_noise",
          "True if relmse is less than three standard errors of the reference's own noise. The true error is "
          "then too small to measure, not 0.",
          e.relmse_below_noise());
  v.field("rmse_below_noise", "True if the true RMSE is hidden by the reference's own noise.",
          e.rmse_below_noise());
}

template <class V, job::Of<MoreWorkersView> T>
void describe(V& v, T& m) {
  v.field("workers", "Number of additional workers.", kMoreWorkers);
  v.field("seconds", "", m.seconds);
  v.field("ci95", "[low, high]: the 95 % interval of seconds.", m.ci95);
}

template <class V, job::Of<VerdictView> T>
void describe(V& v, T& verdict) {
  static constexpr std::array<std::string_view, 5> kKinds{"early", "converging", "fast", "heavy_tail",
                                                          "bias_floor"};
  v.field("kind", "", Word{to_string(verdict.status.kind), kKinds});
  v.field("words", "", verdict.status.words);
  v.field("trusted",
          "False if the error figures cannot be trusted yet. The words say why, and the intervals mean "
          "little.",
          verdict.status.trusted);
  v.field("advice",
          "What a user can do if the figures are not trusted, with the command. null: nothing needs to be "
          "done.",
          unless_empty(verdict.advice));
}

template <class V, job::Of<AfterView> T>
void describe(V& v, T& a) {
  v.field("id", "", a.id.value);
  v.field("state", "State of that job. null: it has been removed.",
          a.state ? std::optional(std::string(to_string(*a.state))) : std::nullopt);
}

template <class V, job::Of<JobFailure::Attempt> T>
void describe(V& v, T& a) {
  v.field("worker", "Name of the worker.", a.worker);
  v.field("reason", "", unless_empty(a.reason));
  v.field("signal", "Signal that ended the render process.", a.signal);
  v.field("pixel", "[x, y] of the pixel that was being rendered.",
          a.pixel ? std::optional(std::array{a.pixel->first, a.pixel->second}) : std::nullopt);
  v.field("sample", "", a.sample);
}

template <class V, job::Of<JobFailure> T>
void describe(V& v, T& f) {
  static constexpr std::array<std::string_view, 3> kKinds{"unit", "scene", "no_worker"};
  v.field("kind",
          "unit: a unit failed on several workers. scene: the last worker said that the scene is at fault. "
          "no_worker: every worker has failed too many units of the job.",
          Word{to_string(f.kind), kKinds});
  v.field("tile", "", f.tile);
  v.field("rect", "[x0, y0, x1, y1] of the tile, in pixels; x1 and y1 are exclusive.", corners(f.rect));
  v.field("round", "", f.round);
  v.field("samples", "[first, end]: the samples of the round; end is exclusive.",
          std::array{f.samples.s0, f.samples.s1});
  v.field("frame", "The frame that failed, of a sequence.", f.frame);
  v.field("attempts", "What the workers reported, the latest attempt last.", f.attempts);
  v.field("replay", "Command that renders the failed pixel again. null: the pixel is not known.",
          unless_empty(f.replay));
}

template <class V, job::Of<ClassShare> T>
void describe(V& v, T& s) {
  v.field("workers", "", s.workers);
  v.field("of_workers", "", s.of_workers);
  v.field("threads", "", s.threads);
  v.field("of_threads", "", s.of_threads);
  v.field("share", "", only_if(s.of_threads > 0, static_cast<double>(s.threads) / s.of_threads));
}

template <class V, job::Of<FrameView> T>
void describe(V& v, T& f) {
  v.field("frame", "", f.frame);
  v.field("id", "Id of the frame, which is a job with its own events.", f.job.value);
  v.field("state", "", word(f.state));
  v.field("progress", "", f.progress);
  v.field("spp_done", "", f.spp_done);
  v.field("relmse", "", f.relmse);
  v.field("error", "", unless_empty(f.error));
}

template <class V, job::Of<FramesView> T>
void describe(V& v, T& f) {
  v.field("range", "The frames as submitted, such as 1-10 or 1-10x2.", to_string(f.range));
  v.field("total", "", f.total);
  v.field("done", "", f.done);
  v.field("running", "", f.running);
  v.field("failed", "", f.failed);
  v.field("cancelled", "", f.cancelled);
  v.field("current",
          "The frame that is most interesting now: the first that is being rendered, or else the last that "
          "has an image.",
          f.current);
  v.field_unless_empty("list", "All frames in ascending order. Only in GET /api/v1/jobs/{id}.", f.all);
}

template <class V, job::Of<JobView> T>
void describe(V& v, T& j) {
  const std::optional<FrameId> frame = frame_of(j.id);
  const ErrorFigures error = j.error_now.value_or(ErrorFigures{});
  const bool known = j.error_now.has_value();
  const Trend trend = j.trend.value_or(Trend{});

  v.field("id", "", j.id.value);
  v.field("name", "File name of the scene, or the name given at submission.", j.name);
  v.field("owner", "User whose token submitted the job. Empty: the admin.", j.owner);
  v.field("state", "", word(j.state));
  v.field("stopped", "Why the job ended: spp, error, time, or user (it was cancelled).",
          unless_empty(j.stopped));
  v.field("progress", "From 0 to 1.", j.progress);
  v.field("spp", "Samples per pixel that the job asks for.", j.spp);
  v.field("spp_asked",
          "Samples per pixel that the submission asked for. null: a target error or time limit ends the job, "
          "and spp is only an upper limit for each pixel.",
          only_if(j.spp_asked, j.spp));
  v.field("target_error", "Target error, as relMSE.", j.target_error);
  v.field("target_layer",
          "The layer that must reach target_error: raw or denoised. null: the job has no target.",
          only_if(j.target_error.has_value(), std::string(to_string(j.target_layer))));
  v.field("denoised_check", "The last comparison of the denoised layers' error with the target.",
          j.denoised_check);
  v.field("denoise", "True if the image also gets the layers denoised.R, denoised.G and denoised.B.",
          j.denoise);
  v.field("deep", "The most slices in a pixel of the deep image. 0: the job has none.", j.deep);
  v.field("spp_done", "Samples per pixel so far, averaged over the pixels.", j.spp_done);
  v.field("rmse", "Estimated from the image itself.", only_if(known, error.rmse));
  v.field("rmse_ci95", "[low, high]: the 95 % interval of the error of this image. null: unknown.",
          only_if(known && error.rmse_hi > 0, Interval(error.rmse_lo, error.rmse_hi)));
  v.field("relmse", "Estimated from the image itself.", only_if(known, error.relmse));
  v.field("relmse_ci95", "[low, high]: the 95 % interval of the error of this image.",
          only_if(known, Interval(error.relmse_lo, error.relmse_hi)));
  v.field("reference", "True error: the difference from the reference at the last checkpoint.",
          j.reference_error);
  v.field("reference_same_seed",
          "True if the reference was rendered from this scene with this seed. It then has the same noise as "
          "the image, so its error figures mean nothing. No verdict is drawn from them.",
          j.reference_same_seed);
  v.field(
      "verdict", "How far the error figures can be trusted, in words. null: there are none yet.",
      j.convergence_status ? std::optional(VerdictView{*j.convergence_status, advice_of(j)}) : std::nullopt);
  v.field("few_hits", "Number of pixels where too few samples found light.", j.few_hits);
  v.field("pixels_without_samples", "Number of pixels in tiles without results. null: unknown.",
          j.pixels_without_samples);
  v.field(
      "slope",
      "Slope of log relMSE over log core seconds, normally about -1. null: there are too few checkpoints.",
      only_if(j.trend.has_value(), -trend.slope));
  v.field("slope_ci95", "[low, high]: the 95 % interval of slope.",
          only_if(j.trend.has_value(), Interval(-trend.slope_hi, -trend.slope_lo)));
  v.field("efficiency_per_core", "1 / (relmse x core seconds) at the last checkpoint.", j.efficiency);
  v.field("eta_seconds", "Predicted seconds until the job ends.", j.eta_seconds);
  v.field("eta_ci95", "[low, high]: the 95 % interval of eta_seconds, for a job that ends at a target error.",
          j.eta_ci95);
  v.field("eta_with_more",
          "Predicted time left with more workers like the present ones. null: more workers would not help.",
          j.eta_with_more ? std::optional(MoreWorkersView{*j.eta_with_more, j.eta_with_more_ci95})
                          : std::nullopt);
  v.field("error", "Why the job failed or does not progress.", unless_empty(j.error));
  v.field("failure",
          "Why the job failed, as data. null: it has not failed, or not because of a unit that could not be "
          "rendered; then `error` says why. Always null in lists.",
          j.failure);
  v.field(
      "after",
      "The jobs that this job waits for and that are not done yet. Until they are done it is `queued` and "
      "gets no worker. For a sequence: those of its first waiting frame.",
      j.after);
  v.field(
      "waits_for",
      "The same as `after`, in a sentence. If one of those jobs failed, was cancelled or was removed, the "
      "sentence says what to do, and is also in `error`.",
      unless_empty(j.waits_for));
  v.field("denoised",
          "Error of the denoised layers of a job that is done. null: the job has no denoised layers, or is a "
          "sequence.",
          j.denoised);
  v.field("warnings", "Warnings about the scene.", j.warnings);
  v.field("fake", "True if fake workers (--fake) computed the pixels. The image does not show the scene.",
          j.fake);
  v.field("size", "[width, height] in pixels.", std::array{j.size.width, j.size.height});
  v.field("tile", "Side of a tile in pixels.", j.tile);
  v.field(
      "meters",
      "Number of values that the job measures (GET /api/v1/jobs/{id}/meters). Each has a square of 16 x 16 "
      "pixels of the image. 0: the job makes an image.",
      j.meters);
  v.field("priority", "", j.priority);
  v.field("focus",
          "[x0, y0, x1, y1]: tiles in this rectangle get the next samples first. null: all tiles are treated "
          "alike. For a sequence: the rectangle of all frames, if it is the same.",
          j.focus ? std::optional(corners(*j.focus)) : std::nullopt);
  v.field("max_workers", "Largest number of workers that may render the job at once.", j.max_workers);
  v.field("max_units", "Largest number of units of the job that may be leased at once.", j.max_units);
  v.field("memory_bytes", "Memory that a worker must at least have to get units of the job.", j.memory_bytes);
  v.field("numeric_class", "The numeric class whose workers render the job. null: not decided yet.",
          j.numeric_class ? std::optional(j.numeric_class->hex()) : std::nullopt);
  v.field("platform", "Processor, compiler and Embree version of that class.", unless_empty(j.platform));
  v.field("class_share",
          "How much of the farm can render the job: the connected workers of its numeric class and their "
          "threads, beside those of all classes. `share` is the class's share of all threads, null if no "
          "worker is connected. null for a job without a class, for one that has ended, and for a sequence.",
          j.class_share);
  v.field("units_done", "", j.units_done);
  v.field("units_total", "", j.units_total);
  v.field("elapsed_seconds", "Seconds since the job's first ray.", j.elapsed_seconds);
  v.field("core_seconds", "CPU seconds that workers spent on the job's units.", j.core_seconds);
  v.field("queued_core_seconds",
          "Predicted CPU seconds of the units that no worker holds. 0 also if nothing was measured yet.",
          j.queued_core_seconds);
  v.field("time", "", j.time);
  v.field("submitted_unix", "Time of submission in seconds since 1970.", j.submitted_unix);
  v.field("sequence", "For a frame: the id of its sequence.",
          frame ? std::optional(frame->sequence.value) : std::nullopt);
  v.field("frame", "For a frame: its number.", frame ? std::optional(frame->frame) : std::nullopt);
  v.field("frames",
          "For a sequence: its frames. The other figures of a sequence combine all frames: sums, and means "
          "over pixels (errors: over the frames that have them). elapsed_seconds runs from the first ray of "
          "any frame to the last result.",
          j.frames);
  v.field("health", "", HealthView{j.health, j.notes});
}

template <class V, job::Of<TileView> T>
void describe(V& v, T& t) {
  v.field("tile", "", t.tile);
  v.field("rect", "[x0, y0, x1, y1] in pixels; x1 and y1 are exclusive.", corners(t.rect));
  v.field("rounds", "Rounds that are part of the image.", t.rounds_folded);
  v.field("spp", "", t.spp);
  v.field("relmse", "Estimated error of the tile. null until it has samples.", t.relmse);
  v.field("workers", "Names of the workers that render the tile now.", t.workers);
}

template <class V, job::Of<WorkerView> T>
void describe(V& v, T& w) {
  static constexpr std::array<std::string_view, 6> kStates{"connected", "draining", "restarting",
                                                           "lost",      "sick",     "gone"};
  v.field("id", "", w.id.value);
  v.field("name", "", w.name);
  v.field("build", "", w.build);
  v.field("numeric_class", "", w.numeric_class.hex());
  v.field("platform",
          "Processor, compiler and Embree version of the worker's numeric class. null: the worker did not "
          "send it.",
          unless_empty(w.platform));
  v.field("fake",
          "True for a fake worker (--fake): it invents pixels instead of rendering, for tests of a farm.",
          w.fake);
  v.field("threads", "", w.threads);
  v.field("tags", "", w.tags);
  v.field("state", "", Word{w.state, kStates});
  v.field("activity", "What the worker does now, or what is wrong with it.", w.activity);
  v.field("job", "Id of the job that it works on.", unless_empty(w.job));
  v.field("units_done", "", w.units_done);
  v.field("cpu_seconds", "", w.cpu_seconds);
  v.field("rss_bytes", "", w.rss_bytes);
  v.field("memory_bytes", "Memory that the worker may use. 0: the worker did not send it.", w.memory_bytes);
  v.field("last_seen_seconds", "Seconds since the worker's last message.", w.last_seen_seconds);
}

template <class V, job::Of<VideoView> T>
void describe(V& v, T& video) {
  static constexpr std::array<std::string_view, 5> kStates{"none", "waiting", "making", "ready", "failed"};
  const bool asked = video.state != VideoState::none;
  v.field("state", "", Word{kStates[static_cast<std::size_t>(video.state)], kStates});
  v.field("fps", "Frames per second. null: there is no video.", only_if(asked, video.asked.fps.value_or(0)));
  v.field("exposure", "Exposure in stops.", only_if(asked, video.asked.look.exposure));
  v.field("layer", "The layer that the video shows: rgb or denoised.",
          only_if(asked, std::string(video.asked.look.denoised ? "denoised" : "rgb")));
  v.field("view", "The view of its colours (GET /api/v1/views).",
          only_if(asked, video.asked.look.view.empty() ? std::string("sRGB") : video.asked.look.view));
  v.field("frames", "Number of frames in the finished video.", video.frames);
  v.field("frames_done", "Number of frames that are encoded so far.", video.frames_done);
  v.field("bytes", "Size of the finished video.", only_if(video.state == VideoState::ready, video.bytes));
  v.field("error", "Why the video failed.", unless_empty(video.error));
}

}  // namespace ls::coordinator

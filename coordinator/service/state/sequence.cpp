#include "coordinator/service/state/job_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ls::coordinator {
namespace {

double pixels_of(const JobView& frame) { return static_cast<double>(frame.size.width) * frame.size.height; }

// Returns the mean error over the pixels of all frames that have an estimate. The estimates are independent,
// since frames have different seeds: the half-widths of their intervals add in quadrature.
std::optional<ErrorFigures> error_of(std::span<const JobView> frames) {
  double pixels = 0;
  for (const JobView& f : frames)
    if (f.error_now) pixels += pixels_of(f);
  if (pixels == 0) return std::nullopt;
  double square = 0, relmse = 0, below = 0, above = 0;
  for (const JobView& f : frames) {
    if (!f.error_now) continue;
    const ErrorFigures& e = *f.error_now;
    const double share = pixels_of(f) / pixels;
    square += share * e.rmse * e.rmse;
    relmse += share * e.relmse;
    below += std::pow(share * (e.relmse - e.relmse_lo), 2);
    above += std::pow(share * (e.relmse_hi - e.relmse), 2);
  }
  return ErrorFigures{std::sqrt(square), relmse, relmse - std::sqrt(below), relmse + std::sqrt(above)};
}

// Sets the convergence status to the worst one of the frames. A mean would hide a single frame that cannot be
// trusted.
void put_worst(JobView& v, std::span<const JobView> frames) {
  std::optional<ConvergenceStatus>& worst = v.convergence_status;
  for (const JobView& f : frames) {
    if (!f.convergence_status || (worst && (!worst->trusted || f.convergence_status->trusted))) continue;
    worst = f.convergence_status;
    v.lit = f.lit;
    if (const auto id = frame_of(f.id); id && !worst->trusted)
      worst->words = fmt::format("frame {}: {}", id->frame, worst->words);
  }
}

FramesView count(std::span<const JobView> frames, const FrameRange& range) {
  FramesView v;
  v.range = range;
  v.total = static_cast<std::uint32_t>(frames.size());
  const JobView* current = nullptr;
  for (const JobView& f : frames) {
    v.done += f.state == JobState::done;
    v.running += f.state == JobState::running;
    v.failed += f.state == JobState::failed;
    v.cancelled += f.state == JobState::cancelled;
    if (!current && f.state == JobState::running) current = &f;
  }
  if (!current)  // no frame is running: take the last one with finished units
    for (const JobView& f : frames)
      if (f.units_done > 0) current = &f;
  if (!current) current = &frames.front();
  if (const auto id = frame_of(current->id)) v.current = id->frame;
  return v;
}

// Sets the error to that of the first failed frame. If no frame failed, to that of the first frame that has
// not ended and has one; leaves it empty if none has.
void put_trouble(JobView& v, std::span<const JobView> frames) {
  const JobView* found = nullptr;
  for (const JobView& f : frames)
    if (!found && f.state == JobState::failed && !f.error.empty()) found = &f;
  const auto in_trouble = [](const JobView& f) { return !is_terminal(f.state) && !f.error.empty(); };
  if (!found) {
    const auto first = std::find_if(frames.begin(), frames.end(), in_trouble);
    if (first != frames.end()) found = &*first;
  }
  if (!found) return;
  const auto id = frame_of(found->id);
  v.error = id ? fmt::format("frame {}: {}", id->frame, found->error) : found->error;
  v.failure = found->failure;
  if (v.failure && id) v.failure->frame = id->frame;
}

struct WorkLeft {
  double core_left = 0, core_queued = 0;
  // Seconds in which a worker loads frames and prepares them for rendering; meanwhile it renders none of
  // their units
  double load_left = 0, load_queued = 0;
  double frames = 0;  // number of frames that are left; parts of a frame count in part
  std::uint64_t units = 0;
};

// Predicts the remaining work. A frame that has not begun is expected to cost as much as the others on
// average: the sum of their core seconds so far, divided by the sum of their progress (0 to 1 each). A frame
// that has results is loaded already.
WorkLeft work_left(std::span<const JobView> frames) {
  double spent = 0, progress = 0, loading = 0, loaded = 0;
  WorkLeft out;
  for (const JobView& f : frames) {
    if (f.units_done == 0) continue;
    spent += f.core_seconds, progress += f.progress;
    loading += f.time.load + f.time.build, loaded += 1;
  }
  const double each = progress > 0 ? spent / progress : 0, each_load = loaded > 0 ? loading / loaded : 0;
  for (const JobView& f : frames) {
    if (is_terminal(f.state)) continue;
    out.core_left += each * (1 - f.progress);
    out.load_left += f.units_done > 0 ? 0 : each_load;
    out.frames += 1 - f.progress;
    out.units += f.units_total - std::min(f.units_total, f.units_done);
    if (f.state == JobState::queued) {
      out.core_queued += f.queued_core_seconds > 0 ? f.queued_core_seconds : each;
      out.load_queued += each_load;
    } else if (f.state == JobState::running) {
      out.core_queued += f.queued_core_seconds;
    }
  }
  return out;
}

void add_up(JobView& v, std::span<const JobView> frames) {
  double pixels = 0;
  v.spp_done = v.progress = 0;
  v.fake = false;
  for (const JobView& f : frames) {
    v.fake |= f.fake;
    pixels += pixels_of(f);
    v.spp_done += f.spp_done * pixels_of(f);
    v.progress += f.progress * pixels_of(f);
    v.units_done += f.units_done;
    v.units_total += f.units_total;
    v.core_seconds += f.core_seconds;
    v.time.add(f.time);
    v.health.nonfinite += f.health.nonfinite;
    v.health.negative += f.health.negative;
    v.health.majorant_violations += f.health.majorant_violations;
    if (const auto id = frame_of(f.id)) add_notes(v.notes, f.notes, id->frame);
  }
  if (pixels > 0) v.spp_done /= pixels, v.progress /= pixels;
}

// Returns how many workers of the farm may render the sequence at the same time.
double workers_for(const JobView& v, const SequenceFacts& facts) {
  const double workers = facts.workers;
  return v.max_workers ? std::min(workers, static_cast<double>(*v.max_workers)) : workers;
}

// Returns how many cores of the farm the sequence can use. The number is limited by the sequence's limits on
// workers and units, and by its number of remaining units, since a unit runs on one thread.
double cores_for(const JobView& v, const SequenceFacts& facts, std::uint64_t units_left) {
  double cores = facts.cores;
  if (facts.workers > 0) cores *= workers_for(v, facts) / facts.workers;
  if (v.max_units) cores = std::min(cores, static_cast<double>(*v.max_units));
  return units_left > 0 ? std::min(cores, static_cast<double>(units_left)) : cores;
}

}  // namespace

JobState sequence_state(std::span<const JobView> frames) {
  bool open = false, all_paused = true, begun = false, failed = false, cancelled = false;
  for (const JobView& f : frames) {
    failed |= f.state == JobState::failed;
    cancelled |= f.state == JobState::cancelled;
    begun |= f.state != JobState::queued && f.state != JobState::paused;
    if (is_terminal(f.state)) continue;
    open = true;
    all_paused &= f.state == JobState::paused;
  }
  if (!open) return failed ? JobState::failed : cancelled ? JobState::cancelled : JobState::done;
  if (all_paused) return JobState::paused;
  return begun ? JobState::running : JobState::queued;
}

FrameView frame_view(const JobView& f) {
  const auto id = frame_of(f.id);
  return {id ? id->frame : 0,
          f.id,
          f.state,
          f.progress,
          f.spp_done,
          f.error_now ? std::optional(f.error_now->relmse) : std::nullopt,
          f.error};
}

JobView sequence_view(const SequenceFacts& facts, std::span<const JobView> frames) {
  const JobView& first = frames.front();
  JobView v;
  v.id = facts.id;
  v.name = first.name;
  v.owner = first.owner;
  v.max_workers = first.max_workers;
  v.max_units = first.max_units;
  v.state = sequence_state(frames);
  if (v.state == JobState::done) {
    const auto same = [&](const JobView& f) { return f.stopped == first.stopped; };
    v.stopped = std::all_of(frames.begin(), frames.end(), same) ? first.stopped : "";
  }
  v.spp = first.spp;
  v.denoise = first.denoise;
  v.deep = first.deep;
  v.target_error = first.target_error;
  v.target_layer = first.target_layer;
  v.spp_asked = first.spp_asked;
  v.error_now = error_of(frames);
  put_worst(v, frames);
  for (const JobView& f : frames)
    if (f.few_hits) v.few_hits = v.few_hits.value_or(0) + *f.few_hits;
  put_trouble(v, frames);
  if (const auto waits = std::ranges::find_if(frames, [](const JobView& f) { return !f.after.empty(); });
      waits != frames.end()) {
    v.after = waits->after;
    v.waits_for = fmt::format("frame {} {}", frame_of(waits->id)->frame, waits->waits_for);
  }
  v.warnings = facts.warnings;
  v.size = first.size;
  v.tile = first.tile;
  v.meters = first.meters;
  v.priority = first.priority;
  const auto same_focus = [&](const JobView& f) { return f.focus == first.focus; };
  if (std::all_of(frames.begin(), frames.end(), same_focus)) v.focus = first.focus;
  v.elapsed_seconds = facts.elapsed_seconds;
  v.submitted_unix = first.submitted_unix;
  add_up(v, frames);
  if (v.state == JobState::done) v.progress = 1;
  const WorkLeft out = work_left(frames);
  // A worker that loads a frame keeps all its threads from rendering the frame.
  v.queued_core_seconds =
      out.core_queued + out.load_queued * (facts.workers > 0 ? facts.cores / facts.workers : 1);
  const bool goes_on = v.state == JobState::running || v.state == JobState::queued;
  if (const double cores = cores_for(v, facts, out.units); goes_on && out.core_left > 0 && cores > 0)
    v.eta_seconds = std::max(out.core_left / cores + out.load_left / std::max(1., workers_for(v, facts)),
                             out.frames * facts.frame_seconds);
  v.frames = count(frames, facts.range);
  return v;
}

}  // namespace ls::coordinator

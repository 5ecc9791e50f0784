#include "coordinator/service/state/job_views.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "coordinator/admission/admission.h"
#include "coordinator/domain/limits.h"
#include "coordinator/service/state/prerequisites.h"
#include "core/base/clock.h"

namespace ls::coordinator {
namespace {

struct CoreSeconds {
  double to_end = 0;
  std::optional<std::pair<double, double>> ci95;
};

// Predicts the core seconds that the job still needs; nullopt: unknown. Raises out.progress to the progress
// towards the target error if that is greater.
std::optional<CoreSeconds> core_seconds_left(const EtaInputs& facts, std::span<const ErrorPoint> points,
                                             Eta& out) {
  const auto known = [](double core) {
    return core > 0 ? std::optional(CoreSeconds{core, {}}) : std::nullopt;
  };
  const auto forecast = facts.target && !points.empty() ? forecast_of(points, *facts.target) : std::nullopt;
  if (!forecast) return known(facts.core_left);
  const ErrorPoint& last = points.back();
  const double more = std::max(0.0, forecast->spp - last.spp);
  if (last.spp > 0) out.progress = std::max(out.progress, last.spp / (last.spp + more));
  const double spent = std::max(0.0, facts.core_seconds - last.core_seconds);
  const double limit =
      facts.core_to_limit > 0 ? facts.core_to_limit : std::numeric_limits<double>::infinity();
  if (forecast->core_seconds - spent >= limit) return known(limit);
  const auto from_now = [&](double core) { return std::clamp(core - spent, 0.0, limit); };
  return CoreSeconds{from_now(forecast->core_seconds),
                     {{from_now(forecast->core_seconds_lo), from_now(forecast->core_seconds_hi)}}};
}

// A job lasts longer than its work divided by its threads, because at its end some threads find no more units
// that the job needs. These constants are the extra time as a multiple of u, the duration of one unit.
//
// kEven is for a job that ends at its number of samples: its units are known in advance, and all threads
// finish at about the same time. The others are the least, mean and greatest extra time of a job that ends at
// a target error. While the last needed unit is rendered, the other threads have no needed unit for between 0
// and 1 u (Graham 1969: a list schedule of work W on P threads takes at most W / P + (1 - 1 / P) u). Threads
// without a needed unit render others, which will be dropped. So the last needed unit may itself have waited
// up to 1 u for a free thread; together this is up to 2 u.
constexpr double kEven = 0, kLeastWait = 0, kMeanWait = .5, kMostWait = 2;

// Returns the wall-clock seconds that `core` core seconds of work take on `cores` cores. A unit runs on one
// thread. So at most facts.units_at_once cores are busy, and the result is at least the duration of one unit
// (facts.unit_seconds), or `core` if less work than that is left. `wait` is kEven, kLeastWait, kMeanWait or
// kMostWait.
double seconds_on(double cores, double core, double wait, const EtaInputs& facts) {
  const double busy = facts.units_at_once > 0 ? std::min(cores, facts.units_at_once) : cores;
  const double waits = wait * facts.unit_seconds * std::max(0.0, 1 - 1 / busy);
  return std::max(std::min(core / busy + waits, std::max(core, core / busy)),
                  std::min(core, facts.unit_seconds));
}

double pixels_of(const TileGrid& grid) { return static_cast<double>(grid.frame.width) * grid.frame.height; }

// Returns the progress of a job with `spp_done` samples, from 0 to 1. It counts samples, not units: units of
// late rounds have many times the samples of the first ones.
double done_of(const StoredJob& job, double spp_done) {
  return job.spp ? std::min(1.0, spp_done / static_cast<double>(even_spp(*job.spp))) : 0;
}

// Sets the convergence status, trend and efficiency of `v` from `all`, the points of the job's convergence
// curve. `doubt`: why the error figures are not trusted; empty if they are (JobTotals::doubt).
void put_curve(JobView& v, const std::vector<ConvergencePoint>& all, const std::string& doubt) {
  const std::vector<ErrorPoint> points = error_points(all, !v.reference_same_seed);
  v.convergence_status = judge(points, doubt);
  v.trend = trend_of(points);
  const double cost = points.empty() ? 0 : points.back().relmse * points.back().core_seconds;
  if (cost > 0) v.efficiency = 1 / cost;
}

}  // namespace

Eta eta_of(const EtaInputs& facts, std::span<const ErrorPoint> points) {
  Eta out;
  out.progress = facts.done;
  const auto core = core_seconds_left(facts, points, out);
  if (facts.cores > 0 && core) {
    const auto on = [&](double cores) {
      return core->ci95 ? std::optional(std::pair(seconds_on(cores, core->ci95->first, kLeastWait, facts),
                                                  seconds_on(cores, core->ci95->second, kMostWait, facts)))
                        : std::nullopt;
    };
    const double wait = core->ci95 ? kMeanWait : kEven;
    out.seconds = seconds_on(facts.cores, core->to_end, wait, facts);
    out.ci95 = on(facts.cores);
    const double more = std::max(facts.cores, facts.cores_with_more);
    if (const double sooner = seconds_on(more, core->to_end, wait, facts); sooner < *out.seconds) {
      out.with_more = sooner;
      out.with_more_ci95 = on(facts.cores_with_more);
    }
  }
  if (!facts.time) return out;
  out.progress = std::max(out.progress, std::min(1.0, facts.elapsed / *facts.time));
  const double left = std::max(0.0, *facts.time - facts.elapsed);
  if (!out.seconds || left < *out.seconds) return {out.progress, left, {}, {}, {}};
  return out;
}

// Predicts when the job will be done. Uses the elapsed seconds, core seconds and samples of `v`, which must
// be set.
Eta JobViews::eta(const JobEntry& entry, const JobFigures& figures, const JobView& v) const {
  const StoredJob& job = entry.stored;
  EtaInputs facts;
  facts.done = done_of(job, v.spp_done);
  facts.core_seconds = v.core_seconds;
  facts.core_left = figures.core_seconds_left;
  facts.core_to_limit = figures.core_seconds_to_limit;
  // The convergence curve has the errors of the image before denoising. They do not show when the denoised
  // layers reach a target.
  if (job.spec.target_layer == TargetLayer::raw) facts.target = job.spec.target_error;
  facts.time = job.spec.time;
  facts.elapsed = v.elapsed_seconds;
  const double cores = farm_.cores_connected();
  const int workers = farm_.workers_connected();
  facts.cores = figures.cores > 0 ? figures.cores : cores;
  const int room =
      job.spec.max_workers ? std::max(0, static_cast<int>(*job.spec.max_workers) - workers) : kMoreWorkers;
  if (workers > 0)
    facts.cores_with_more = facts.cores + static_cast<double>(std::min(room, kMoreWorkers)) * cores / workers;
  facts.units_at_once = static_cast<double>(entry.grid.count()) * kRoundsAhead;
  if (job.spec.max_units) facts.units_at_once = std::min<double>(facts.units_at_once, *job.spec.max_units);
  if (figures.units_total > figures.units_done)
    facts.unit_seconds =
        figures.core_seconds_to_limit / static_cast<double>(figures.units_total - figures.units_done);
  return eta_of(facts, error_points(entry.points));
}

JobView JobViews::job(const JobEntry& entry) const {
  const StoredJob& job = entry.stored;
  JobView v;
  v.id = job.id;
  v.name = job.name;
  v.owner = job.owner;
  v.state = job.state;
  v.stopped = v.state == JobState::done && job.stopped ? std::string(to_string(*job.stopped)) : "";
  if (v.state == JobState::cancelled) v.stopped = to_string(StopReason::user);
  v.target_error = job.spec.target_error;
  v.target_layer = job.spec.target_layer;
  if (!job.denoised_checks.empty()) v.denoised_check = job.denoised_checks.back();
  v.denoise = job.spec.denoise;
  v.deep = job.settings.deep;
  if (job.state == JobState::done) v.denoised = job.denoised;
  v.error = job.error.empty() ? entry.trouble : job.error;
  v.failure = job.failure;
  v.warnings = job.warnings;
  v.fake = job.fake;
  v.numeric_class = job.numeric_class;
  v.platform = job.platform;
  v.size = job.settings.size;
  v.tile = job.settings.tile;
  v.meters = job.settings.meters;
  v.priority = job.spec.priority;
  v.focus = job.focus;
  v.max_workers = job.spec.max_workers;
  v.max_units = job.spec.max_units;
  v.memory_bytes = memory_need(job);
  v.elapsed_seconds = entry.elapsed(clock_.now());
  v.core_seconds = job.totals.core_seconds;
  v.time = split_of(job.totals);
  v.submitted_unix = job.submitted_unix;
  v.health = entry.assembly ? entry.assembly->health().total() : job.totals.health;
  v.notes = health_notes(v.health, replay_of(job));
  v.spp = even_spp(job.spp.value_or(kMaxSppWithoutLimit));
  v.spp_asked = job.spp.has_value();
  v.spp_done = job.totals.spp_done;
  v.units_done = job.totals.units;
  v.units_total = std::max(job.totals.units, job.totals.units_planned);
  if (!entry.points.empty()) v.error_now = entry.points.back().error;
  v.reference_error = last_reference_error(entry.points);
  v.reference_same_seed = job.reference_same_seed;
  v.few_hits = job.totals.few_hits;
  v.lit = job.totals.lit;
  if (v.few_hits) put_curve(v, entry.points, job.totals.doubt);
  if (entry.assembly) v.pixels_without_samples = entry.assembly->film().pixels_without_samples();
  if (entry.assembly)
    v.spp_done = static_cast<double>(entry.assembly->film().samples()) / pixels_of(entry.grid);
  v.progress = done_of(job, v.spp_done);
  const auto figures = entry.unloaded ? std::nullopt : farm_.job(job.id);
  if (figures) {
    v.spp = figures->spp;
    v.units_done = figures->units_done;
    v.units_total = figures->units_total;
    v.queued_core_seconds = figures->core_seconds_queued;
    if (!is_terminal(v.state)) v.class_share = figures->class_share;
    const Eta out = eta(entry, *figures, v);
    v.progress = out.progress;
    Waiting other = waiting_of(jobs_, job);
    v.after = std::move(other.after);
    v.waits_for = std::move(other.words);
    if (v.error.empty() && other.held) v.error = v.waits_for;
    const std::string waits = entry.finishing ? "" : farm_.why_waiting(job.id);
    if (v.error.empty()) v.error = waits;
    if (waits.empty() && v.after.empty() && (v.state == JobState::running || v.state == JobState::queued)) {
      v.eta_seconds = out.seconds;
      v.eta_ci95 = out.ci95;
      v.eta_with_more = out.with_more;
      v.eta_with_more_ci95 = out.with_more_ci95;
    }
  }
  if (v.state == JobState::done) v.progress = 1;
  return v;
}

namespace {

// Returns the wall-clock seconds between the ends of two successive frames, mean over the last kFramesTimed
// frames that are done; 0 if fewer than two are. Only the last ones count, since workers come and go.
double seconds_between_ends(const Sequence& sequence) {
  constexpr std::size_t kFramesTimed = 16;
  std::vector<double> ends;
  for (const EntryPtr& frame : sequence.frames)
    if (frame->stored.state == JobState::done && frame->stored.totals.ended_unix > 0)
      ends.push_back(frame->stored.totals.ended_unix);
  if (ends.size() < 2) return 0;
  std::sort(ends.begin(), ends.end());
  const std::size_t gaps = std::min(kFramesTimed, ends.size() - 1);
  return (ends.back() - ends[ends.size() - 1 - gaps]) / static_cast<double>(gaps);
}

}  // namespace

JobView JobViews::sequence(const JobId& id, const Sequence& sequence, bool with_frames) const {
  std::vector<JobView> views;
  views.reserve(sequence.frames.size());
  bool open = false;
  double began = 0, ended = 0;
  for (const EntryPtr& frame : sequence.frames) {
    views.push_back(job(*frame));
    open |= !is_terminal(views.back().state);
    const JobTotals& totals = frame->stored.totals;
    if (totals.began_unix > 0) began = began > 0 ? std::min(began, totals.began_unix) : totals.began_unix;
    ended = std::max(ended, totals.ended_unix);
  }
  SequenceFacts facts{.id = id,
                      .range = sequence.range(),
                      .warnings = sequence.warnings,
                      .cores = farm_.cores_connected(),
                      .workers = farm_.workers_connected()};
  facts.frame_seconds = seconds_between_ends(sequence);
  if (began > 0)
    facts.elapsed_seconds = std::max(0.0, (open || ended == 0 ? system_unix_seconds() : ended) - began);
  JobView view = sequence_view(facts, views);
  if (with_frames)
    for (const JobView& v : views) view.frames->all.push_back(frame_view(v));
  return view;
}

WorkerView JobViews::worker(const WorkerId& id, const WorkerEntry& worker) const {
  const auto figures = farm_.worker(id).value_or(WorkerFigures{WorkerState::lost, 1, 0, 0, 0, {}});
  WorkerView v;
  v.id = id;
  v.name = worker.hello.name;
  v.build = worker.hello.build;
  v.numeric_class = worker.hello.numeric_class;
  v.platform = worker.hello.platform;
  v.fake = worker.hello.fake;
  v.threads = worker.hello.threads;
  v.tags = worker.hello.tags;
  v.state = to_string(figures.state);
  v.activity = worker.trouble.empty() ? worker.activity : worker.trouble;
  v.job = figures.job.value;
  v.units_done = figures.units_done;
  v.cpu_seconds = worker.cpu_seconds;
  v.rss_bytes = worker.rss_bytes;
  v.memory_bytes = worker.hello.memory_bytes;
  v.last_seen_seconds = std::max(0.0, seconds(clock_.now() - worker.last_seen));
  return v;
}

}  // namespace ls::coordinator

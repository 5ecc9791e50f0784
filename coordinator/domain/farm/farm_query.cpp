// The public functions of the farm: handle(), which passes an event to the state, and queries, which change
// nothing.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "coordinator/domain/farm/farm_state.h"
#include "core/image/frame/frame.h"

namespace ls::coordinator {
namespace {

std::string in_words(std::uint64_t bytes) {
  const double mebibytes = static_cast<double>(bytes) / (1 << 20);
  return mebibytes < 1000 ? fmt::format("{:.0f} MiB", std::ceil(mebibytes))
                          : fmt::format("{:.1f} GiB", mebibytes / 1024);
}

}  // namespace

std::string class_in_words(const Digest& numeric_class, const std::string& platform) {
  const std::string digits = numeric_class.hex().substr(0, kClassDigits);
  return platform.empty() ? digits : fmt::format("{} ({})", digits, platform);
}

Farm::Farm() : Farm(Options{}) {}
Farm::Farm(Options options) : state_(std::make_unique<State>(std::move(options))) {}
Farm::~Farm() = default;
Farm::Farm(Farm&&) noexcept = default;
Farm& Farm::operator=(Farm&&) noexcept = default;

std::vector<Effect> Farm::handle(const Event& event, TimePoint now) {
  State& state = *state_;
  state.now = std::max(state.now, now);
  state.work_appeared = false;
  state.dirty.clear();
  state.effects.clear();
  std::visit([&](const auto& e) { state.on(e); }, event);
  state.dispatch();
  return std::move(state.effects);
}

Result<void> check_plan(const JobPlan& plan) {
  const TileGrid& grid = plan.grid;
  if (plan.brief.job.empty()) return fail(Errc::invalid_argument, "a job needs an id");
  if (grid.frame.width <= 0 || grid.frame.height <= 0 || grid.tile <= 0) {
    return fail(Errc::invalid_argument, fmt::format("the frame of {} x {} in tiles of {} has no pixels",
                                                    grid.frame.width, grid.frame.height, grid.tile));
  }
  const std::uint64_t tiles = std::uint64_t(grid.columns()) * std::uint64_t(grid.rows());
  const std::uint64_t spp = plan.spp.value_or(kMaxSppWithoutLimit);
  // The samples are checked before round_count() is called: with too many samples, the number of rounds might
  // not fit into 32 bits.
  if (tiles > kMaxTiles || spp > kMaxUnits * 64 || tiles * round_count(spp) > kMaxUnits) {
    return fail(Errc::invalid_argument,
                fmt::format("{} tiles at {} spp are more than {} units; use larger tiles or fewer samples",
                            tiles, spp, kMaxUnits));
  }
  if (plan.target_error && !(*plan.target_error > 0 && std::isfinite(*plan.target_error))) {
    return fail(Errc::invalid_argument, "target_error must be positive");
  }
  if (plan.time && !(*plan.time > 0 && *plan.time <= kMaxSeconds)) {
    return fail(Errc::invalid_argument, "time must be positive, in seconds");
  }
  if (plan.focus && !lies_in(grid.frame, *plan.focus)) {
    return fail(Errc::invalid_argument,
                fmt::format("the focus {} does not lie in the frame of {} x {} pixels", show(*plan.focus),
                            grid.frame.width, grid.frame.height));
  }
  return {};
}

Wanted Farm::wanted(const UnitKey& unit, const Digest& numeric_class) const {
  const Job* job = state_->find(unit.job);
  if (job == nullptr || is_closed(job->state)) return {};
  const UnitCode code = unit_code(unit.round, unit.tile);
  if (unit.tile >= job->units.tiles() || !job->queue.plans(code)) return {};
  Wanted::Verdict verdict = job->units.accepted(code) ? Wanted::Verdict::duplicate : Wanted::Verdict::yes;
  if (job->numeric_class.value_or(numeric_class) != numeric_class) verdict = Wanted::Verdict::other_class;
  return {verdict, job->range(code), job->plan.grid.rect(unit.tile), job->class_kept};
}

Result<JobPlan> Farm::retargeted(const JobId& id, double target_error) const {
  const Job* job = state_->find(id);
  if (job == nullptr) return fail(Errc::not_found, fmt::format("there is no job {}", id.value));
  return State::retargeted(*job, target_error);
}

Result<JobPlan> Farm::extended(const JobId& id, std::uint64_t spp, TimePoint now) const {
  const Job* job = state_->find(id);
  if (job == nullptr) return fail(Errc::not_found, fmt::format("there is no job {}", id.value));
  return State::extended(*job, spp, now);
}

std::optional<JobPlan> Farm::plan(const JobId& id) const {
  const Job* job = state_->find(id);
  return job == nullptr ? std::nullopt : std::optional(job->plan);
}

std::optional<JobFigures> Farm::job(const JobId& id) const {
  const Job* job = state_->find(id);
  if (job == nullptr) return std::nullopt;
  JobFigures f;
  f.state = job->state;
  if (job->state == JobState::done) f.stopped = job->stopping;
  f.spp = job->spp;
  f.units_total = job->queue.planned();
  f.units_done = job->units.accepted_count();
  f.units_leased = job->out.size();
  f.units_queued = job->queued();
  f.units_folded = job->units.folded_count();
  f.rounds_complete = job->units.rounds_complete();
  const double per_sample = job->cost.per_sample();  // CPU seconds per pixel sample; 0: nothing measured yet
  // samples_of_last(undone) estimates how many pixel samples are in this many units that are not done. It
  // assumes that all tiles have the same size and that only the last units in the order of rounds are not
  // done.
  const RoundIndex rounds = job->queue.longest();
  const double pixels = static_cast<double>(job->plan.grid.frame.width) * job->plan.grid.frame.height;
  const double left = static_cast<double>(job->units.tiles());
  const auto samples_of_last = [&](std::uint64_t undone) {
    double samples = 0;
    for (RoundIndex r = rounds; undone > 0 && r-- > 0;) {
      const std::uint64_t units = std::min<std::uint64_t>(undone, job->units.tiles());
      samples +=
          static_cast<double>(units) / left * pixels * static_cast<double>(cut_range(r, job->spp).count());
      undone -= units;
    }
    return samples;
  };
  if (!job->ended()) {
    const double planned = samples_of_last(f.units_total - f.units_done);
    f.core_seconds_left =
        (job->adaptive_running() ? job->adaptive->samples_left().value_or(0) : planned) * per_sample;
    f.core_seconds_to_limit =
        (job->adaptive_running() ? job->adaptive->samples_to_limit() : planned) * per_sample;
    f.core_seconds_queued = samples_of_last(f.units_queued) * per_sample;
  }
  for (const auto& [index, leases] : job->load.leases_at) {
    const Worker& w = *state_->workers.all().at(index);
    f.cores += w.cores() * static_cast<double>(leases) /
               static_cast<double>(std::max<std::size_t>(leases, w.leases.size()));
  }
  f.clock = job->clock;
  f.numeric_class = job->numeric_class;
  if (job->numeric_class) {
    const auto own = state_->workers.of_class(*job->numeric_class), all = state_->workers.of_all_classes();
    f.class_share = ClassShare{own.workers, all.workers, own.threads, all.threads};
  }
  return f;
}

std::optional<WorkerFigures> Farm::worker(const WorkerId& id) const {
  const Worker* worker = std::as_const(state_->workers).find(id);
  if (worker == nullptr) return std::nullopt;
  WorkerFigures f{worker->state(),   worker->threads,    static_cast<std::uint32_t>(worker->leases.size()),
                  worker->units_out, worker->units_done, {}};
  if (!worker->leases.empty()) f.job = state_->leases.find(*worker->leases.begin())->job->plan.brief.job;
  return f;
}

double Farm::believable_seconds(const UnitKey& unit, const WorkerId& worker, double reported,
                                TimePoint at) const {
  const Job* job = state_->find(unit.job);
  if (job == nullptr || unit.tile >= job->units.tiles()) return std::min(reported, kAssumedUnitSeconds);
  const UnitCode code = unit_code(unit.round, unit.tile);
  const Worker* known = std::as_const(state_->workers).find(worker);
  const auto since = known ? state_->held_since(*job, code, *known) : std::nullopt;
  return State::believable(*job, code, known, since, reported, at);
}

namespace {

// Returns why this worker cannot take units of the job now; empty: it may.
std::string why_not(const Job& job, const Worker& worker, TimePoint ticked) {
  if (job.numeric_class && *job.numeric_class != worker.numeric_class)
    return fmt::format("is of another numeric class, {}",
                       class_in_words(worker.numeric_class, worker.platform));
  if (!of_class_asked(job, worker))
    return fmt::format("is of numeric class {} and the job asks for '{}'",
                       class_in_words(worker.numeric_class, worker.platform), job.plan.class_asked);
  if (!job.numeric_class && !worker.may_begin)
    return "is of another version than the coordinator and begins no job";
  if (worker.quarantined) return "is quarantined, since it rendered wrong pixels";
  if (worker.memory_bytes != 0 && job.plan.memory_bytes > worker.memory_bytes)
    return fmt::format("has {} of memory and the job needs at least {}", in_words(worker.memory_bytes),
                       in_words(job.plan.memory_bytes));
  if (!fits(job, worker)) return "lacks a tag that the job asks for";
  if (worker.unhealthy_since) return "is unhealthy";
  if (worker.blocked(job.seq, ticked)) return "failed too many of its units";
  if (worker.draining) return "drains";
  if (worker.pause == Pause::silent) return "does not answer";
  if (worker.pause == Pause::stuck) return "has finished no unit for long";
  if (const FruitlessLeases* fruitless = worker.fruitless_in(job.seq))
    return fmt::format("was given its units {} and rendered none: {}",
                       fruitless->count == 1 ? "once" : fmt::format("{} times", fruitless->count),
                       fruitless->reason);
  return "";
}

}  // namespace

// True if some worker holds units of the job, audits included, and is expected to render them.
bool Farm::State::in_good_hands(const Job& job) const {
  const auto good = [&](const Worker& worker) {
    return worker.pause != Pause::silent && worker.pause != Pause::stuck && !worker.fruitless_in(job.seq);
  };
  if (job.losses_in_a_row >= kLossesInARow) return false;
  for (const auto& [index, held] : job.load.leases_at)
    if (good(*workers.all().at(index))) return true;
  for (const auto& [code, audit] : job.audits)
    if (audit.lease != 0 && good(*leases.all().at(audit.lease).worker)) return true;
  return false;
}

std::string Farm::why_waiting(const JobId& id) const {
  const Job* job = state_->find(id);
  if (job == nullptr || !job->leasable() || job->plan.held || state_->in_good_hands(*job)) return "";
  if (job->losses_in_a_row >= kLossesInARow)
    return fmt::format(
        "{} times in a row the worker that held its units was lost before it finished one; the "
        "last: {}",
        job->losses_in_a_row, job->last_lost);
  // True if the job's units are rendered, and only units that are rendered again for comparison are missing
  const bool checking = job->units.accepted_count() == job->queue.planned() && !job->audits.empty();
  const auto rendered_it = [&](const Worker& worker) {
    return checking && std::none_of(job->audits.begin(), job->audits.end(),
                                    [&](const auto& audit) { return audit.second.asks(worker.index); });
  };
  std::string reasons;
  std::uint32_t named = 0, connected = 0;
  for (const auto& [index, worker] : state_->workers.all()) {
    if (!worker->connected) continue;
    ++connected;
    std::string why = why_not(*job, *worker, state_->ticked);
    if (why.empty() && rendered_it(*worker)) why = "may not check the units that it has rendered itself";
    if (why.empty()) return "";
    if (++named <= kMaxNamedWorkers)
      reasons += fmt::format("{}{} {}", named > 1 ? "; " : "", worker->name, why);
  }
  if (connected == 0) return "no worker is connected";
  if (named > kMaxNamedWorkers) reasons += fmt::format("; and {} more", named - kMaxNamedWorkers);
  return reasons;
}

AuditFigures Farm::audits() const { return state_->audited; }
std::vector<JobRestored::Audit> Farm::open_audits(const JobId& id) const {
  std::vector<JobRestored::Audit> open;
  const Job* job = state_->find(id);
  if (job == nullptr) return open;
  for (const auto& [code, audit] : job->audits) {
    open.push_back({tile_of(code), round_of(code), std::nullopt});
    if (audit.second)
      open.back().second = {state_->workers.name_of(audit.second->first), audit.second->second};
  }
  return open;
}

std::vector<JobId> Farm::take_changed_audits() {
  std::vector<JobId> changed(state_->audits_changed.begin(), state_->audits_changed.end());
  state_->audits_changed.clear();
  return changed;
}

bool Farm::quarantined(const WorkerId& worker) const { return state_->quarantined.contains(worker); }
bool Farm::failure_is_new(const WorkerId& worker, const UnitKey& unit) const {
  const Job* job = state_->find(unit.job);
  const Worker* known = std::as_const(state_->workers).find(worker);
  if (job == nullptr || known == nullptr || job->ended() || unit.tile >= job->units.tiles()) return false;
  const UnitCode code = unit_code(unit.round, unit.tile);
  return job->queue.plans(code) && state_->lease_of(*job, code, *known) != nullptr &&
         !known->blocked(job->seq, state_->now);
}
bool Farm::may_pin(const JobId& id, const WorkerId& worker) const {
  const Job* job = state_->find(id);
  const Worker* known = std::as_const(state_->workers).find(worker);
  return job != nullptr && known != nullptr && state_->may_pin(*job, *known);
}

double Farm::cores_connected() const { return state_->workers.cores(); }
int Farm::workers_connected() const { return state_->workers.connected(); }

}  // namespace ls::coordinator

// A job in the farm. At every moment each planned unit of the job is done (its result is accepted), leased to
// a worker, or queued. The stop rule of a job with a target error (adaptive_stop.h) goes through levels:
// falling thresholds, each of which determines for every tile the round after which it stops. A level is
// identified by the mean number of samples per pixel that the image has there. Terms:
// docs/reference/glossary.md.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "coordinator/domain/adaptive_stop.h"
#include "coordinator/domain/event.h"
#include "coordinator/domain/job_clock.h"
#include "coordinator/domain/job_failure.h"
#include "coordinator/domain/limits.h"
#include "coordinator/domain/unit_queue.h"
#include "coordinator/domain/unit_table.h"
#include "core/image/frame/frame.h"

namespace ls::coordinator {

// The CPU seconds that one pixel sample costs, as results report them: for each tile, and as a running mean
// over the job for tiles that have no result yet. The cost affects the size of leases and their deadlines,
// never a pixel.
class CostModel {
 public:
  explicit CostModel(TileIndex tiles) : tile_cost_(tiles, 0.0f) {}

  // Adds the cost of one result of this tile. An implausible cost (negative, not finite, more than a day) is
  // ignored.
  void measured(TileIndex tile, std::uint64_t pixel_samples, double cpu_seconds) {
    if (!(cpu_seconds >= 0 && cpu_seconds <= kMostUnitSeconds) || pixel_samples == 0) return;
    const double n = static_cast<double>(pixel_samples);
    seconds_ = seconds_ * kMemory + cpu_seconds;
    samples_ = samples_ * kMemory + n;
    tiles_known_ += !knows(tile);
    tile_cost_[tile] = std::max(std::numeric_limits<float>::min(), static_cast<float>(cpu_seconds / n));
  }
  bool known() const { return samples_ > 0; }
  // True if a result of this tile was measured. The costs of tiles may differ by many orders of magnitude, so
  // the mean of other tiles says little about a tile without a result.
  bool knows(TileIndex tile) const { return tile_cost_[tile] > 0; }
  TileIndex tiles_known() const { return tiles_known_; }
  double per_sample() const { return known() ? seconds_ / samples_ : 0; }
  // Predicts the CPU seconds of a unit of this tile with this many pixel samples; 0 if nothing has been
  // measured.
  double predict(TileIndex tile, std::uint64_t pixel_samples) const {
    if (!known()) return 0;
    const double cost = knows(tile) ? tile_cost_[tile] : per_sample();
    return std::max(kLeastSeconds, cost * static_cast<double>(pixel_samples));
  }

 private:
  // The least CPU seconds predicted for a unit, however few samples it has
  static constexpr double kLeastSeconds = 1e-4;
  // Each new result multiplies the sums of earlier results by this factor, so that mainly the last few
  // hundred results count
  static constexpr double kMemory = 1 - 1.0 / 256;
  double seconds_ = 0, samples_ = 0;
  TileIndex tiles_known_ = 0;
  std::vector<float> tile_cost_;
};

// A failed attempt to render a unit. Failures of the infrastructure do not count: a lost worker, a missed
// deadline, or a lease that the worker gave back.
struct FailedAttempt {
  WorkerIndex worker = kNoWorker;
  std::string worker_name;
  std::string principal;  // Worker::principal
  bool proven = false;    // true if the worker had delivered an accepted result before
  UnitFailure failure;
};

// The units of one job that have failed and have no accepted result yet
class UnitFailures {
 public:
  void add(UnitCode code, FailedAttempt attempt);
  void accepted(UnitCode code) { units_.erase(code); }
  // True if this worker has failed on this unit.
  bool failed_on(UnitCode code, WorkerIndex worker) const;
  // True if the unit has failed at min(kUnitFailureWorkers, `principals`) distinct principals and in at least
  // kUnitFailureAttempts attempts. `principals`: number of principals of the connected workers that could
  // render the job. `only_proven`: only those workers count that have delivered results, in both numbers.
  bool exhausted(UnitCode code, std::size_t principals, bool only_proven) const;
  const std::vector<FailedAttempt>& attempts(UnitCode code) const;
  void mark_workers(std::vector<bool>& used) const {
    for (const auto& [code, attempts] : units_)
      for (const FailedAttempt& attempt : attempts) used[attempt.worker] = true;
  }

 private:
  // The latest attempts of each unit; add() limits their number
  std::map<UnitCode, std::vector<FailedAttempt>> units_;
};

// Failures of one worker in one job
struct WorkerFailures {
  std::uint32_t count = 0;
  TimePoint last{};
  bool blocked = false;

  void add(TimePoint now) {
    if (count > 0 && forgiven_at(now)) *this = {};
    ++count;
    last = now;
    blocked = count >= kWorkerFailuresPerJob;
  }
  bool forgiven_at(TimePoint now) const { return now - last >= kForgiveAfter; }
  bool blocked_at(TimePoint now) const { return blocked && !forgiven_at(now); }
};

// Returns why a job fails after these attempts on one unit, of which there is at least one. `replay`:
// JobPlan::replay.
JobFailure failure_after(const std::vector<FailedAttempt>& attempts, const PixelRect& rect,
                         const SampleRange& samples, const std::string& replay);

// The workers that held a lease on a unit but did not deliver its accepted result. If results of a unit
// differ, only these workers may vote on it (farm_trust.cpp). The table is bounded: beyond kMaxVoters the
// entries of the earliest rounds are dropped, and later results of those units are mere claims, not votes.
class VoterTable {
 public:
  // `since`: when the unit was leased to the worker, if the worker may still be rendering it
  void note(UnitCode unit, WorkerIndex worker, std::optional<TimePoint> since = std::nullopt) {
    auto& kept = held_.try_emplace({unit, worker}).first->second;
    if (!kept || (since && *since < *kept)) kept = since;
    if (held_.size() > kMaxVoters) held_.erase(held_.begin());
  }
  bool has(UnitCode unit, WorkerIndex worker) const { return held_.contains({unit, worker}); }
  // Returns the earliest `since` that was noted for this unit and worker; nullopt: there is none.
  std::optional<TimePoint> since(UnitCode unit, WorkerIndex worker) const {
    const auto found = held_.find({unit, worker});
    return found == held_.end() ? std::nullopt : found->second;
  }
  void clear() { held_.clear(); }
  std::size_t size() const { return held_.size(); }
  void mark_workers(std::vector<bool>& used) const {
    for (const auto& [held, since] : held_) used[held.second] = true;
  }

 private:
  std::map<std::pair<UnitCode, WorkerIndex>, std::optional<TimePoint>> held_;
};

// The workers of one numeric class whose leases of a job ended without a result while the job was pinned to
// the class and no result of the class was accepted. A process can connect as any number of workers, so the
// rest of the class is taken to be no better than kFruitlessLeases of them.
struct PassedOver {
  std::set<WorkerIndex> workers;  // kFruitlessLeases at most
  bool has(WorkerIndex worker) const {
    return workers.size() >= kFruitlessLeases || workers.contains(worker);
  }
};

using JobSeq = std::uint64_t;    // number of a job, in the order of submission
using LeaseSeq = std::uint64_t;  // number of a lease, in the order of granting; 0: no lease

// The leases that hold a unit: one, or two if an idle worker renders a copy of it
struct Holders {
  std::array<LeaseSeq, 2> lease{};
  bool full() const { return lease[0] != 0 && lease[1] != 0; }
  bool empty() const { return lease[0] == 0 && lease[1] == 0; }
  bool has(LeaseSeq seq) const { return lease[0] == seq || lease[1] == seq; }
  void add(LeaseSeq seq) { (lease[0] == 0 ? lease[0] : lease[1]) = seq; }
  void remove(LeaseSeq seq) {
    for (LeaseSeq& l : lease) l = l == seq ? 0 : l;
  }
};

// The leased units of one job, or of all jobs of a user or group
struct Load {
  // Number of leased units. A unit that is leased twice counts twice; units of audits do not count
  std::uint32_t units = 0;
  // Number of leases, by worker; a worker without leases has no entry
  std::unordered_map<WorkerIndex, std::uint32_t> leases_at;
};

// An audit: another worker renders the unit of an accepted result again. If the second result differs, a
// third one decides.
struct Audit {
  WorkerIndex first = kNoWorker;  // worker of the accepted result
  // The second result, if it differs from the accepted one
  std::optional<std::pair<WorkerIndex, Digest>> second;
  // A differing result of a worker that held no lease on the unit. It is not a vote, but it causes an audit
  std::optional<std::pair<WorkerIndex, Digest>> claim;
  std::vector<WorkerIndex> tried;  // workers that failed to render the unit for the audit
  // For each lease of the audit that ended without result or failure: its worker
  std::vector<WorkerIndex> fruitless;
  TimePoint since{};      // when the second result arrived or the coordinator restarted
  bool restored = false;  // true if the audit began before the coordinator restarted
  LeaseSeq lease = 0;     // lease under which the unit is rendered; 0: it waits for a worker
  // True if this worker may render the unit for the audit: it has neither delivered a result of this unit nor
  // failed to render it, and neither it nor all workers together have had too many leases of it in vain.
  bool asks(WorkerIndex worker) const {
    return worker != first && (!second || worker != second->first) && (!claim || worker != claim->first) &&
           std::find(tried.begin(), tried.end(), worker) == tried.end() && fruitless.size() < kAuditLeases &&
           std::count(fruitless.begin(), fruitless.end(), worker) < kFruitlessLeases;
  }
};

// A level of the stop rule at which a checkpoint is to be taken: as soon as all rounds of this level are in
// the image.
struct LevelMark {
  std::vector<RoundIndex> rounds;  // number of rounds at this level, by tile
  double spp = 0;                  // samples per pixel, mean over all pixels
  TileIndex missing = 0;           // number of tiles whose rounds of this level are not all in the image yet
};

struct Job {
  Job(JobSeq number, JobPlan asked);

  JobSeq seq;
  JobPlan plan;
  std::uint64_t spp;  // requested samples per pixel (default kMaxSppWithoutLimit), rounded up by even_spp()
  JobState state = JobState::queued;
  // Why the job ends; nullopt: not decided yet. It is set as soon as the last round of every tile is fixed,
  // even if some units are still leased or not in the image yet. It is final once the job is done
  std::optional<StopReason> stopping;
  // Set (to the reason) if the time limit or the user has stopped the job: it ends with the units that were
  // begun until then and the first round of each tile
  std::optional<StopReason> frozen;
  std::optional<Digest> numeric_class;
  // True once a result of the numeric class was accepted. Before that the class is that of the first lease,
  // and is given up if the leases bring no result
  bool class_kept = false;
  // When the class of the first lease was taken, or the job was resumed since
  TimePoint pinned_at{};
  std::map<Digest, PassedOver> passed_over = {};
  // How often the class was given up because it had brought no result for too long (kPinLimit)
  std::uint32_t pins_released = 0;
  JobClock clock;  // of the time limit; it stands still while the job is paused or done

  UnitTable units;
  UnitQueue queue;
  std::unordered_map<UnitCode, Holders> out;  // for each leased unit, the leases that hold it
  CostModel cost;
  UnitFailures failures;
  std::map<UnitCode, Audit> audits;
  // Number of results that were chosen for an audit although no other worker of the numeric class was
  // connected, so that the audit did not begin
  std::uint64_t audits_missed = 0;
  VoterTable voters;
  Load load;
  // How many times a worker was lost that held units of the job, since the latest result; and the latest of
  // these workers' name
  std::uint32_t losses_in_a_row = 0;
  std::string last_lost;
  std::uint32_t leased = 0;   // units under all leases, including audits
  std::set<LeaseSeq> leases;  // all leases of its units, including audits
  bool has_units = false;     // true if it had units to lease when this was last checked
  bool offered = false;       // true if FairShare lists it as a job that has units to lease
  double charge_out = 0;      // core seconds charged for units that are leased now (fair_share.h)
  // Samples per pixel of the latest checkpoint at which all tiles had the same number of rounds; 0: none
  double checkpoint_spp = 0;

  std::optional<AdaptiveStop> adaptive;  // only for a job with a target error
  // AdaptiveStop::level() at which it was last decided whether the image meets the target; 0: none
  double level_seen = 0;
  std::deque<LevelMark> marks;  // levels whose checkpoints are not taken yet, by rising samples per pixel
  // Only for a job whose target error applies to its denoised layers
  std::optional<DenoisedTarget> denoised;
  // Samples per pixel of the level whose denoised error is being computed; 0: none
  double checking_spp = 0;
  // relMSE of the image itself (before denoising) at which the job will probably end; 0: unknown
  double predicted_error = 0;
  double marked_spp = 0;           // samples per pixel of the latest level that was put into `marks`
  std::uint64_t predicted_at = 0;  // AdaptiveStop::rounds_seen() at its latest prediction (foresee())

  bool ended() const { return is_terminal(state); }
  bool leasable() const { return state == JobState::queued || state == JobState::running; }
  bool audit_waits() const {
    return std::any_of(audits.begin(), audits.end(), [](const auto& a) { return a.second.lease == 0; });
  }
  bool complete() const { return units.folded_count() == queue.planned(); }

  SampleRange range(UnitCode code) const { return cut_range(round_of(code), spp); }
  UnitKey key(UnitCode code) const { return {plan.brief.job, tile_of(code), round_of(code)}; }
  std::uint64_t pixel_samples(UnitCode code) const {
    return static_cast<std::uint64_t>(plan.grid.rect(tile_of(code)).pixels()) * range(code).count();
  }
  double predict(UnitCode code) const { return cost.predict(tile_of(code), pixel_samples(code)); }
  std::uint64_t queued() const { return queue.planned() - units.accepted_count() - out.size(); }

  // True if the job has a target error and its stop rule has not yet decided the last round of every tile.
  bool adaptive_running() const { return adaptive && !stopping; }
  // Starts the adaptive stop rule if the plan has a target error, drops the rule if the plan no longer has
  // one, and resets level_seen, so that the image is judged again.
  void steer();
  // Returns the relMSE of the image, before denoising, at which the job will probably end. This is the target
  // error itself, unless the target applies to the denoised layers; nullopt: there is no target, or no
  // prediction yet.
  std::optional<double> predicted_target() const {
    if (!denoised) return plan.target_error;
    return predicted_error > 0 ? std::optional(predicted_error) : std::nullopt;
  }
  // Returns the last round of the tile that may be added to the image now.
  RoundIndex last_foldable(TileIndex tile) const {
    return adaptive_running() ? adaptive->wanted(tile) : std::numeric_limits<RoundIndex>::max();
  }
  // move_windows() sets for every tile which rounds may be leased: only a limited number of rounds after
  // those that are in the image. move_window() does this for one tile. `farm_threads`: number of threads of
  // all connected workers.
  void move_windows(int farm_threads);
  void move_window(TileIndex tile, int farm_threads);
  // Returns the number of rounds that each tile gets if the job stops now: all rounds that were leased or
  // have an accepted result, and at least the first round. Rounds that came back although nobody had begun
  // them do not count, unless a later round of the tile was begun.
  std::vector<RoundIndex> begun() const;
  // Limits each tile to ends[tile] rounds, unless it has fewer already, and forgets accepted results of later
  // rounds. If this shortens any tile, `stopping` becomes `reason`.
  void cut_off(const std::vector<RoundIndex>& ends, StopReason reason);
  void look_at_focus();  // puts the units of the tiles in JobPlan::focus first in the queue
  void plan_all();       // plans all rounds of every tile, up to `spp` samples per pixel
  // Returns the time at which the job's time budget is used up; nullopt: the job has no time budget, or no
  // ray was traced yet.
  std::optional<TimePoint> time_limit(TimePoint now) const;
};

}  // namespace ls::coordinator

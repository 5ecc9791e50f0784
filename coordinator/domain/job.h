// A job in the farm. At every moment each of its planned units is done (accepted), leased or queued.
#pragma once

#include <algorithm>
#include <array>
#include <deque>
#include <limits>
#include <map>
#include <unordered_map>

#include "coordinator/domain/adaptive_stop.h"
#include "coordinator/domain/cost_model.h"
#include "coordinator/domain/event.h"
#include "coordinator/domain/failure_budget.h"
#include "coordinator/domain/unit_queue.h"
#include "coordinator/domain/unit_table.h"
#include "coordinator/domain/voter_table.h"

namespace ls::coordinator {

using JobSeq = std::uint64_t;    // order of submission
using LeaseSeq = std::uint64_t;  // order of leasing; 0: no lease

// The leases that hold a unit: one, or two when an idle worker renders a copy
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

// Units leased at the moment, of a job or of all jobs of a user or group
struct Load {
  std::uint32_t units = 0;                                   // including copies, without audits
  std::unordered_map<WorkerIndex, std::uint32_t> leases_at;  // by worker; never 0
};

// An accepted result that another worker renders again. If the second result differs, a third one decides.
struct Audit {
  WorkerIndex first = kNoWorker;
  std::optional<std::pair<WorkerIndex, Digest>> second;
  // A differing result that was not requested: no vote, but the reason for the audit
  std::optional<std::pair<WorkerIndex, Digest>> claim;
  std::vector<WorkerIndex> tried;  // workers that tried and failed
  TimePoint since{};               // time of the second result, or of the restart
  bool restored = false;           // begun before a restart
  LeaseSeq lease = 0;              // under which it is rendered; 0: waiting
  bool asks(WorkerIndex worker) const {
    return worker != first && (!second || worker != second->first) && (!claim || worker != claim->first) &&
           std::find(tried.begin(), tried.end(), worker) == tried.end();
  }
};

// A level of the adaptive stop rule whose image makes a checkpoint as soon as all of it is folded
struct LevelMark {
  std::vector<RoundIndex> rounds;  // by tile
  double spp = 0;                  // mean over pixels
  TileIndex missing = 0;           // tiles not folded up to their round yet
};

struct Job {
  Job(JobSeq number, JobPlan asked);

  JobSeq seq;
  JobPlan plan;
  std::uint64_t spp;  // the plan's, or kMaxSppWithoutLimit; even
  JobState state = JobState::queued;
  // The end is decided, but leased or unfolded units are still pending; final once done
  std::optional<StopReason> stopping;
  bool frozen = false;  // stopped by time or user: units leased before are still accepted, no others are
  std::optional<Digest> numeric_class;
  std::optional<TimePoint> first_ray;    // shifted by the time that the job has stood still since
  std::optional<TimePoint> still_since;  // while paused or done its time budget does not run

  UnitTable units;
  UnitQueue queue;
  std::unordered_map<UnitCode, Holders> out;  // leased units
  CostModel cost;
  UnitFailures failures;
  std::map<UnitCode, Audit> audits;
  std::uint64_t audits_missed = 0;  // chosen, but no other worker of the class was connected
  VoterTable voters;
  Load load;
  std::uint32_t leased = 0;   // units under all leases, including audits
  bool has_units = false;     // units to lease, when last checked
  bool offered = false;       // is in FairShare
  double charge_out = 0;      // core seconds charged for its leases (fair_share.h)
  double checkpoint_spp = 0;  // of the last checkpoint of whole rounds

  std::optional<AdaptiveStop> adaptive;  // with a target error
  double level_seen = 0;                 // the last level at which the image was judged; 0: none
  std::deque<LevelMark> marks;           // ascending
  double marked_spp = 0;                 // of the last mark
  std::uint64_t predicted_at = 0;        // rounds_seen() at the last call of foresee()

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

  // The tiles' errors decide where the tiles end, and have not decided yet.
  bool adaptive_running() const { return adaptive && !stopping; }
  // Starts, drops or re-evaluates the target.
  void steer();
  RoundIndex last_foldable(TileIndex tile) const {
    return adaptive_running() ? adaptive->wanted(tile) : std::numeric_limits<RoundIndex>::max();
  }
  // Sets how far rounds may be leased ahead of the folded ones, for a farm of this many threads.
  void move_windows(int farm_threads);
  void move_window(TileIndex tile, int farm_threads);
  // Ends each tile after ends[tile] rounds, or earlier if it ends earlier already, and forgets results
  // accepted beyond. Does nothing if no tile ends earlier than before.
  void cut_off(const std::vector<RoundIndex>& ends, StopReason reason);
  void plan_all();  // every tile ends with the requested samples
  std::optional<TimePoint> time_limit(TimePoint now) const;
  // Call both around a change of state that may stop or start the job's clock.
  void stand_still(TimePoint now);
  void go_on(TimePoint now);
};

}  // namespace ls::coordinator

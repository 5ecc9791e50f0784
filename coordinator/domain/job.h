// A job as the farm keeps it. Its planned units are at every moment done (accepted), leased or queued.
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
#include "coordinator/domain/witness_book.h"

namespace ls::coordinator {

using JobSeq = std::uint64_t;    // order of submission
using LeaseSeq = std::uint64_t;  // order of leasing; 0: none

// The leases that hold a unit: one, or two when an idle worker renders a copy.
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

// What is lent at once: of a job, or of all jobs of a user.
struct Load {
  std::uint32_t units = 0;                                   // copies included, audits not
  std::unordered_map<WorkerIndex, std::uint32_t> leases_at;  // by worker, never 0
};

// An accepted result that is rendered again elsewhere. With a second result that differs, a third decides.
struct Audit {
  WorkerIndex first = kNoWorker;
  std::optional<std::pair<WorkerIndex, Digest>> second;
  // What one said that nobody had asked: no vote, but the reason to ask.
  std::optional<std::pair<WorkerIndex, Digest>> claim;
  std::vector<WorkerIndex> tried;  // and failed
  TimePoint since{};               // of the second result, or of the restart
  bool restored = false;           // begun before a restart
  LeaseSeq lease = 0;              // that it is out under; 0: it waits
  bool asks(WorkerIndex worker) const {
    return worker != first && (!second || worker != second->first) && (!claim || worker != claim->first) &&
           std::find(tried.begin(), tried.end(), worker) == tried.end();
  }
};

// A level of the adaptive stop rule whose image makes a checkpoint, until all of it is folded.
struct LevelMark {
  std::vector<RoundIndex> rounds;  // of each tile
  double spp = 0;                  // mean over pixels
  TileIndex missing = 0;           // tiles that are not folded so far
};

struct Job {
  Job(JobSeq number, JobPlan asked);

  JobSeq seq;
  JobPlan plan;
  std::uint64_t spp;  // the plan's, or the limit; even
  JobState state = JobState::queued;
  std::optional<StopReason>
      stopping;         // decided, while what is leased or unfolded is awaited; final once done
  bool frozen = false;  // by time or user: what has been leased once is still wanted, nothing else
  std::optional<Digest> numeric_class;
  std::optional<TimePoint> first_ray;    // moved on by the time that the job stood still since
  std::optional<TimePoint> still_since;  // paused or done: its time budget does not run

  UnitTable units;
  UnitQueue queue;
  std::unordered_map<UnitCode, Holders> out;  // leased units
  CostModel cost;
  UnitFailures failures;
  std::map<UnitCode, Audit> audits;
  std::uint64_t audits_missed = 0;  // chosen, but nobody else of the class was there
  WitnessBook witnesses;
  Load load;
  std::uint32_t lent = 0;     // units out under all leases, of audits too
  bool has_units = false;     // to lend, as last looked at
  bool offered = false;       // stands among those whose turn may come
  double charge_out = 0;      // core seconds that its leases are charged with (share_book.h)
  double checkpoint_spp = 0;  // of the last checkpoint by rounds

  std::optional<AdaptiveStop> adaptive;  // with a target
  double level_seen = 0;                 // the last level at which the image was judged; 0: none
  std::deque<LevelMark> marks;           // ascending
  double marked_spp = 0;                 // of the last mark made
  std::uint64_t foreseen_at = 0;         // rounds seen when the end was last foreseen

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

  // The errors of the tiles decide where they end, and have not yet.
  bool steered() const { return adaptive && !stopping; }
  // A target begins, is given up or judged anew.
  void steer();
  RoundIndex last_foldable(TileIndex tile) const {
    return steered() ? adaptive->wanted(tile) : std::numeric_limits<RoundIndex>::max();
  }
  // How far ahead of what is folded rounds may be leased, for a farm of so many threads.
  void move_windows(int farm_threads);
  void move_window(TileIndex tile, int farm_threads);
  // Ends each tile after so many rounds, or earlier if it ends earlier already. Acceptances beyond are
  // forgotten. Nothing happens if no tile ends earlier than before.
  void cut_off(const std::vector<RoundIndex>& ends, StopReason reason);
  void plan_all();  // every tile ends with the samples asked for
  std::optional<TimePoint> time_limit(TimePoint now) const;
  // Before and after which the state is one in which the job stands still.
  void stand_still(TimePoint now);
  void go_on(TimePoint now);
};

}  // namespace ls::coordinator

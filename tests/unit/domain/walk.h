// A simulated farm for random walks: workers that crash, stall, fail, duplicate, reorder, drain, reconnect
// and bring results late; in some histories one that renders wrong pixels; an assembler that folds later;
// users with limits who pause, extend, stop, cancel and change priorities; a coordinator that restarts. After
// every event the farm audits itself and the walk compares it with its own books; at its end a job's film
// must be what honest workers alone would have made.
#pragma once

#include <deque>
#include <map>
#include <random>
#include <set>
#include <string>

#include "tests/unit/domain/rig.h"

namespace ls::coordinator {

class Walk {
 public:
  explicit Walk(std::uint64_t seed);

  // A number of random events, then fair weather until every job has ended. What went wrong first; empty:
  // nothing.
  std::string run(int events);

 private:
  struct FakeWorker {
    std::uint64_t epoch = 0;
    bool connected = false, stalled = false, crashes = false;
    int threads = 1;
    std::uint64_t numeric_class = 1;
    std::deque<Rig::Held> held;
  };
  struct StoredJob {  // what the service would have stored
    JobPlan plan;
    std::uint64_t errors = 0;               // seed of its tiles' errors
    bool disturbed = false;                 // extended or stopped: where it ends is not foreseen here
    bool reopened = false;                  // ended, and then given a smaller target
    bool discarded = false;                 // some of it was void
    std::vector<std::vector<Digest>> film;  // of each tile, round by round
    std::map<std::pair<TileIndex, RoundIndex>, RecordUnit> accepted;
    std::vector<RoundIndex> fold_asked, folded;
    std::uint64_t done_seen = 0;
  };

  std::uint64_t pick(std::uint64_t n) { return random_() % n; }
  bool chance(int percent) { return static_cast<int>(pick(100)) < percent; }
  std::string worker_name() { return "w" + std::to_string(pick(5)); }
  JobId some_job() {
    return jobs_.empty() ? JobId{} : std::next(jobs_.begin(), static_cast<long>(pick(jobs_.size())))->first;
  }

  void send(const Event& event);
  void see(const Effect& effect);
  void see(const Send& sent);
  void see_fold(const Fold& fold);
  void see_end(const JobId& id, StopReason reason);
  void see_film(const JobId& id);
  void see_faulty_worker(const WorkerFoundFaulty& found);
  void see_discard(const TileDiscarded& discarded);
  void fold(const UnitFolded& folded);
  Digest pixels(const std::string& worker, const UnitKey& unit, const SampleRange& range);
  Farm::Options options() const;
  void check_figures();
  void blame(std::string what) {
    if (wrong_.empty()) wrong_ = std::move(what);
  }

  void step();
  void user_acts();
  void worker_acts();
  void submit();
  void join(const std::string& name);
  void render(const std::string& name);
  void restart();
  void calm_down();
  bool all_ended() const;
  static double error_sum(const StoredJob& job, TileIndex tile, RoundIndex round);

  std::mt19937_64 random_;
  std::string faulty_;  // empty: all are honest
  bool found_ = false;
  std::set<JobId> ended_before_;  // the liar was found, or a restart: what it had rendered of them stands
  ShareLimits limits_;
  double audit_rate_ = 0;
  int restarts_ = 0, submitted_ = 0;
  Farm farm_;
  TimePoint now_{};
  std::map<std::string, FakeWorker> workers_;
  std::map<JobId, StoredJob> jobs_;
  std::deque<UnitFolded> unfolded_;      // asked for, not done
  std::deque<UnitAccepted> on_the_way_;  // results in the network; any may come first, some come twice
  std::string wrong_;
};

}  // namespace ls::coordinator

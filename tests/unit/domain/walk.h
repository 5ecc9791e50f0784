// A simulated farm for random walks: workers that crash, stall, fail, duplicate, reorder, drain, reconnect,
// give all units back, vanish, and bring results late, in some histories one that renders wrong pixels; an
// assembler that folds later; users with limits who pause, extend, stop, cancel and change priorities; a
// coordinator that restarts. After every event the farm checks its invariants (farm_inspector.h), and the
// walk compares its own records with those of the farm. At its end a job's film must be the one that honest
// workers alone would have made.
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

  // Makes this many random events, then only helpful ones until every job has ended. Returns the first
  // problem; empty: there was none.
  std::string run(int events);
  // The same, but then each worker keeps to one habit for good: it renders, gives everything back, only
  // reports, is silent, or vanishes and is replaced again and again. Every job must end, or say why it waits,
  // or wait behind one that says so.
  std::string run_into_foul_weather(int events);

 private:
  enum class Habit { renders, gives_back, only_reports, silent, vanishes };
  struct FakeWorker {
    std::uint64_t epoch = 0;
    bool connected = false, stalled = false, crashes = false, gives_back = false;
    int threads = 1;
    std::uint64_t numeric_class = 1;
    std::deque<Rig::Held> held;
  };
  struct StoredJob {  // the data that the service would have stored
    JobPlan plan;
    std::uint64_t errors = 0;               // seed of the errors of its tiles
    bool disturbed = false;                 // extended or stopped: the test does not predict where it ends
    bool reopened = false;                  // it had ended and then got a smaller target
    bool discarded = false;                 // some of its pixels were void
    std::vector<std::vector<Digest>> film;  // digests of each tile's rounds, in order
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
  void answer_recall();  // a worker gives back what it has not begun of a lease that was recalled
  void restart();
  void calm_down();
  void give_back(const std::string& name);
  void keep_to(Habit habit, std::string& name);
  void settle_results();  // all results and folds that are on their way arrive
  bool all_ended() const;
  static double error_sum(const StoredJob& job, TileIndex tile, RoundIndex round);

  std::mt19937_64 random_;
  std::string faulty_;  // the worker that renders wrong pixels; empty: none
  bool found_ = false;
  // Jobs that had ended when the faulty worker was found, or before a restart: its results in them stay
  std::set<JobId> ended_before_;
  ShareLimits limits_;
  double audit_rate_ = 0;
  int restarts_ = 0, submitted_ = 0, replaced_ = 0;
  // True in histories that end in foul weather: no limits, since a job that waits for another one of its user
  // need not say so
  bool unlimited_ = false;
  Farm farm_;
  TimePoint now_{};
  std::map<std::string, FakeWorker> workers_;
  std::map<JobId, StoredJob> jobs_;
  std::deque<UnitFolded> unfolded_;                    // requested folds that are not done
  std::deque<std::pair<WorkerId, LeaseId>> recalled_;  // leases that workers were asked to give back
  std::deque<UnitAccepted> on_the_way_;  // results in the network: any may arrive first, some arrive twice
  std::string wrong_;
};

}  // namespace ls::coordinator

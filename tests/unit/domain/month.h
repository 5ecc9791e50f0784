// A month of a farm in simulated time: two coordinators; workers that are preempted and replaced, some that
// crash on a unit, some that render wrong pixels; users who pause, resume, cancel, stop and change
// priorities. The second coordinator dies again and again; it is started again with the data that it had
// stored, or the first one takes over its jobs. The first coordinator lives all the time, so that anything
// that it keeps too long shows as growth. After every event the farm checks its invariants
// (farm_inspector.h), and the month compares its own records with those of the farm.
#pragma once

#include <array>
#include <deque>
#include <map>
#include <queue>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "tests/unit/domain/rig.h"

namespace ls::coordinator {

class Month {
 public:
  explicit Month(std::uint64_t seed);

  // Simulates the next hour. Returns the first problem; empty: there was none.
  std::string hour();

  struct Counts {
    std::uint64_t events = 0, submitted = 0, ended = 0, units = 0, again = 0, workers = 0, failures = 0,
                  restarts = 0, takeovers = 0, audits = 0, quarantined = 0, user_acts = 0;
  };
  const Counts& counts() const { return counts_; }
  // The sizes of the containers of the coordinator that lives all the time.
  std::vector<std::pair<std::string, std::size_t>> sizes() const { return ls::coordinator::sizes(farms_[0]); }

 private:
  struct Worker {
    int home = 0;  // the coordinator that it is connected to
    bool connected = false, faulty = false;
    std::uint64_t epoch = 0;
    int threads = 1, busy = 0;
    std::deque<Rig::Held> held;
  };
  struct StoredJob {  // the data that a coordinator would have stored
    JobPlan plan;
    int home = 0;
    bool stopped = false;
    std::optional<TimePoint> ended;
    std::map<std::pair<TileIndex, RoundIndex>, RecordUnit> accepted;
    std::vector<RoundIndex> asked, folded;
    std::vector<std::vector<Digest>> film;
    std::vector<JobRestored::Audit> audits;  // the open audits
  };
  enum class What { submit, user, tick, arrive, leave, rendered, coordinator_dies, coordinator_back, forget };
  struct Due {
    TimePoint at;
    std::uint64_t order;
    What what;
    std::string who;
    Rig::Held unit;
    bool operator<(const Due& o) const { return std::tie(at, order) > std::tie(o.at, o.order); }
  };

  std::uint64_t pick(std::uint64_t n) { return random_() % n; }
  bool chance(double share) { return static_cast<double>(random_() >> 11) * 0x1p-53 < share; }
  Duration about(Duration mean);  // exponentially distributed
  void later(Duration in, What what, std::string who = {}, Rig::Held unit = {});
  void happen(const Due& due);
  void send(int home, const Event& event);
  void see(int home, const Effect& effect);
  void see(const Send& sent);
  void see_fold(int home, const Fold& fold);
  void see_end(const JobId& id);
  void blame(std::string what);
  Farm fresh(int home);

  void submit();
  void user_acts();
  void arrive();
  void leave(const std::string& name);
  void join(const std::string& name, int home);
  void begin_units(const std::string& name);
  void rendered(const std::string& name, const Rig::Held& unit);
  void coordinator_dies();
  void come_back(int home, bool with_results);
  void give(int home, const JobId& id, bool with_results);

  std::mt19937_64 random_;
  int starts_ = 0;  // declared before farms_, whose construction counts it up
  std::array<Farm, 2> farms_;
  std::array<bool, 2> up_{true, true};
  TimePoint now_{};
  std::uint64_t order_ = 0, jobs_made_ = 0;
  std::priority_queue<Due> due_;
  std::map<std::string, Worker> workers_;
  std::map<JobId, StoredJob> jobs_;
  std::set<std::string> liars_;
  std::array<std::set<std::string>, 2> quarantined_;  // one set for each coordinator
  std::deque<std::pair<int, UnitFolded>> to_fold_;
  Counts counts_;
  std::string wrong_;
};

}  // namespace ls::coordinator

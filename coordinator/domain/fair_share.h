// Fair scheduling: the order in which units of jobs are leased, that is, assigned to workers. Higher
// priorities go first; within one priority, users have equal shares, and the jobs of one user go in the order
// in which they were submitted (the frames of a sequence are submitted together, in their order). Shares are
// measured in core seconds: those that results have reported plus those predicted for leased units. The user
// with the smallest share goes next (start-time fair queueing, Goyal et al. 1996, with measured instead of
// declared lengths). Terms: docs/reference/glossary.md.
//
// A user who arrives, or returns after a pause, starts at least at the share of the user who got the last
// lease. So a user gains no turns by waiting, and loses none after having used the farm alone. If two users
// both have work for all workers all the time, their shares differ by at most one lease each, plus errors of
// prediction.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "coordinator/domain/job.h"

namespace ls::coordinator {

class FairShare {
 public:
  // offer() notes that the job has units to lease, and returns true if it had none before. withdraw() notes
  // that it has none.
  bool offer(Job& job);
  void withdraw(Job& job);
  bool empty() const { return ready_ == 0; }

  // charge() adds the predicted core seconds of units that were leased to workers; `seconds` is negative for
  // units that are no longer leased. spend() adds core seconds that a result reported.
  void charge(Job& job, double seconds);
  void spend(Job& job, double seconds);
  // Forgets users who have no work and whose share is not greater than the clock, the share of the user
  // served most recently. If such a user returned, they would start at the clock even if their share had been
  // remembered.
  void tidy();
  // To change the priority of a job, call leave(), change it, and call enter(), which adds the core seconds
  // of the job's leases at the new priority. Then offer() the job again.
  void leave(Job& job);
  void enter(Job& job);

  // The answer of visit(): go on with the next job, go on with the first job of the next user, or stop
  enum class Then { next_job, next_user, stop };
  // Calls visit(job, lag) for the jobs that have units to lease, in the order of turns, as far as its answers
  // say. `lag`, in core seconds, is the share of the job's user minus that of the user who is first in turn
  // at the job's priority.
  using Visit = std::function<Then(Job&, double lag)>;
  void in_turn(const Visit& visit) const;
  // Notes that the job gets a lease: users who arrive later start at the present share of this job's user.
  void served(const Job& job);

  struct Figure {
    std::string owner;
    std::int64_t priority;
    double seconds;
  };
  std::vector<Figure> figures() const;
  std::size_t kept() const;  // number of entries in all tables, which tests use to find leaks

 private:
  struct User {
    double spent = 0, out = 0;     // core seconds that results reported, and those predicted for leased units
    std::uint32_t at_work = 0;     // number of jobs that have units to lease or leased units
    std::map<JobSeq, Job*> ready;  // jobs that have units to lease
    double had() const { return spent + out; }
  };
  struct Turn {
    double had;
    JobSeq first;  // the user's earliest job that has units to lease; if shares are equal, it decides
    User* who;
    bool operator<(const Turn& o) const { return std::tie(had, first) < std::tie(o.had, o.first); }
  };
  // The users that have jobs of one priority
  struct Level {
    double clock = 0;  // the share of the user who was served most recently
    std::map<std::string, User> users;
    std::set<Turn> turns;
  };
  struct Place {
    Level& level;
    User& user;
  };
  Place place_of(const Job& job);
  // Applies `change` to the job's user, and updates the user's position in the order of turns.
  template <class Change>
  void change(Job& job, Change&& change);
  static std::optional<Turn> turn_of(User& user);  // nullopt: no job of the user has units to lease

  std::map<std::int64_t, Level> levels_;  // by minus the priority, so the highest priority is first
  std::size_t ready_ = 0;
  std::set<JobSeq> at_work_;
};

}  // namespace ls::coordinator

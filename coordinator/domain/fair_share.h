// Fair scheduling: the order in which units of jobs are leased, that is, assigned to workers. A unit is one
// round (range of samples) of one tile. Higher priorities go first; within one priority, users have equal
// shares, and so have the jobs of one user (a sequence counts as one job; its frames run in order). Shares
// are measured in core seconds: those that results have reported plus those predicted for leased units. The
// user or job with the smallest share goes next (start-time fair queueing, Goyal et al. 1996, with measured
// instead of declared lengths).
//
// A user or job that arrives, or returns after a pause, starts at least at the share of the one that got the
// last lease. So a user gains no turns by waiting, and loses none after having used the farm alone. If two
// users both have work for all workers all the time, their shares differ by at most one lease each, plus
// errors of prediction.
//
// Every operation costs O(log jobs).
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

  // charge() adds predicted core seconds of units that were leased to the job (negative: no longer leased).
  // spend() adds core seconds that a result reported.
  void charge(Job& job, double seconds);
  void spend(Job& job, double seconds);
  // Forgets users and groups without work whose share is not greater than the clock (the share of the user or
  // group served most recently): if they come back, they start at the clock whether or not their share was
  // remembered. Also forgets all groups of a user without work.
  void tidy();
  // Call leave() before the job's priority changes, and enter() afterwards: enter() adds the core seconds of
  // the job's leases at the new priority. The caller then offers the job again.
  void leave(Job& job);
  void enter(Job& job);

  // Calls visit(job, lag) for the jobs that have units to lease, the next in turn first, until a call returns
  // true; returns true if one did. `lag`, in core seconds, is the sum of two differences of shares: the job's
  // user minus the user who is first in turn, and the job's group minus the first group in turn of that same
  // user. A group is a sequence, or a job that belongs to none. The lag is infinite for jobs below the
  // highest priority that has units to lease.
  using Visit = std::function<bool(Job&, double lag)>;
  bool in_turn(const Visit& visit) const;
  // Notes that the job gets a lease: users and groups that arrive later start at the present shares of its
  // user and its group.
  void served(const Job& job);

  struct Figure {
    std::string owner;
    std::int64_t priority;
    double seconds;
  };
  std::vector<Figure> figures() const;
  std::size_t kept() const;  // number of priorities, users and groups remembered

 private:
  struct Share {
    double spent = 0, out = 0;  // core seconds that results reported, and those predicted for leased units
    std::uint32_t at_work = 0;  // number of its jobs that have units to lease or leased units
    double had() const { return spent + out; }
  };
  template <class T>
  struct Turn {
    double had;
    // The earliest submitted of its jobs with units to lease; of equal shares, the one with the earlier job
    // goes first
    JobSeq first;
    // submission
    T* who;
    bool operator<(const Turn& o) const { return std::tie(had, first) < std::tie(o.had, o.first); }
  };
  struct Group {
    Share share;
    std::map<JobSeq, Job*> ready;
  };
  struct User {
    Share share;
    double clock = 0;  // the share of the group that was served most recently
    std::map<std::string, Group> groups;
    std::set<Turn<Group>> turns;  // groups that have jobs with units to lease
    std::set<JobSeq> ready;
  };
  // All users that have jobs of one priority.
  struct Level {
    double clock = 0;
    std::map<std::string, User> users;
    std::set<Turn<User>> turns;
  };
  struct Place {
    Level& level;
    User& user;
    Group& group;
  };
  Place place_of(const Job& job);
  // Applies `change` to the job's user and group, and updates the positions of both in the order of turns.
  template <class Change>
  void change(Job& job, Change&& change);
  static std::optional<Turn<User>> turn_of(User& user);  // nullopt: no job of the user has units to lease
  static std::optional<Turn<Group>> turn_of(Group& group);
  template <class T>
  static void place(std::set<Turn<T>>& turns, const std::optional<Turn<T>>& before,
                    const std::optional<Turn<T>>& after);

  std::map<std::int64_t, Level> levels_;  // key: minus the priority
  std::size_t ready_ = 0;
  std::set<JobSeq> at_work_;
};

}  // namespace ls::coordinator

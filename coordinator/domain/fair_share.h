// Fair scheduling: the order in which units of jobs are leased, that is, assigned to workers. A unit is one
// round (range of samples) of one tile. Higher priorities go first; within one priority, users have equal
// shares, and so have the jobs of one user (a sequence counts as one job; its frames run in order). Shares
// are measured in core seconds: those that results have reported plus those predicted for leased units. The
// user or job with the smallest share goes next (start-time fair queueing, Goyal et al. 1996, with measured
// instead of declared lengths).
//
// A user or job that arrives, or returns after a pause, starts at least at the share of the user or job that
// got the last lease. So a user gains no turns by waiting, and loses none after having used the farm alone.
// If two users both have work for all workers all the time, their shares differ by at most one lease each,
// plus errors of prediction.
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
  // Forgets users and groups that have no work and whose share is not greater than the clock, the share of
  // the user or group served most recently. If such a user or group returned, it would start at the clock
  // even if its share had been remembered. A group is a sequence, or a job that belongs to none. Also forgets
  // all groups of a user without work.
  void tidy();
  // To change the priority of a job, call leave(), change it, and call enter(), which adds the core seconds
  // of the job's leases at the new priority. Then offer() the job again.
  void leave(Job& job);
  void enter(Job& job);

  // Calls visit(job, lag) for the jobs that have units to lease, in the order of turns, until a call returns
  // true; returns true if one did. `lag`, in core seconds, says how far the job is behind in this order. It
  // is the sum of two differences of shares: that of the job's user minus that of the user who is first in
  // turn, and that of the job's group minus that of the group which is first in turn among the groups of the
  // job's user. The lag is infinite for jobs below the highest priority that has units to lease.
  using Visit = std::function<bool(Job&, double lag)>;
  bool in_turn(const Visit& visit) const;
  // Notes that the job gets a lease: users and groups that arrive later start at the present shares of this
  // job's user and group.
  void served(const Job& job);

  struct Figure {
    std::string owner;
    std::int64_t priority;
    double seconds;
  };
  std::vector<Figure> figures() const;
  std::size_t kept() const;  // number of entries in all tables, which tests use to find leaks

 private:
  struct Share {
    double spent = 0, out = 0;  // core seconds that results reported, and those predicted for leased units
    std::uint32_t at_work = 0;  // number of jobs that have units to lease or leased units
    double had() const { return spent + out; }
  };
  template <class T>
  struct Turn {
    double had;
    // The earliest submitted job of `who` that has units to lease. If shares are equal, the user or group
    // with the earlier job goes first
    JobSeq first;
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
    std::set<Turn<Group>> turns;  // the groups that have units to lease, next in turn first
    std::set<JobSeq> ready;
  };
  // The users that have jobs of one priority
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

  std::map<std::int64_t, Level> levels_;  // by minus the priority, so the highest priority is first
  std::size_t ready_ = 0;
  std::set<JobSeq> at_work_;
};

}  // namespace ls::coordinator

// Whose turn it is. Higher priorities go first; within one, users have equal shares, and within a user so
// have its jobs (a sequence counts as one of them, its frames go in order). A share is measured in core
// seconds: those that results have reported, and those that what is lent is predicted to take. Who has had
// least goes next (start-time fair queueing, Goyal et al. 1996, with measured instead of declared lengths).
//
// Who comes, or comes back, begins where the last one that was served stood: nobody saves up turns by
// waiting, and nobody is made to pay for having had the farm alone. So of two users that both have work for
// all workers all the time, the shares differ by no more than one lease each and what predictions were wrong
// by.
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

class ShareBook {
 public:
  // The job has something to lend, or has not. True if it had not before and has now.
  bool offer(Job& job);
  void withdraw(Job& job);
  bool empty() const { return ready_ == 0; }

  // Core seconds that are lent (or no longer, if negative), and that a result took.
  void lend(Job& job, double seconds);
  void spend(Job& job, double seconds);
  // Forgets those that have no work and whose time has passed.
  void tidy();
  // Before the job's priority changes; the caller offers it again afterwards.
  void leave(Job& job);
  void enter(Job& job);  // with what is lent of it

  // Calls visit(job, lag) for the jobs in turn until it says true; lag: core seconds that the first user has
  // had less than the job's, and the user's first group less than the job's; infinite at a lower priority.
  // True if some visit said so.
  using Visit = std::function<bool(Job&, double lag)>;
  bool in_turn(const Visit& visit) const;
  // The job is the one that was chosen: later comers begin where it stood.
  void served(const Job& job);

  struct Figure {
    std::string owner;
    std::int64_t priority;
    double seconds, lent;
    bool waits;  // it has something to lend
  };
  std::vector<Figure> figures() const;
  std::size_t kept() const;  // priorities, users and groups that are remembered

 private:
  struct Share {
    double spent = 0, out = 0;
    std::uint32_t at_work = 0;  // jobs that wait or are lent
    double had() const { return spent + out; }
  };
  template <class T>
  struct Turn {
    double had;
    JobSeq first;  // of what waits: ties go in order of submission
    T* who;
    bool operator<(const Turn& o) const { return std::tie(had, first) < std::tie(o.had, o.first); }
  };
  struct Group {
    Share share;
    std::map<JobSeq, Job*> ready;
  };
  struct User {
    Share share;
    double clock = 0;  // what the group served last had had
    std::map<std::string, Group> groups;
    std::set<Turn<Group>> turns;  // of groups with ready jobs
    std::set<JobSeq> ready;
  };
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
  // Lets `change` work on user and group, and gives both their new places in the order.
  template <class Change>
  void change(Job& job, Change&& change);
  static std::optional<Turn<User>> turn_of(User& user);  // nothing: it has none
  static std::optional<Turn<Group>> turn_of(Group& group);
  template <class T>
  static void place(std::set<Turn<T>>& turns, const std::optional<Turn<T>>& before,
                    const std::optional<Turn<T>>& after);

  std::map<std::int64_t, Level> levels_;  // by -priority
  std::size_t ready_ = 0;
  std::set<JobSeq> at_work_;
};

}  // namespace ls::coordinator

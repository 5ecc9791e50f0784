#include "coordinator/domain/fair_share.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace ls::coordinator {
namespace {

std::string group_of(const Job& job) {
  return job.plan.group.empty() ? job.plan.brief.job.value : job.plan.group;
}

}  // namespace

FairShare::Place FairShare::place_of(const Job& job) {
  Level& level = levels_[-static_cast<std::int64_t>(job.plan.priority)];
  User& user = level.users[job.plan.owner];
  return {level, user, user.groups[group_of(job)]};
}

template <class Change>
void FairShare::change(Job& job, Change&& change) {
  const Place at = place_of(job);
  const auto user_before = turn_of(at.user);
  const auto group_before = turn_of(at.group);
  change(at);
  // A job is at work while it has units to lease or leased units. When a user or group had no job at work and
  // now has one, its share is raised to at least the clock, which is the share of the user or group served
  // most recently.
  const bool works = job.offered || job.charge_out > 0;
  if (works && at_work_.insert(job.seq).second) {
    if (at.user.share.at_work++ == 0) at.user.share.spent = std::max(at.user.share.spent, at.level.clock);
    if (at.group.share.at_work++ == 0) at.group.share.spent = std::max(at.group.share.spent, at.user.clock);
  } else if (!works && at_work_.erase(job.seq) > 0) {
    if (--at.user.share.at_work == 0) at.user.share.out = 0;
    if (--at.group.share.at_work == 0) at.group.share.out = 0;
  }
  place(at.level.turns, user_before, turn_of(at.user));
  place(at.user.turns, group_before, turn_of(at.group));
}

std::optional<FairShare::Turn<FairShare::User>> FairShare::turn_of(User& user) {
  if (user.ready.empty()) return std::nullopt;
  return Turn<User>{user.share.had(), *user.ready.begin(), &user};
}

std::optional<FairShare::Turn<FairShare::Group>> FairShare::turn_of(Group& group) {
  if (group.ready.empty()) return std::nullopt;
  return Turn<Group>{group.share.had(), group.ready.begin()->first, &group};
}

template <class T>
void FairShare::place(std::set<Turn<T>>& turns, const std::optional<Turn<T>>& before,
                      const std::optional<Turn<T>>& after) {
  if (before && after) {
    auto node = turns.extract(*before);
    node.value() = *after;
    turns.insert(std::move(node));
  } else if (before) {
    turns.erase(*before);
  } else if (after) {
    turns.insert(*after);
  }
}

bool FairShare::offer(Job& job) {
  if (std::exchange(job.offered, true)) return false;
  change(job, [&](const Place& at) {
    at.group.ready.emplace(job.seq, &job);
    at.user.ready.insert(job.seq);
  });
  ++ready_;
  return true;
}

void FairShare::withdraw(Job& job) {
  if (!std::exchange(job.offered, false)) return;
  change(job, [&](const Place& at) {
    at.group.ready.erase(job.seq);
    at.user.ready.erase(job.seq);
  });
  --ready_;
}

void FairShare::charge(Job& job, double seconds) {
  change(job, [&](const Place& at) {
    job.charge_out = job.leased == 0 ? 0 : std::max(0.0, job.charge_out + seconds);
    at.user.share.out = std::max(0.0, at.user.share.out + seconds);
    at.group.share.out = std::max(0.0, at.group.share.out + seconds);
  });
}

void FairShare::spend(Job& job, double seconds) {
  change(job, [&](const Place& at) {
    at.user.share.spent += seconds;
    at.group.share.spent += seconds;
  });
}

void FairShare::leave(Job& job) {
  withdraw(job);
  if (!at_work_.contains(job.seq)) return;
  const double leased = job.charge_out;
  change(job, [&](const Place& at) {
    job.charge_out = 0;
    at.user.share.out = std::max(0.0, at.user.share.out - leased);
    at.group.share.out = std::max(0.0, at.group.share.out - leased);
  });
  job.charge_out = leased;
}

void FairShare::enter(Job& job) {
  if (job.charge_out <= 0) return;
  change(job, [&](const Place& at) {
    at.user.share.out += job.charge_out;
    at.group.share.out += job.charge_out;
  });
}

std::size_t FairShare::kept() const {
  std::size_t count = levels_.size() + at_work_.size();
  for (const auto& [priority, level] : levels_) {
    count += level.users.size() + level.turns.size();
    for (const auto& [name, user] : level.users)
      count += user.groups.size() + user.turns.size() + user.ready.size();
  }
  return count;
}

void FairShare::tidy() {
  for (auto level = levels_.begin(); level != levels_.end();) {
    for (auto user = level->second.users.begin(); user != level->second.users.end();) {
      User& u = user->second;
      std::erase_if(u.groups, [&](const auto& g) {
        return g.second.share.at_work == 0 && (g.second.share.spent <= u.clock || u.share.at_work == 0);
      });
      const bool gone = u.share.at_work == 0 && u.share.spent <= level->second.clock;
      user = gone ? level->second.users.erase(user) : std::next(user);
    }
    level = level->second.users.empty() ? levels_.erase(level) : std::next(level);
  }
}

bool FairShare::in_turn(const Visit& visit) const {
  const double kFar = std::numeric_limits<double>::infinity();
  bool top = true;  // true while the loop is at the highest priority that has jobs with units to lease
  for (const auto& [priority, level] : levels_) {
    for (auto user = level.turns.begin(); user != level.turns.end(); ++user) {
      const double behind = user->had - level.turns.begin()->had;
      for (auto group = user->who->turns.begin(); group != user->who->turns.end(); ++group) {
        const double within = group->had - user->who->turns.begin()->had;
        for (const auto& [seq, job] : group->who->ready)
          if (visit(*job, top ? behind + within : kFar)) return true;
      }
    }
    top &= level.turns.empty();
  }
  return false;
}

void FairShare::served(const Job& job) {
  const Place at = place_of(job);
  at.level.clock = std::max(at.level.clock, at.user.share.had());
  at.user.clock = std::max(at.user.clock, at.group.share.had());
}

std::vector<FairShare::Figure> FairShare::figures() const {
  std::vector<Figure> all;
  for (const auto& [priority, level] : levels_)
    for (const auto& [owner, user] : level.users)
      if (user.share.at_work > 0) all.push_back({owner, -priority, user.share.had()});
  return all;
}

}  // namespace ls::coordinator

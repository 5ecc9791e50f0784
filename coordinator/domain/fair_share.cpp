#include "coordinator/domain/fair_share.h"

#include <algorithm>
#include <utility>

namespace ls::coordinator {

FairShare::Place FairShare::place_of(const Job& job) {
  Level& level = levels_[-static_cast<std::int64_t>(job.plan.priority)];
  return {level, level.users[job.plan.owner]};
}

template <class Change>
void FairShare::change(Job& job, Change&& change) {
  const auto [level, user] = place_of(job);
  const auto before = turn_of(user);
  change(user);
  // A job is at work while it has units to lease or leased units. When a user had no job at work and now has
  // one, their share is raised to at least the clock, which is the share of the user served most recently.
  const bool works = job.offered || job.charge_out > 0;
  if (works && at_work_.insert(job.seq).second) {
    if (user.at_work++ == 0) user.spent = std::max(user.spent, level.clock);
  } else if (!works && at_work_.erase(job.seq) > 0) {
    if (--user.at_work == 0) user.out = 0;
  }
  if (before) level.turns.erase(*before);
  if (const auto after = turn_of(user)) level.turns.insert(*after);
}

std::optional<FairShare::Turn> FairShare::turn_of(User& user) {
  if (user.ready.empty()) return std::nullopt;
  return Turn{user.had(), user.ready.begin()->first, &user};
}

bool FairShare::offer(Job& job) {
  if (std::exchange(job.offered, true)) return false;
  change(job, [&](User& user) { user.ready.emplace(job.seq, &job); });
  ++ready_;
  return true;
}

void FairShare::withdraw(Job& job) {
  if (!std::exchange(job.offered, false)) return;
  change(job, [&](User& user) { user.ready.erase(job.seq); });
  --ready_;
}

void FairShare::charge(Job& job, double seconds) {
  change(job, [&](User& user) {
    job.charge_out = job.leased == 0 ? 0 : std::max(0.0, job.charge_out + seconds);
    user.out = std::max(0.0, user.out + seconds);
  });
}

void FairShare::spend(Job& job, double seconds) {
  change(job, [&](User& user) { user.spent += seconds; });
}

void FairShare::leave(Job& job) {
  withdraw(job);
  if (!at_work_.contains(job.seq)) return;
  const double leased = job.charge_out;
  change(job, [&](User& user) {
    job.charge_out = 0;
    user.out = std::max(0.0, user.out - leased);
  });
  job.charge_out = leased;
}

void FairShare::enter(Job& job) {
  if (job.charge_out <= 0) return;
  change(job, [&](User& user) { user.out += job.charge_out; });
}

std::size_t FairShare::kept() const {
  std::size_t count = levels_.size() + at_work_.size();
  for (const auto& [priority, level] : levels_) {
    count += level.users.size() + level.turns.size();
    for (const auto& [name, user] : level.users) count += user.ready.size();
  }
  return count;
}

void FairShare::tidy() {
  for (auto& [priority, level] : levels_)
    std::erase_if(level.users, [&clock = level.clock](const auto& user) {
      return user.second.at_work == 0 && user.second.spent <= clock;
    });
  std::erase_if(levels_, [](const auto& level) { return level.second.users.empty(); });
}

void FairShare::in_turn(const Visit& visit) const {
  for (const auto& [priority, level] : levels_)
    for (const Turn& turn : level.turns)
      for (const auto& [seq, job] : turn.who->ready) {
        const Then then = visit(*job, turn.had - level.turns.begin()->had);
        if (then == Then::stop) return;
        if (then == Then::next_user) break;
      }
}

void FairShare::served(const Job& job) {
  const auto [level, user] = place_of(job);
  level.clock = std::max(level.clock, user.had());
}

std::vector<FairShare::Figure> FairShare::figures() const {
  std::vector<Figure> all;
  for (const auto& [priority, level] : levels_)
    for (const auto& [owner, user] : level.users)
      if (user.at_work > 0) all.push_back({owner, -priority, user.had()});
  return all;
}

}  // namespace ls::coordinator

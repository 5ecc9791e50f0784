#include "cli/scale/scaler.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ls::cli {
namespace {
using State = EngineWorker::State;
}

ScaleActions Scaler::decide(const Demand& demand, std::span<const EngineWorker> workers, double spent,
                            TimePoint now) {
  observe(demand, workers, now);
  ScaleActions out;
  if (limits_.budget_core_seconds) {
    double reserved = 0;
    for (const auto& w : workers) reserved += w.cores * seconds_to_end();
    if (!workers.empty() && spent + reserved >= *limits_.budget_core_seconds) {
      out = end(workers, now);
      out.why = "the budget is used up, apart from what its workers need to hand in their work";
      return out;
    }
  }
  if (demand.open_jobs == 0 && demand.unpaid_jobs > 0) {
    out = end(workers, now);
    out.why = "the budgets of all open jobs or of their users are used up";
    return out;
  }
  int want = wanted(demand), alive = 0;
  for (const auto& w : workers) alive += w.state != State::stuck && !seen_[w.id].draining_since;
  if (!demand.more_helps) want = std::min(want, std::max(alive, demand.other_threads > 0 ? 0 : 1));

  for (const auto& w : workers) {
    const Seen& seen = seen_[w.id];
    if (seen.draining_since) continue;
    const bool surplus = w.state == State::waiting && alive > want;
    const bool idle = seen.idle_since && seconds(now - *seen.idle_since) >= limits_.idle_seconds;
    if (w.state == State::stuck || surplus || (idle && (alive > want || demand.open_jobs == 0))) {
      alive -= w.state != State::stuck;
      drain(w, out, now);
    }
  }
  kill_overdue(workers, out, now);
  if (alive >= want) return out;
  if (no_start_before_ && now < *no_start_before_) {
    out.why = fmt::format("{} starts of workers in a row failed: the next is tried in {:.0f} s", failures_,
                          seconds(*no_start_before_ - now));
    return out;
  }
  out.start = std::min(want - alive, affordable(workers, spent));
  if (out.start == 0) out.why = "the budget allows no more workers";
  return out;
}

ScaleActions Scaler::end(std::span<const EngineWorker> workers, TimePoint now) {
  ScaleActions out;
  for (const auto& w : workers)
    if (!seen_[w.id].draining_since) drain(w, out, now);
  kill_overdue(workers, out, now);
  return out;
}

void Scaler::started(std::span<const std::string> ids) {
  for (const std::string& id : ids) seen_.try_emplace(id);
}

void Scaler::start_failed(TimePoint now) {
  ++failures_;
  const double pause = std::min(kLongestPause, kFirstPause * std::exp2(std::min(failures_ - 1, 10)));
  no_start_before_ = now + from_seconds(pause);
}

void Scaler::drain_failed(std::span<const EngineWorker> workers) {
  for (const auto& w : workers) seen_[w.id].draining_since.reset();
}

// Updates the list of workers. A worker that ended or got stuck before it joined the farm, without being
// drained, is a failed start.
void Scaler::observe(const Demand& demand, std::span<const EngineWorker> workers, TimePoint now) {
  std::map<std::string, Seen> present;
  for (const auto& w : workers) {
    Seen seen = seen_[w.id];
    seen_.erase(w.id);
    const std::string name = worker_name(limits_.farm, w.id);
    if (demand.joined.contains(name)) {
      seen.joined = true;
      failures_ = 0;
      no_start_before_.reset();
    }
    const bool idle = w.state == State::running && demand.idle.contains(name);
    if (!idle)
      seen.idle_since.reset();
    else if (!seen.idle_since)
      seen.idle_since = now;
    present.emplace(w.id, seen);
  }
  const auto useless = [](const Seen& seen) { return !seen.joined && !seen.draining_since; };
  bool failed =
      std::any_of(seen_.begin(), seen_.end(), [&](const auto& gone) { return useless(gone.second); });
  for (const auto& w : workers) failed |= w.state == State::stuck && useless(present[w.id]);
  if (failed) start_failed(now);
  seen_ = std::move(present);
}

int Scaler::wanted(const Demand& demand) const {
  if (demand.open_jobs == 0) return 0;
  const double threads = std::ceil(demand.queued_core_seconds / limits_.finish_in) - demand.other_threads;
  const double workers = std::ceil(threads / limits_.threads);
  // If only this command runs workers, open jobs need at least one, even if no cost is predicted. The cost
  // may be unknown until a worker has measured it, and queued_core_seconds leaves out the work that workers
  // hold.
  const double least = demand.other_threads > 0 ? 0 : 1;
  return static_cast<int>(std::clamp(workers, least, static_cast<double>(limits_.most_workers)));
}

// Returns how many more workers the budget allows. What is left of the budget must pay every worker, existing
// or new, for kWorthStarting seconds and for the time that it takes to end.
int Scaler::affordable(std::span<const EngineWorker> workers, double spent) const {
  if (!limits_.budget_core_seconds) return limits_.most_workers;
  const double each = kWorthStarting + seconds_to_end();
  double left = *limits_.budget_core_seconds - spent;
  for (const auto& w : workers) left -= w.cores * each;
  return std::max(0,
                  static_cast<int>(std::min<double>(limits_.most_workers, left / (limits_.threads * each))));
}

// Returns for how many more seconds, at most, a worker must be paid if the next check asks it to drain: the
// interval until that check, the time to drain, and another interval until its end is noticed.
double Scaler::seconds_to_end() const { return limits_.drain_seconds + 2 * limits_.poll_seconds; }

void Scaler::drain(const EngineWorker& worker, ScaleActions& out, TimePoint now) {
  seen_[worker.id].draining_since = now;
  out.drain.push_back(worker);
}

void Scaler::kill_overdue(std::span<const EngineWorker> workers, ScaleActions& out, TimePoint now) {
  for (const auto& w : workers)
    if (const auto since = seen_[w.id].draining_since;
        since && seconds(now - *since) >= limits_.drain_seconds)
      out.kill.push_back(w);
}

}  // namespace ls::cli

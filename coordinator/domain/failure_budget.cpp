#include "coordinator/domain/failure_budget.h"

#include <fmt/format.h>

#include <set>

#include "common/job/health_notes.h"

namespace ls::coordinator {
namespace {
constexpr std::size_t kMaxAttemptsKept = 16;
}

void UnitFailures::add(UnitCode code, FailedAttempt attempt) {
  auto& attempts = units_[code];
  if (attempts.size() == kMaxAttemptsKept) attempts.erase(attempts.begin());
  attempts.push_back(std::move(attempt));
}

bool UnitFailures::failed_on(UnitCode code, WorkerIndex worker) const {
  const auto it = units_.find(code);
  if (it == units_.end()) return false;
  return std::any_of(it->second.begin(), it->second.end(), [&](const auto& a) { return a.worker == worker; });
}

bool UnitFailures::exhausted(UnitCode code, std::size_t workers_known) const {
  const auto& all = attempts(code);
  std::set<WorkerIndex> distinct;
  for (const auto& a : all) distinct.insert(a.worker);
  const std::size_t needed = std::clamp<std::size_t>(workers_known, 1, kUnitFailureWorkers);
  return distinct.size() >= needed && all.size() >= kUnitFailureAttempts;
}

const std::vector<FailedAttempt>& UnitFailures::attempts(UnitCode code) const {
  static const std::vector<FailedAttempt> kNone;
  const auto it = units_.find(code);
  return it == units_.end() ? kNone : it->second;
}

std::string describe_failure(const PixelRect& rect, const SampleRange& samples,
                             const std::vector<FailedAttempt>& attempts, const std::string& replay) {
  std::string text;
  if (attempts.empty()) return text;
  const UnitFailure& last = attempts.back().failure;
  text = fmt::format("tile {} (pixels {},{} to {},{}), round {} (samples {} to {}) failed in {} attempt{}",
                     last.unit.tile, rect.x0, rect.y0, rect.x1, rect.y1, last.unit.round, samples.s0,
                     samples.s1, attempts.size(), attempts.size() == 1 ? "" : "s");
  for (const FailedAttempt& a : attempts) {
    text += fmt::format("; on {}: {}", a.worker_name,
                        a.failure.reason.empty() ? "no reason given" : a.failure.reason);
    if (a.failure.signal) text += fmt::format(" (signal {})", *a.failure.signal);
    if (a.failure.pixel)
      text += fmt::format(" at pixel {},{}", a.failure.pixel->first, a.failure.pixel->second);
    if (a.failure.sample) text += fmt::format(" sample {}", *a.failure.sample);
  }
  if (last.pixel) {
    text += ". Replay it with: " +
            replay_command(replay, last.pixel->first, last.pixel->second, last.sample.value_or(samples.s0));
  }
  return text;
}

}  // namespace ls::coordinator

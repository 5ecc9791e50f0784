#include "coordinator/service/state/eta.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ls::coordinator {
namespace {

struct CoreSeconds {
  double to_end = 0;
  std::optional<std::pair<double, double>> ci95;
};

// Predicts the core seconds that the job still needs; nullopt: unknown. May raise out.progress to the
// progress towards the target error.
std::optional<CoreSeconds> core_seconds_left(const EtaInputs& facts, std::span<const ErrorPoint> points,
                                             Eta& out) {
  const auto known = [](double core) {
    return core > 0 ? std::optional(CoreSeconds{core, {}}) : std::nullopt;
  };
  const auto forecast = facts.target && !points.empty() ? forecast_of(points, *facts.target) : std::nullopt;
  if (!forecast) return known(facts.core_left);
  const ErrorPoint& last = points.back();
  const double more = std::max(0.0, forecast->spp - last.spp);
  if (last.spp > 0) out.progress = std::max(out.progress, last.spp / (last.spp + more));
  const double spent = std::max(0.0, facts.core_seconds - last.core_seconds);
  const double limit =
      facts.core_to_limit > 0 ? facts.core_to_limit : std::numeric_limits<double>::infinity();
  if (forecast->core_seconds - spent >= limit) return known(limit);
  const auto from_now = [&](double core) { return std::clamp(core - spent, 0.0, limit); };
  return CoreSeconds{from_now(forecast->core_seconds),
                     {{from_now(forecast->core_seconds_lo), from_now(forecast->core_seconds_hi)}}};
}

// How long a job with a target error lasts after its work has run out for some threads, as multiples of a
// unit's duration u. Until the last needed unit is done the other threads wait between 0 and 1 u (Graham
// 1969: list scheduling of work W on P threads takes at most W / P + (1 - 1 / P) u). They do not idle, but
// render units that will be dropped; so the last needed unit itself may wait up to 1 u for a free thread. If
// the samples end the job, the number of units is known, and all threads end at about the same time.
constexpr double kEven = 0, kLeastWait = 0, kMeanWait = .5, kMostWait = 2;

// Returns the wall-clock seconds that `core` core seconds of work take on `cores` cores. A unit runs on one
// thread. So at most facts.units_at_once cores are busy, and the result is at least the duration of one unit
// (facts.unit_seconds), or `core` if less work than that is left. `wait` is one of the multiples above.
double seconds_on(double cores, double core, double wait, const EtaInputs& facts) {
  const double busy = facts.units_at_once > 0 ? std::min(cores, facts.units_at_once) : cores;
  const double waits = wait * facts.unit_seconds * std::max(0.0, 1 - 1 / busy);
  return std::max(std::min(core / busy + waits, std::max(core, core / busy)),
                  std::min(core, facts.unit_seconds));
}

}  // namespace

Eta eta_of(const EtaInputs& facts, std::span<const ErrorPoint> points) {
  Eta out;
  out.progress = facts.done;
  const auto core = core_seconds_left(facts, points, out);
  if (facts.cores > 0 && core) {
    const auto on = [&](double cores) {
      return core->ci95 ? std::optional(std::pair(seconds_on(cores, core->ci95->first, kLeastWait, facts),
                                                  seconds_on(cores, core->ci95->second, kMostWait, facts)))
                        : std::nullopt;
    };
    const double wait = core->ci95 ? kMeanWait : kEven;
    out.seconds = seconds_on(facts.cores, core->to_end, wait, facts);
    out.ci95 = on(facts.cores);
    const double more = std::max(facts.cores, facts.cores_with_more);
    if (const double sooner = seconds_on(more, core->to_end, wait, facts); sooner < *out.seconds) {
      out.with_more = sooner;
      out.with_more_ci95 = on(facts.cores_with_more);
    }
  }
  if (!facts.time) return out;
  out.progress = std::max(out.progress, std::min(1.0, facts.elapsed / *facts.time));
  const double left = std::max(0.0, *facts.time - facts.elapsed);
  if (!out.seconds || left < *out.seconds) return {out.progress, left, {}, {}, {}};
  return out;
}

}  // namespace ls::coordinator

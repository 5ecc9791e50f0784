#include "compare/forecasts.h"

#include <algorithm>
#include <array>

#include "common/image/error/convergence.h"

namespace ls::race {
namespace {

constexpr std::array kShares{.5, .25, .125};
constexpr double kFirstSpp = 8;

std::vector<ErrorPoint> estimates_of(const JudgedLane& lane) {
  std::vector<ErrorPoint> out;
  for (const JudgedPoint& p : lane.points)
    if (p.estimate)
      out.push_back({p.spp, p.cost.cpu, p.estimate->relmse, p.estimate->relmse_lo, p.estimate->relmse_hi});
  return out;
}

std::optional<Prediction> predict(const std::vector<ErrorPoint>& points, std::size_t at, double share) {
  const ErrorPoint& now = points[at];
  const double target = share * now.relmse, left = points.back().core_seconds - now.core_seconds;
  const auto forecast = forecast_of(std::span(points).first(at + 1), target);
  if (!forecast || forecast->core_seconds_hi > left) return std::nullopt;
  Prediction p;
  p.spp = now.spp;
  p.spent = now.core_seconds;
  p.target = target;
  p.predicted = forecast->core_seconds;
  p.lo = forecast->core_seconds_lo;
  p.hi = forecast->core_seconds_hi;
  const auto reached = std::find_if(points.begin() + static_cast<std::ptrdiff_t>(at) + 1, points.end(),
                                    [&](const ErrorPoint& e) { return e.relmse <= target; });
  if (reached != points.end()) p.actual = reached->core_seconds - now.core_seconds;
  return p;
}

}  // namespace

std::vector<Prediction> predictions_of(const Race& race) {
  std::vector<Prediction> out;
  for (const JudgedLane& lane : race.lanes) {
    const auto points = estimates_of(lane);
    double wanted = kFirstSpp;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      if (points[i].spp < wanted) continue;
      wanted = 2 * points[i].spp;
      for (const double share : kShares)
        if (auto p = predict(points, i, share)) {
          p->entrant = lane.entrant;
          p->seed = lane.seed;
          out.push_back(*p);
        }
    }
  }
  return out;
}

}  // namespace ls::race

#include "compare/summary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "validation/measure/hypothesis_tests.h"

namespace ls::race {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kOutside = .05;

bool usable(double value) { return std::isfinite(value) && value > 0; }

std::optional<Estimate> exp_of(const std::optional<Estimate>& logs) {
  if (!logs) return std::nullopt;
  return Estimate{std::exp(logs->value), std::exp(logs->lo), std::exp(logs->hi)};
}

std::vector<const JudgedLane*> lanes_of(const Race& race, std::size_t entrant) {
  std::vector<const JudgedLane*> out;
  for (const JudgedLane& lane : race.lanes)
    if (lane.entrant == entrant && !lane.points.empty()) out.push_back(&lane);
  return out;
}

// Returns value(p) for the last point p of each lane (the run of an entrant with one seed).
template <class Value>
std::vector<double> at_end(const std::vector<const JudgedLane*>& lanes, const Value& value) {
  std::vector<double> out;
  for (const JudgedLane* lane : lanes) out.push_back(value(lane->points.back()));
  return out;
}

double efficiency(const JudgedPoint& p) { return 1 / (p.relmse * p.seconds); }

// Returns points of the lane at doubling sample counts, beginning with its last point: each further point has
// at most half the samples of the point returned before it.
std::vector<TimeError> doublings(const JudgedLane& lane) {
  std::vector<TimeError> out;
  double next = std::numeric_limits<double>::infinity();
  for (std::size_t i = lane.points.size(); i-- > 0;) {
    const JudgedPoint& p = lane.points[i];
    if (2 * p.spp > next) continue;
    next = p.spp;
    out.push_back({p.seconds, p.relmse});
  }
  return out;
}

std::optional<Estimate> slope_of(const std::vector<const JudgedLane*>& lanes) {
  std::vector<double> slopes;
  for (const JudgedLane* lane : lanes)
    if (const auto slope = log_slope(doublings(*lane))) slopes.push_back(*slope);
  return slopes.size() == lanes.size() ? mean(slopes) : std::nullopt;
}

double spread_of(const std::vector<double>& errors) {
  const auto [least, most] = std::minmax_element(errors.begin(), errors.end());
  return *least > 0 ? *most / *least : std::numeric_limits<double>::infinity();
}

}  // namespace

std::optional<Estimate> mean(std::span<const double> values) {
  if (values.empty()) return std::nullopt;
  const auto n = static_cast<double>(values.size());
  double sum = 0, squares = 0;
  for (const double v : values) sum += v;
  const double middle = sum / n;
  if (!std::isfinite(middle)) return std::nullopt;
  if (values.size() == 1) return Estimate{middle, -kInfinity, kInfinity};
  for (const double v : values) squares += (v - middle) * (v - middle);
  const double half = cli::student_quantile(kOutside, n - 1) * std::sqrt(squares / (n - 1) / n);
  return Estimate{middle, middle - half, middle + half};
}

std::optional<Estimate> geometric_mean(std::span<const double> values) {
  if (!std::all_of(values.begin(), values.end(), usable)) return std::nullopt;
  std::vector<double> logs;
  for (const double v : values) logs.push_back(std::log(v));
  return exp_of(mean(logs));
}

std::optional<Estimate> geometric_ratio(std::span<const double> a, std::span<const double> b) {
  if (a.size() != b.size() || !std::all_of(a.begin(), a.end(), usable) ||
      !std::all_of(b.begin(), b.end(), usable))
    return std::nullopt;
  std::vector<double> logs;
  for (std::size_t i = 0; i < a.size(); ++i) logs.push_back(std::log(a[i] / b[i]));
  return exp_of(mean(logs));
}

std::optional<double> log_slope(std::span<const TimeError> points) {
  std::vector<std::pair<double, double>> logs;
  for (const TimeError& p : points)
    if (usable(p.seconds) && usable(p.error)) logs.emplace_back(std::log(p.seconds), std::log(p.error));
  if (logs.size() < 3) return std::nullopt;
  double x = 0, y = 0, xx = 0, xy = 0;
  for (const auto& [t, e] : logs) x += t, y += e;
  x /= static_cast<double>(logs.size()), y /= static_cast<double>(logs.size());
  for (const auto& [t, e] : logs) xx += (t - x) * (t - x), xy += (t - x) * (e - y);
  if (!(xx > 0)) return std::nullopt;
  return -xy / xx;
}

std::vector<Row> rows_of(const Race& race) {
  std::vector<Row> rows;
  std::vector<double> first;
  for (std::size_t e = 0; e < race.entrants.size(); ++e) {
    const auto lanes = lanes_of(race, e);
    if (lanes.empty()) continue;
    const auto spp = at_end(lanes, [](const JudgedPoint& p) { return p.spp; });
    const auto seconds = at_end(lanes, [](const JudgedPoint& p) { return p.seconds; });
    const auto errors = at_end(lanes, [](const JudgedPoint& p) { return p.relmse; });
    const auto efficiencies = at_end(lanes, efficiency);
    Row row{e, lanes.size()};
    row.spp = geometric_mean(spp).value_or(Estimate{}).value;
    row.seconds = geometric_mean(seconds).value_or(Estimate{}).value;
    row.relmse = geometric_mean(errors);
    row.efficiency = geometric_mean(efficiencies);
    row.slope = slope_of(lanes);
    row.spread = spread_of(errors);
    if (e == 0) first = efficiencies;
    if (e != 0 && !first.empty()) row.ratio = geometric_ratio(first, efficiencies);
    rows.push_back(row);
  }
  return rows;
}

std::vector<CurveAt> curve_of(const Race& race, std::size_t entrant) {
  const auto lanes = lanes_of(race, entrant);
  // This key stands for the end of a run: the final points of all seeds form one group, although their sample
  // counts differ.
  const double end = std::numeric_limits<double>::infinity();
  std::map<double, std::vector<const JudgedPoint*>> groups;
  for (const JudgedLane* lane : lanes)
    for (const JudgedPoint& p : lane->points) groups[p.last ? end : p.spp].push_back(&p);
  std::vector<CurveAt> out;
  for (const auto& [key, points] : groups) {
    if (2 * points.size() < lanes.size()) continue;
    std::vector<double> spp, seconds, errors;
    for (const JudgedPoint* p : points)
      spp.push_back(p->spp), seconds.push_back(p->seconds), errors.push_back(p->relmse);
    const auto x = geometric_mean(seconds), y = geometric_mean(errors), n = geometric_mean(spp);
    if (x && y && n) out.push_back({n->value, x->value, *y});
  }
  return out;
}

}  // namespace ls::race

#include "compare/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
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

}  // namespace ls::race

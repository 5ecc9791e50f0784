#include "util/report/log_axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "util/report/number_text.h"

namespace ls::report {
namespace {

constexpr double kMargin = 0.06;  // margin at each end, as a fraction of the axis's range in decades
// An axis shorter than this many decades also has labels at 2 and 5 times each power of ten.
constexpr double kShort = 2.2;
// An axis of at most this many decades also has lines at 2 to 9 times each power of ten.
constexpr double kFine = 4.5;
constexpr std::size_t kMostLabels = 8;
constexpr std::size_t kFewTimes = 4;  // If fewer time labels than this fit, labels between them are added.
// The ends of an axis are limited to 10^-300 and 10^300, so that they can be computed in double.
constexpr double kFarthest = 300;
constexpr double kMinute = 60, kHour = 3600, kDay = 86400;

bool inside(const LogAxis& axis, double value) { return value >= axis.lo && value <= axis.hi; }

std::string plain_label(int step, int exponent) {
  if (exponent >= -3 && exponent <= 3) return fmt::format("{:g}", step * std::pow(10.0, exponent));
  const std::string power = "10" + superscript(exponent);
  return step == 1 ? power : fmt::format("{}·{}", step, power);
}

std::string time_label(double seconds) {
  if (seconds < kMinute) return fmt::format("{:g} s", seconds);
  if (seconds < kHour) return fmt::format("{:g} min", seconds / kMinute);
  return seconds < kDay ? fmt::format("{:g} h", seconds / kHour) : fmt::format("{:g} d", seconds / kDay);
}

// Returns the times within the axis that are usual as labels. `coarse`: in steps of about 10 only (1 s, 10 s,
// 1 min, 10 min, ...); otherwise also times between them, such as 2 s and 5 s.
std::vector<double> usual_times(const LogAxis& axis, bool coarse) {
  std::vector<double> all;
  const auto take = [&](double unit, std::initializer_list<double> steps) {
    for (const double step : steps)
      if (inside(axis, step * unit)) all.push_back(step * unit);
  };
  for (int n = static_cast<int>(std::floor(std::log10(axis.lo))); n < 0; ++n)
    coarse ? take(std::pow(10.0, n), {1}) : take(std::pow(10.0, n), {1, 2, 5});
  for (const double unit : {1.0, kMinute}) coarse ? take(unit, {1, 10}) : take(unit, {1, 2, 5, 10, 20});
  coarse ? take(kHour, {1, 10}) : take(kHour, {1, 2, 5, 10});
  for (double unit = kDay; unit <= axis.hi; unit *= 10) coarse ? take(unit, {1}) : take(unit, {1, 2, 5});
  return all;
}

std::vector<Tick> time_ticks(const LogAxis& axis) {
  std::vector<double> labelled = usual_times(axis, true);
  if (labelled.size() < kFewTimes) labelled = usual_times(axis, false);
  const std::size_t every = (labelled.size() + kMostLabels - 1) / kMostLabels;
  std::vector<Tick> all;
  for (std::size_t i = 0; i < labelled.size(); ++i)
    all.push_back({labelled[i], i % every == 0 ? time_label(labelled[i]) : "", true});
  return all;
}

std::vector<Tick> plain_ticks(const LogAxis& axis) {
  const double decades = std::log10(axis.hi) - std::log10(axis.lo);
  const int every = static_cast<int>(decades / kMostLabels) + 1;
  std::vector<Tick> all;
  const int first = static_cast<int>(std::floor(std::log10(axis.lo)));
  const int last = static_cast<int>(std::ceil(std::log10(axis.hi)));
  for (int n = first; n <= last; ++n)
    for (int step = 1; step <= 9; ++step) {
      const double value = step * std::pow(10.0, n);
      if (!inside(axis, value) || (step > 1 && decades > kFine)) continue;
      const bool between = decades < kShort && (step == 2 || step == 5);
      const bool named = step == 1 ? (n % every + every) % every == 0 : between;
      all.push_back({value, named ? plain_label(step, n) : "", step == 1});
    }
  return all;
}

}  // namespace

double LogAxis::at(double value) const {
  const double a = std::log10(lo), b = std::log10(hi);
  return from + (std::log10(value) - a) / (b - a) * (to - from);
}

LogAxis log_axis(double lo, double hi, double from, double to) {
  const double a = std::log10(lo), b = std::log10(hi);
  const double margin = std::max((1 - (b - a)) / 2, kMargin * (b - a));
  const auto end = [](double exponent) {
    return std::pow(10.0, std::clamp(exponent, -kFarthest, kFarthest));
  };
  return {end(a - margin), end(b + margin), from, to};
}

std::vector<Tick> ticks(const LogAxis& axis, AxisUnit unit) {
  // The loops that make the ticks need finite ends above 0. All axes from log_axis() have them; for any other
  // axis there are no ticks.
  if (!(axis.lo > 0) || !(axis.hi < std::pow(10.0, kFarthest + 1))) return {};
  return unit == AxisUnit::seconds ? time_ticks(axis) : plain_ticks(axis);
}

}  // namespace ls::report

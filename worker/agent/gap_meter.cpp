#include "worker/agent/gap_meter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ls::worker {
namespace {
constexpr double kFirst = 1e-6;
constexpr double kStepsPerOctave = 8;
}  // namespace

void GapMeter::add(double seconds) {
  // The gap is a difference of times from two clocks and may be slightly negative.
  seconds = std::max(seconds, 0.);
  const double step = seconds > kFirst ? kStepsPerOctave * std::log2(seconds / kFirst) : 0;
  ++counts_[static_cast<std::size_t>(std::min(step, kSteps - 1.))];
  ++count_;
  longest_ = std::max(longest_, seconds);
}

double GapMeter::quantile(double q) const {
  if (count_ == 0) return 0;
  const auto wanted = static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (int i = 0; i < kSteps - 1; ++i) {  // the last bucket is unbounded
    seen += counts_[static_cast<std::size_t>(i)];
    if (seen >= wanted) return std::min(longest_, kFirst * std::exp2((i + 1) / kStepsPerOctave));
  }
  return longest_;
}

std::string GapMeter::text() const {
  return fmt::format(
      "{} gaps between units of a job: median {:.2f} ms, 99 % within {:.2f} ms, longest {:.2f} ms", count_,
      1e3 * quantile(.5), 1e3 * quantile(.99), 1e3 * longest_);
}

}  // namespace ls::worker

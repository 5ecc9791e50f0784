// Measures how long render threads idle between two units of the same job, from the last sample of one unit
// to the first sample of the next. The gaps are kept in a histogram with eight steps per octave, beginning at
// a microsecond, so that quantiles are accurate to 10 %.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

namespace ls::worker {

class GapMeter {
 public:
  // Adds a gap. `seconds` is the difference of times that were measured by two clocks, so it may be slightly
  // negative; then it counts as 0.
  void add(double seconds) {
    seconds = std::max(seconds, 0.);
    const double step = seconds > kFirst ? kStepsPerOctave * std::log2(seconds / kFirst) : 0;
    ++counts_[static_cast<std::size_t>(std::min(step, kSteps - 1.))];
    ++count_;
    longest_ = std::max(longest_, seconds);
  }
  std::uint64_t count() const { return count_; }
  // Returns the quantile q (0 to 1) of the gaps in seconds; 0 if there were none.
  double quantile(double q) const {
    if (count_ == 0) return 0;
    const auto wanted = static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_)));
    std::uint64_t seen = 0;
    for (int i = 0; i < kSteps - 1; ++i) {  // not the last step: it has no upper bound
      seen += counts_[static_cast<std::size_t>(i)];
      if (seen >= wanted) return std::min(longest_, kFirst * std::exp2((i + 1) / kStepsPerOctave));
    }
    return longest_;
  }
  std::string text() const {  // a summary for the log
    return fmt::format(
        "{} gaps between units of a job: median {:.2f} ms, 99 % within {:.2f} ms, longest {:.2f} ms", count_,
        1e3 * quantile(.5), 1e3 * quantile(.99), 1e3 * longest_);
  }

 private:
  static constexpr double kFirst = 1e-6, kStepsPerOctave = 8;
  static constexpr int kSteps = 8 * 32;
  std::array<std::uint64_t, kSteps> counts_{};
  std::uint64_t count_ = 0;
  double longest_ = 0;  // longest gap in seconds
};

}  // namespace ls::worker

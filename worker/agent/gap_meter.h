// Measures how long render threads idle between two units (each one tile and one range of samples) of the
// same job, from the last sample of one unit to the first sample of the next. The gaps are kept in a
// histogram with eight steps per octave, beginning at a microsecond, so that quantiles are accurate to 10 %.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace ls::worker {

class GapMeter {
 public:
  void add(double seconds);
  std::uint64_t count() const { return count_; }
  // Returns the quantile q (0 to 1) of the gaps in seconds; 0 if there were none.
  double quantile(double q) const;
  std::string text() const;  // a summary for the log

 private:
  static constexpr int kSteps = 8 * 32;
  std::array<std::uint64_t, kSteps> counts_{};
  std::uint64_t count_ = 0;
  double longest_ = 0;  // seconds
};

}  // namespace ls::worker

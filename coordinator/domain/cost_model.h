// Cost of a sample, measured from the CPU seconds that results report: per tile, with the job's running mean
// for tiles not measured yet. Affects the size of leases and their deadlines, never a pixel.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "common/image/frame/frame.h"
#include "coordinator/domain/limits.h"

namespace ls::coordinator {

class CostModel {
 public:
  explicit CostModel(TileIndex tiles) : tile_cost_(tiles, 0.0f) {}

  // Ignores implausible values (negative, not finite, more than a day).
  void measured(TileIndex tile, std::uint64_t pixel_samples, double cpu_seconds) {
    if (!(cpu_seconds >= 0 && cpu_seconds <= kMostUnitSeconds) || pixel_samples == 0) return;
    const double n = static_cast<double>(pixel_samples);
    seconds_ = seconds_ * kMemory + cpu_seconds;
    samples_ = samples_ * kMemory + n;
    tile_cost_[tile] = static_cast<float>(cpu_seconds / n);
  }
  bool known() const { return samples_ > 0; }
  double per_sample() const { return known() ? seconds_ / samples_ : 0; }
  // Predicted CPU seconds; 0 if nothing has been measured.
  double predict(TileIndex tile, std::uint64_t pixel_samples) const {
    if (!known()) return 0;
    const double cost = tile_cost_[tile] > 0 ? tile_cost_[tile] : per_sample();
    return std::max(kLeastSeconds, cost * static_cast<double>(pixel_samples));
  }

 private:
  static constexpr double kLeastSeconds = 1e-4;     // the overhead of any unit
  static constexpr double kMemory = 1 - 1.0 / 256;  // exponential mean over the last few hundred results
  double seconds_ = 0, samples_ = 0;
  std::vector<float> tile_cost_;
};

}  // namespace ls::coordinator

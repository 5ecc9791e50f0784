// The CPU seconds that one pixel sample costs, measured from what results report: for each tile, and as a
// running mean over the job for tiles that have no result yet. The cost affects the size of leases and their
// deadlines, never a pixel.
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

  // Adds the cost of one result of this tile. An implausible cost (negative, not finite, more than a day) is
  // ignored.
  void measured(TileIndex tile, std::uint64_t pixel_samples, double cpu_seconds) {
    if (!(cpu_seconds >= 0 && cpu_seconds <= kMostUnitSeconds) || pixel_samples == 0) return;
    const double n = static_cast<double>(pixel_samples);
    seconds_ = seconds_ * kMemory + cpu_seconds;
    samples_ = samples_ * kMemory + n;
    tile_cost_[tile] = static_cast<float>(cpu_seconds / n);
  }
  bool known() const { return samples_ > 0; }
  double per_sample() const { return known() ? seconds_ / samples_ : 0; }
  // Predicts the CPU seconds of a unit of this tile with this many pixel samples; 0 if nothing has been
  // measured.
  double predict(TileIndex tile, std::uint64_t pixel_samples) const {
    if (!known()) return 0;
    const double cost = tile_cost_[tile] > 0 ? tile_cost_[tile] : per_sample();
    return std::max(kLeastSeconds, cost * static_cast<double>(pixel_samples));
  }

 private:
  // CPU seconds that any unit costs at least, however few its samples
  static constexpr double kLeastSeconds = 1e-4;
  // Weight of the past per result: an exponential mean over the last few hundred results
  static constexpr double kMemory = 1 - 1.0 / 256;
  double seconds_ = 0, samples_ = 0;
  std::vector<float> tile_cost_;
};

}  // namespace ls::coordinator

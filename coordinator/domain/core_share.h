// The share of a core that each thread of a worker gets: CPU seconds used / (CPU seconds used + seconds
// waited). Both are measured from the reports that come with the worker's results. The seconds waited are
// those that the thread waited for a core (because of other programs, a nice value, or more threads than
// cores) or for memory from the disk. Costs are CPU seconds (cost_model.h); this share converts them to
// wall-clock seconds. It affects the size of leases, their deadlines and predictions, never a pixel.
#pragma once

#include <algorithm>

#include "coordinator/domain/limits.h"

namespace ls::coordinator {

class CoreShare {
 public:
  // Adds the times of one result. A pair with an implausible value (negative, not finite, more than a day) is
  // ignored.
  void measured(double cpu_seconds, double wait_seconds) {
    const auto sane = [](double s) { return s >= 0 && s <= kMostUnitSeconds; };
    if (!sane(cpu_seconds) || !sane(wait_seconds)) return;
    cpu_ = cpu_ * kMemory + cpu_seconds;
    wall_ = wall_ * kMemory + cpu_seconds + wait_seconds;
  }
  // Returns the share, which is 1 until something has been measured. It is never less than kLeastCoreShare,
  // whatever the worker reports.
  double get() const { return wall_ > 0 ? std::max(kLeastCoreShare, cpu_ / wall_) : 1; }

 private:
  // Weight of the past per result: an exponential mean over about the last hundred results
  static constexpr double kMemory = 1 - 1.0 / 64;
  double cpu_ = 0, wall_ = 0;
};

}  // namespace ls::coordinator

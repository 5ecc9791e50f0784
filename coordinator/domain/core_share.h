// The share of a core that each thread of a worker gets, measured from its results' reports: CPU seconds, and
// the seconds that the thread waited meanwhile for a core (other programs, a nice value, more threads than
// cores) or for memory from the disk. Costs are CPU seconds (cost_model.h); this share converts them to
// wall-clock seconds. It affects the size of leases, their deadlines and predictions, never a pixel.
#pragma once

#include <algorithm>

#include "coordinator/domain/limits.h"

namespace ls::coordinator {

class CoreShare {
 public:
  // Ignores implausible values (negative, not finite, more than a day).
  void measured(double cpu_seconds, double wait_seconds) {
    const auto sane = [](double s) { return s >= 0 && s <= kMostUnitSeconds; };
    if (!sane(cpu_seconds) || !sane(wait_seconds)) return;
    cpu_ = cpu_ * kMemory + cpu_seconds;
    wall_ = wall_ * kMemory + cpu_seconds + wait_seconds;
  }
  // 1 until something has been measured. Never less than kLeastCoreShare, whatever the worker reports.
  double get() const { return wall_ > 0 ? std::max(kLeastCoreShare, cpu_ / wall_) : 1; }

 private:
  static constexpr double kMemory = 1 - 1.0 / 64;  // exponential mean over about the last hundred results
  double cpu_ = 0, wall_ = 0;
};

}  // namespace ls::coordinator

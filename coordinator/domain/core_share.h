// How much of a core each thread of a worker gets, measured from what its results report: CPU seconds, and
// seconds that the thread waited meanwhile for a core (other programs, a nice value, more threads than cores)
// or for memory from the disk. Costs are CPU seconds (cost_model.h); this makes seconds of the clock of them.
// Decides the size of leases, their deadlines and forecasts, never a pixel.
#pragma once

#include <algorithm>

#include "coordinator/domain/limits.h"

namespace ls::coordinator {

class CoreShare {
 public:
  // Absurd figures (negative, not finite, more than a day) are passed over.
  void measured(double cpu_seconds, double wait_seconds) {
    const auto sane = [](double s) { return s >= 0 && s <= kMostUnitSeconds; };
    if (!sane(cpu_seconds) || !sane(wait_seconds)) return;
    cpu_ = cpu_ * kMemory + cpu_seconds;
    wall_ = wall_ * kMemory + cpu_seconds + wait_seconds;
  }
  // 1 while nothing has been measured. Never less than kLeastCoreShare, whatever a worker claims.
  double get() const { return wall_ > 0 ? std::max(kLeastCoreShare, cpu_ / wall_) : 1; }

 private:
  static constexpr double kMemory = 1 - 1.0 / 64;  // the mean follows the last hundred results or so
  double cpu_ = 0, wall_ = 0;
};

}  // namespace ls::coordinator

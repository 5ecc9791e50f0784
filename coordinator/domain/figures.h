// Plain figures of the farm that others pass on, too.
#pragma once

#include <cstdint>

namespace ls::coordinator {

// Limits of what is lent at once; 0: none. Those of a user hold for all its jobs together.
struct ShareLimits {
  std::uint32_t workers_per_job = 0, units_per_job = 0;
  std::uint32_t workers_per_user = 0, units_per_user = 0;
  bool operator==(const ShareLimits&) const = default;
};

// Results rendered again by another worker, since the start.
struct AuditFigures {
  std::uint64_t asked = 0;    // decided to be rendered again
  std::uint64_t equal = 0;    // with the same bits
  std::uint64_t differ = 0;   // with others: a third worker was asked, or the job failed
  std::uint64_t dropped = 0;  // no other worker could, or the job ended
  std::uint64_t missed = 0;   // chosen, but no other worker of the class was there to ask
  std::uint64_t workers_barred = 0, tiles_discarded = 0;
};

}  // namespace ls::coordinator

// Plain values of the farm that other layers pass on.
#pragma once

#include <cstdint>

namespace ls::coordinator {

// Limits on what is leased at the same time; 0: no limit. A user's limits hold for all its jobs together.
struct ShareLimits {
  std::uint32_t workers_per_job = 0, units_per_job = 0;
  std::uint32_t workers_per_user = 0, units_per_user = 0;
  bool operator==(const ShareLimits&) const = default;
};

// Audits (results rendered again by another worker) since the start
struct AuditFigures {
  std::uint64_t asked = 0;    // audits begun
  std::uint64_t equal = 0;    // second result had the same bits
  std::uint64_t differ = 0;   // second result had other bits: a third worker was asked, or the job failed
  std::uint64_t dropped = 0;  // no other worker could render it, or the job ended
  std::uint64_t missed = 0;   // chosen, but no other worker of the class was connected
  std::uint64_t workers_quarantined = 0, tiles_discarded = 0;
};

}  // namespace ls::coordinator

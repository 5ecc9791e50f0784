// Limits and counts of the farm that other layers pass on unchanged.
#pragma once

#include <cstdint>

namespace ls::coordinator {

// Limits on how many workers may hold units, and on how many units may be leased, at the same time; 0: no
// limit. A user's limits hold for all its jobs together.
struct ShareLimits {
  std::uint32_t workers_per_job = 0, units_per_job = 0;
  std::uint32_t workers_per_user = 0, units_per_user = 0;
  bool operator==(const ShareLimits&) const = default;
};

// Counts of audits since the start of the coordinator. An audit has an accepted result rendered again by
// another worker and compares the two.
struct AuditFigures {
  std::uint64_t asked = 0;  // audits begun
  std::uint64_t equal = 0;  // audits whose second result had the same bits
  // Audits whose second result had other bits: a third worker was asked, or the job failed
  std::uint64_t differ = 0;
  std::uint64_t dropped = 0;  // audits given up: no other worker could render the unit, or the job ended
  // Results chosen for an audit that did not begin: no other worker of the class was connected
  std::uint64_t missed = 0;
  std::uint64_t workers_quarantined = 0, tiles_discarded = 0;
};

}  // namespace ls::coordinator

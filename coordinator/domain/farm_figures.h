// Figures of the farm's work that only the service can count: for /metrics.
#pragma once

#include <cstdint>
#include <map>

#include "coordinator/domain/freed_cause.h"

namespace ls::coordinator {

// Counted since this start of the coordinator, but for what is said to be as it is now.
struct FarmFigures {
  // ---- leases ----
  std::uint64_t leases_granted = 0, units_lent = 0;
  std::uint64_t leases_now = 0, units_lent_now = 0;  // as it is now
  std::map<FreedCause, std::uint64_t> units_freed;   // that a worker had and did not hand in
  // ---- results ----
  std::uint64_t accepted = 0;
  std::uint64_t equal = 0;       // second results of a unit, with the bits of the first
  std::uint64_t differing = 0;   // with other bits: somebody's memory is bad, or lies
  std::uint64_t unwanted = 0;    // of ended jobs, stopped tiles, other ranges
  std::uint64_t refused = 0;     // that are not what the unit's must be
  std::uint64_t not_stored = 0;  // for which there was no room on the disk, or the like
  // ---- folding ----
  std::uint64_t folded = 0;
  double fold_lag_seconds = 0;      // summed over `folded`: from a result's arrival to its fold
  std::uint64_t arrived_now = 0;    // results that are being checked and stored
  std::uint64_t arrived_bytes = 0;  // that they take, as it is now
  std::uint64_t waiting_now = 0;    // accepted results that wait for an earlier round of their tile
  std::uint64_t chores_now = 0;     // that wait for the disk
  // ---- bytes ----
  std::uint64_t result_bytes = 0;  // of results that workers sent
  std::uint64_t blob_bytes = 0;    // of blobs sent to workers
};

}  // namespace ls::coordinator

// Counters of the farm's work that only the service can keep; for /metrics.
#pragma once

#include <cstdint>
#include <map>

#include "coordinator/domain/freed_cause.h"

namespace ls::coordinator {

// Counted since this start of the coordinator; names ending in _now are current values.
struct FarmFigures {
  // Leases
  std::uint64_t leases_granted = 0, units_leased = 0;
  std::uint64_t leases_now = 0, units_leased_now = 0;
  std::map<FreedCause, std::uint64_t> units_freed;  // units that left a worker without a result
  // Results
  std::uint64_t accepted = 0;
  std::uint64_t equal = 0;       // second results of a unit with the same bits as the first
  std::uint64_t differing = 0;   // second results with other bits: a worker has bad memory or lies
  std::uint64_t unwanted = 0;    // of ended jobs, stopped tiles or other ranges
  std::uint64_t refused = 0;     // failed verification
  std::uint64_t not_stored = 0;  // disk full or another storage error
  // Folding
  std::uint64_t folded = 0;
  double fold_lag_seconds = 0;              // from a result's arrival to its fold, summed over `folded`
  std::uint64_t arrived_now = 0;            // results being verified and stored
  std::uint64_t arrived_bytes = 0;          // their bytes
  std::uint64_t waiting_now = 0;            // accepted results that wait for an earlier round of their tile
  std::uint64_t background_writes_now = 0;  // writes that wait for the disk
  // Bytes
  std::uint64_t result_bytes = 0;  // received in results from workers
  std::uint64_t blob_bytes = 0;    // sent to workers in blobs
};

}  // namespace ls::coordinator

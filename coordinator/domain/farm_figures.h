// Counters of the farm's work that only the service can keep, not the farm itself. /metrics shows them.
#pragma once

#include <cstdint>
#include <map>

#include "coordinator/domain/freed_cause.h"

namespace ls::coordinator {

// All counters start at 0 when the coordinator starts; members whose names end in _now are current values. A
// unit is one round (range of samples) of one tile.
struct FarmFigures {
  // Leases
  std::uint64_t leases_granted = 0, units_leased = 0;
  std::uint64_t leases_now = 0, units_leased_now = 0;
  std::map<FreedCause, std::uint64_t> units_freed;  // units that left a worker without a result
  // Results
  std::uint64_t accepted = 0;
  std::uint64_t equal = 0;      // second results of a unit with the same bits as the first
  std::uint64_t differing = 0;  // second results with other bits: a worker has bad memory or lies
  // Results of ended jobs, of rounds after a tile's last, or of other sample ranges
  std::uint64_t unwanted = 0;
  std::uint64_t refused = 0;  // results that failed verification
  // Results that could not be stored: the disk was full or the storage failed otherwise
  std::uint64_t not_stored = 0;
  // Folding
  std::uint64_t folded = 0;                 // units whose result was added to the image
  double fold_lag_seconds = 0;              // from a result's arrival to its fold, summed over `folded`
  std::uint64_t arrived_now = 0;            // results that are being verified and stored
  std::uint64_t arrived_bytes = 0;          // bytes that these results take
  std::uint64_t waiting_now = 0;            // accepted results that wait for an earlier round of their tile
  std::uint64_t background_writes_now = 0;  // writes that wait for the disk
  // Bytes
  std::uint64_t result_bytes = 0;  // bytes received in results from workers
  std::uint64_t blob_bytes = 0;    // bytes sent to workers in blobs (files of scenes)
};

}  // namespace ls::coordinator

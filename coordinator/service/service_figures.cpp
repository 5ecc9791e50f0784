// Fills in the counters that /metrics shows.
#include "coordinator/service/service_impl.h"

namespace ls::coordinator {

FarmFigures Service::figures() const {
  const std::lock_guard lock(mutex_);
  FarmFigures f = figures_;
  f.blob_bytes = blob_bytes_;
  f.arrived_now = arrived_.size() + checked_.size();
  f.arrived_bytes = budget_.used();
  f.background_writes_now = background_writes_.size();
  for (const auto& [id, worker] : workers_)
    if (const auto figures = farm_.worker(id)) {
      f.leases_now += figures->leases;
      f.units_leased_now += figures->units_out;
    }
  for (const auto& [id, entry] : entries_)
    if (entry->assembly) f.waiting_now += entry->assembly->waiting();
  return f;
}

}  // namespace ls::coordinator

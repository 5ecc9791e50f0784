// The state of the coordinator's jobs and workers. One mutex guards all of it: it can be reached only through
// Guarded<Core>::lock(). So a function with a Core& parameter runs under the lock, and a function without one
// does not need the lock. Members of a JobEntry that never change (id, scene, settings, grid) may also be
// read without the lock. Slow work has its own threads, which take the lock briefly:
//   receive() -> [verify threads: decode, digest] -> [commit thread: append, one fdatasync for all]
//     -> farm -> acknowledge
//   [writer thread: convergence points, logs, snapshots, final images; strictly in order]
#pragma once

#include <condition_variable>

#include "common/base/guarded.h"
#include "coordinator/domain/farm_figures.h"
#include "coordinator/service/farm_driver.h"
#include "coordinator/service/state/publisher.h"

namespace ls::coordinator {

struct Core {
  Core(Farm::Options farm, bool shared, const Clock& clock, JobStore& store, const JobFiles& files,
       EventHub& hub, BackgroundWrites& writes, ImageWriter& images, ReferenceComparer& comparer,
       const Tracing& tracing)
      : tracing(tracing),
        driver(*this, std::move(farm), clock, files, images, comparer),
        jobs(shared),
        views(driver.farm(), clock),
        records(store, jobs, writes),
        publisher(hub, views, jobs, workers, records, clock) {}

  const Tracing& tracing;
  FarmDriver driver;
  JobTable jobs;
  WorkerTable workers;
  const JobViews views;
  Records records;
  Publisher publisher;
  FarmFigures figures;            // counters; Coordinator::figures() fills in the current values (..._now)
  std::condition_variable ended;  // notified when a job ends or is removed
};

}  // namespace ls::coordinator

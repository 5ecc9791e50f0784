// The state of the coordinator's jobs and workers. One mutex guards the whole state, which can be reached
// only through Guarded<Core>::lock(). So a function with a Core& parameter runs under the lock, and a
// function without one does not need the lock. Members of a JobEntry that never change (id, scene, settings,
// grid) may also be read without the lock. Slow work has its own threads, which hold the lock only briefly.
// Terms: docs/reference/glossary.md.
// The path of a worker's result:
//   receive() -> [verify threads: decode, digest] -> [commit thread: append to the job's log, one fdatasync
//     for many results] -> farm (the state machine that decides which worker renders what) -> acknowledge
// The writer thread stores, strictly in order, the data that may be stored later: convergence points, logs,
// snapshots (the image so far, for a restart) and final images.
#pragma once

#include <condition_variable>
#include <deque>
#include <vector>

#include "coordinator/domain/farm/farm.h"
#include "coordinator/domain/farm_figures.h"
#include "coordinator/service/state/job_files.h"
#include "coordinator/service/state/publisher.h"
#include "coordinator/service/state/records.h"
#include "core/base/guarded.h"

namespace ls::coordinator {

struct Core;
class ImageWriter;
class ReferenceComparer;

// Drives the farm: passes events to it, and carries out its effects (domain/effect.h), in order. Part of
// Core, so all of it runs under the lock.
class FarmDriver {
 public:
  FarmDriver(Core& core, Farm::Options options, const Clock& clock, const JobFiles& files,
             ImageWriter& images, ReferenceComparer& comparer);

  const Farm& farm() const { return farm_; }
  void run(Event first);
  // Gives a stored job to the farm after a restart. No events are published for the results that are added to
  // the image again.
  void replay(JobEntry& entry, JobRestored event);
  // Quarantines workers that were read from the job store and therefore need not be stored again.
  void quarantine(const std::vector<QuarantinedWorker>& workers);
  // Unloads an ended job whose files are complete on disk: frees its image in memory and its state in the
  // farm; only its files and its record remain. Results that still arrive for it are dropped.
  void unload(JobEntry& entry);
  // Lets the jobs that wait for this job, frame or sequence begin if it is done and was the last one that
  // they waited for. Called when a job has ended or was removed, outside of run() if it is done. After a
  // frame, those that wait for its whole sequence hear of it if that changes the sequence's state for them.
  void notify_jobs_after(const JobId& ended);
  // Sets what the job waits for (JobSpec::after), in the farm and in its record in memory.
  void set_after(const EntryPtr& entry, std::vector<std::string> after);
  void forget_done_prerequisites(const EntryPtr& entry);

 private:
  void on(const Send& e);
  void on(const UnitsFreed& e);
  void on(const RecordUnit& e);
  void on(const Fold& e);
  void on(const DropDuplicate& e);
  void on(const DropUnwanted& e);
  void on(const DigestMismatch& e);
  void on(const JobPinned& e);
  void on(const JobUnpinned& e);
  void on(const JobStateChanged& e);
  void on(const Checkpoint& e);
  void on(const CheckDenoised& e);
  void on(const ReopenRound& e);
  void on(const JobFinished& e);
  void on(const JobFailed& e);
  void on(const WorkerStateChanged& e);
  void on(const WorkerBlocked& e);
  void on(const WorkerFruitless& e);
  void on(const WorkerFoundFaulty& e);
  void on(const TileDiscarded& e);
  void on(const WorkerForgotten& e);
  void notify_waiting_for(const JobId& id);
  Result<WaitingPartial> partial_for(JobEntry& entry, const Fold& e) const;
  void note_leased(const Lease& lease, const WorkerId& worker);
  void note_worker(const WorkerId& worker, const std::string& text);  // WorkerEntry::note
  void end_image(const EntryPtr& entry);
  void end_curve(const EntryPtr& entry);

  Core& core_;
  Farm farm_;
  const Clock& clock_;
  const JobFiles& files_;
  ImageWriter& images_;
  ReferenceComparer& comparer_;
  std::deque<Event> todo_;  // the farm's next events; carrying out an effect may add some
  // Jobs whose images have got results since run() began. At its end run() checks whether these jobs need a
  // snapshot
  std::vector<EntryPtr> folded_;
};

struct Core {
  Core(Farm::Options farm, bool shared, const Clock& clock, JobStore& store, const JobFiles& files,
       EventHub& hub, BackgroundWrites& writes, ImageWriter& images, ReferenceComparer& comparer,
       const Tracing& tracing)
      : tracing(tracing),
        driver(*this, std::move(farm), clock, files, images, comparer),
        jobs(shared),
        views(driver.farm(), jobs, clock),
        records(store, jobs, writes),
        publisher(hub, views, jobs, workers, records, clock) {}

  const Tracing& tracing;
  FarmDriver driver;
  JobTable jobs;
  WorkerTable workers;
  const JobViews views;
  Records records;
  Publisher publisher;
  FarmFigures figures;            // the counters; Coordinator::figures() sets the other members (..._now)
  std::condition_variable ended;  // notified when a job ends or is removed
};

// Selects and orders the jobs that a client's list shows (job_list.cpp). Makes views only of the jobs on the
// page, unless the order needs the views of all. The lock is held for a few jobs at a time, so that a long
// list does not hold up others: jobs may change while it is made.
JobsPage list_jobs(Guarded<Core>& core, const JobsAsked& asked);

}  // namespace ls::coordinator

// Stores everything that must survive a restart: records of jobs, their logs and curves, quarantined workers.
// Jobs' records and quarantined workers are stored immediately, because the farm relies on them; logs and
// curves are stored in the background.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "coordinator/base/work_queue.h"
#include "coordinator/service/state/job_table.h"
#include "core/base/guarded.h"

namespace ls::coordinator {

// A queue of writes to disk; one thread makes them strictly in the order in which they were pushed.
using BackgroundWrites = WorkQueue<std::function<void()>>;

class Records {
 public:
  Records(JobStore& store, const JobTable& jobs, BackgroundWrites& writes)
      : store_(store), jobs_(jobs), writes_(writes) {}

  // Stores the job's record. If this fails, returns false, trouble() gives the reason, and retry() tries
  // again.
  bool put(const EntryPtr& entry);
  // Tries to store the records that could not be stored before. Called at each tick, and at the end.
  void retry();
  // Calls `changes`, and then stores all jobs for which `changes` called put(). One transaction stores them
  // all, since a sequence may have thousands of frames and a transaction for each would take long.
  // As with put(), retry() tries again what could not be stored.
  void put_together(const std::function<void()>& changes);
  bool puts_together() const { return together_ != nullptr; }
  // Stores the numeric class that the job is pinned to, if it is not stored yet. After a restart a class that
  // was not stored would be forgotten, and the job could be pinned to another one. So until it is stored, the
  // job waits and none of its results is accepted.
  Result<void> put_pin(const EntryPtr& entry);
  void add_quarantined(QuarantinedWorker worker) { quarantined_.push_back(std::move(worker)); }
  // Stores the quarantined workers that are not stored yet. Until they are, no result may be stored.
  Result<void> put_quarantined();
  // Why a record or a result could not be stored; empty: all records are stored, and no attempt has failed
  // since a result was last stored
  std::string trouble() const { return trouble_.empty() ? store_trouble() : trouble_; }
  // Notes whether the job store took a record that is not stored by put(). store_trouble() is the reason why
  // it did not take the latest one; empty: it did. Both are thread-safe, since some records are stored in the
  // background.
  void note(const Result<void>& stored) { *store_trouble_.lock() = stored ? "" : stored.error().message; }
  std::string store_trouble() const { return *store_trouble_.lock(); }
  void set_trouble(std::string why) { trouble_ = std::move(why); }

  void log(const JobId& id, std::string text);
  void add_point(const EntryPtr& entry, const ConvergencePoint& point);
  // Drops the points of the job's convergence curve, because the job's image was lost or had wrong pixels.
  // New points are added when the results of its tiles are added to the image again.
  void forget_curve(JobEntry& entry);
  // Drops the points of the curve and the checks of the denoised layers' error, because the image had wrong
  // pixels.
  void forget_wrong_pixels(JobEntry& entry);
  void set_reference_error(const JobId& id, double spp, const ReferenceError& error);

 private:
  Result<void> put_all(const std::set<EntryPtr>& entries) const;
  void not_saved(std::set<EntryPtr> entries, const Error& why);

  JobStore& store_;
  const JobTable& jobs_;
  BackgroundWrites& writes_;
  std::set<EntryPtr> unsaved_;              // jobs whose latest record could not be stored
  std::string unsaved_because_;             // why the last of them could not be
  std::set<EntryPtr>* together_ = nullptr;  // jobs that put_together() will store; null: it is not running
  std::vector<QuarantinedWorker> quarantined_;
  std::string trouble_;
  mutable Guarded<std::string> store_trouble_;
  std::uint64_t lines_left_out_ = 0;
};

}  // namespace ls::coordinator

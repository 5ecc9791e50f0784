// Publishes changes of jobs and workers as events (event_hub.h). Events about a job's progress are sent at a
// minimum interval; publish_due() sends those that were delayed.
#pragma once

#include <string>
#include <string_view>

#include "coordinator/service/state/event_hub.h"
#include "coordinator/service/state/job_views.h"
#include "coordinator/service/state/records.h"

namespace ls::coordinator {

class Publisher {
 public:
  Publisher(EventHub& hub, const JobViews& views, JobTable& jobs, WorkerTable& workers,
            const Records& records, const Clock& clock)
      : hub_(hub), views_(views), jobs_(jobs), workers_(workers), records_(records), clock_(clock) {}

  // If `quiet`, changes of jobs and sequences are not published.
  void set_quiet(bool quiet) { quiet_ = quiet; }
  bool quiet() const { return quiet_; }

  void job(JobEntry& entry);
  void progress(JobEntry& entry);
  void sequence(const JobId& id, bool at_once);
  void publish_due();
  void job_removed(const JobId& id, const std::string& owner);
  void job_moved(const JobId& id, const std::string& owner);  // the job is now at another coordinator
  void tile(const JobEntry& entry, TileIndex tile, const PixelRect& rect, std::string_view state,
            std::uint64_t spp, const WorkerId& worker = {});
  void worker(const WorkerId& id, bool at_once);
  void worker_gone(const WorkerId& id);

 private:
  EventHub& hub_;
  const JobViews& views_;
  JobTable& jobs_;
  WorkerTable& workers_;
  const Records& records_;
  const Clock& clock_;
  bool quiet_ = false;
};

}  // namespace ls::coordinator

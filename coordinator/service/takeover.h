// Several coordinators on one store: takes over jobs from a coordinator that is gone, and drops jobs that
// another one has taken over (store/redis/redis_members.h). Both happen on the writer thread, after earlier
// writes of these jobs.
#pragma once

#include <vector>

#include "common/base/guarded.h"
#include "coordinator/service/restore.h"
#include "coordinator/service/state/records.h"

namespace ls::coordinator {

class Takeover {
 public:
  Takeover(Guarded<Core>& core, JobStore& store, const JobFiles& files, const BlobStore& blobs,
           const Restore& restore, BackgroundWrites& writes, const Clock& clock)
      : core_(core),
        store_(store),
        files_(files),
        blobs_(blobs),
        restore_(restore),
        writes_(writes),
        clock_(clock) {}

  // Takes over jobs of coordinators that are gone, and drops those that another coordinator owns now.
  void look_for_moved_jobs();

 private:
  struct Inheritance {
    JobStore::Inherited job;
    TimePoint again{};  // time of the next attempt
  };
  void take_over(Inheritance inheritance);
  void let_go(const JobId& id);

  Guarded<Core>& core_;
  JobStore& store_;
  const JobFiles& files_;
  const BlobStore& blobs_;
  const Restore& restore_;
  BackgroundWrites& writes_;
  const Clock& clock_;
  std::vector<Inheritance> later_;  // jobs whose takeover is repeated later; guarded by the lock
};

}  // namespace ls::coordinator

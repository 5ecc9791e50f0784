// Carries out users' commands: changes and removals of jobs and sequences (jobs with frames). Every change is
// checked completely before any part of it is applied.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "coordinator/domain/event.h"
#include "coordinator/service/image_writer.h"
#include "coordinator/service/restore.h"
#include "core/base/guarded.h"

namespace ls::coordinator {

// A job, and the jobs that it is to wait for (JobSpec::after)
struct JobWait {
  EntryPtr job;
  std::vector<std::string> after;
};

class JobCommands {
 public:
  JobCommands(Guarded<Core>& core, JobStore& store, const JobFiles& files, const Restore& restore,
              ImageWriter& images, BackgroundWrites& writes, const Clock& clock)
      : core_(core),
        store_(store),
        files_(files),
        restore_(restore),
        images_(images),
        writes_(writes),
        clock_(clock) {}

  // Changes a job, or all frames of a sequence. An ended job or frame renders again only if it gets more
  // samples or a smaller target error.
  Result<void> change(const JobId& id, const JobChange& change) const;
  // Removes an ended job, or a sequence whose frames have all ended, with all results. If the job or some
  // frames have not ended, these are cancelled, and nothing is removed. The id of a single frame is an error.
  Result<void> remove(const JobId& id) const;
  using Entries = std::vector<EntryPtr>;
  // Changes the state of the jobs; the caller must have checked that this is possible. Either the records of
  // all jobs are stored, or the change is refused and has no effect. A job whose final image is being written
  // is left unchanged; if that writing has failed and `asked` is `running`, the image is written again.
  Result<void> become(Core& core, const Entries& jobs, JobState asked) const;

 private:
  template <class Command>
  Result<void> carry_out(const JobId& id, Command command) const;
  Result<void> remove_job(Core& core, const JobId& id) const;
  Result<void> change_job(Core& core, const EntryPtr& entry, const JobChange& change) const;
  template <class Edit>
  Result<void> edit_all(Core& core, const Entries& jobs, Edit edit) const;
  Result<void> rename(Core& core, const Entries& jobs, const std::string& name) const;
  Result<void> set_priority(Core& core, const Entries& jobs, int priority) const;
  Result<void> set_after(Core& core, const std::vector<JobWait>& waits) const;
  Result<void> set_focus(Core& core, const Entries& jobs, const std::optional<PixelRect>& focus) const;
  Result<void> extend(Core& core, JobEntry& entry, std::uint64_t spp) const;
  Result<void> set_target(Core& core, JobEntry& entry, double target_error) const;
  Result<void> go_on(Core& core, JobEntry& entry, const Result<JobPlan>& plan, const Event& change,
                     std::string log_line) const;

  Result<void> change_sequence(Core& core, const JobId& id, const Sequence& sequence,
                               const JobChange& change) const;
  Result<void> remove_sequence(Core& core, const JobId& id, const Sequence& sequence) const;
  void drop(Core& core, const EntryPtr& entry) const;

  Guarded<Core>& core_;
  JobStore& store_;
  const JobFiles& files_;
  const Restore& restore_;
  ImageWriter& images_;
  BackgroundWrites& writes_;
  const Clock& clock_;
};

}  // namespace ls::coordinator

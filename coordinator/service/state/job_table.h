// All jobs in memory. A frame of a sequence is a job of its own, named by frame_job(). A sequence is defined
// by the ids of its frames alone; nothing else about it is stored.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "coordinator/service/state/job_entry.h"

namespace ls::coordinator {

class JobTable {
 public:
  // `shared`: other coordinators use the same store and make ids, too.
  explicit JobTable(bool shared) : shared_(shared) {}

  EntryPtr find(const JobId& id) const;  // null if there is no such job
  Sequence* sequence(const JobId& id);   // null if there is no such sequence
  // Return the job, or an error: job() fails for a sequence, which is no job of its own; usable() also fails
  // for a job that could not be restored at the start. Such a job can only be removed.
  Result<EntryPtr> job(const JobId& id) const;
  Result<EntryPtr> usable(const JobId& id) const;
  Result<std::vector<EntryPtr>> job_or_frames(const JobId& id) const;
  Result<std::string> owner(const JobId& id) const;
  const std::map<JobId, EntryPtr>& all() const { return jobs_; }
  std::map<JobId, Sequence>& sequences() { return sequences_; }
  // In order of submission; a sequence appears once, not its frames
  const std::vector<JobId>& order() const { return order_; }

  JobId unused_id() const;
  // Returns an error if there is no room for `jobs` more jobs.
  Result<void> room_for(const std::string& owner, std::size_t jobs) const;
  // Adds a job. If it is a frame, it joins its sequence, which is listed at the place of its first frame.
  void add(const EntryPtr& entry);
  // Removes a job or a sequence from order(). Its jobs stay in the table until remove()
  void unlist(const JobId& id);
  // Removes the job. Returns the id that is no longer in order(): the job's, or the sequence's if the job was
  // its last frame.
  std::optional<JobId> remove(const EntryPtr& entry);

 private:
  const bool shared_;
  std::map<JobId, EntryPtr> jobs_;
  std::map<JobId, Sequence> sequences_;
  std::vector<JobId> order_;
};

}  // namespace ls::coordinator

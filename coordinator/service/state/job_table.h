// All jobs in memory. A frame of a sequence is a job of its own, named by frame_job(); only the ids of its
// frames make a sequence, so nothing else is stored that could be lost.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "coordinator/service/state/job_entry.h"

namespace ls::coordinator {

class JobTable {
 public:
  // `shared`: other coordinators make ids, too.
  explicit JobTable(bool shared) : shared_(shared) {}

  EntryPtr find(const JobId& id) const;  // null if there is no such job
  Sequence* sequence(const JobId& id);   // null if there is no such sequence
  // Return the job. It is an error to name a sequence instead of one of its frames, and for usable() to name
  // a job that could not be restored at the start: then only the reason is known, and it can only be removed.
  Result<EntryPtr> job(const JobId& id) const;
  Result<EntryPtr> usable(const JobId& id) const;
  Result<std::vector<EntryPtr>> job_or_frames(const JobId& id) const;
  Result<std::string> owner(const JobId& id) const;
  const std::map<JobId, EntryPtr>& all() const { return jobs_; }
  std::map<JobId, Sequence>& sequences() { return sequences_; }
  // In order of submission; a sequence stands for its frames
  const std::vector<JobId>& order() const { return order_; }

  JobId unused_id() const;
  // Returns an error if there is no room for `jobs` more jobs.
  Result<void> room_for(const std::string& owner, std::size_t jobs) const;
  // Adds a job. If it is a frame, it joins its sequence, which is listed at the place of its first frame.
  void add(const EntryPtr& entry);
  void unlist(const JobId& id);  // takes a job or a sequence off the list; the jobs stay until remove()
  // Returns the id that is not listed any more: that of the job, or of the sequence whose last frame it was.
  std::optional<JobId> remove(const EntryPtr& entry);

 private:
  const bool shared_;
  std::map<JobId, EntryPtr> jobs_;
  std::map<JobId, Sequence> sequences_;
  std::vector<JobId> order_;
};

}  // namespace ls::coordinator

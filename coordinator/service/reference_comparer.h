// Compares the pictures of jobs that have a reference image with it. The picture of every checkpoint is
// compared on a thread of its own, since comparing pictures takes longer than summing errors. A job's final
// image and report wait for its comparisons.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include "coordinator/base/guarded.h"
#include "coordinator/base/work_queue.h"
#include "coordinator/service/state/job_entry.h"
#include "coordinator/store/blobs/blob_store.h"

namespace ls::coordinator {

struct Core;

class ReferenceComparer {
 public:
  ReferenceComparer(Guarded<Core>& core, const BlobStore& blobs) : core_(core), blobs_(blobs) {}

  // Has a checkpoint compared: the one just taken, or one from before a restart that was not compared then.
  void compare(Core&, const EntryPtr& entry, std::span<const RoundIndex> rounds, double spp);
  // Has the final image compared, so that the report is complete.
  void compare_last(Core&, const EntryPtr& entry);
  // Has `task` run on the comparing thread, when the comparisons asked for before are made.
  void run_afterwards(std::function<void()> task) { tasks_.push(std::move(task)); }

  void loop(const std::stop_token& token);  // the comparing thread

 private:
  void compare_tiles(const EntryPtr& entry, std::uint64_t curve, double spp,
                     const std::vector<TilePicture>& tiles, bool last);
  std::shared_ptr<const Reference> reference_of(const StoredJob& job);

  Guarded<Core>& core_;
  const BlobStore& blobs_;
  WorkQueue<std::function<void()>> tasks_;
  std::shared_ptr<const Reference> reference_;  // that of the last comparison; used by the thread only
  Digest reference_digest_;
};

}  // namespace ls::coordinator

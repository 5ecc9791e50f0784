// Compares pictures of jobs with their reference images, if they have any. The picture of every checkpoint (a
// state of the image that becomes a point of the convergence curve) is compared on a separate thread, the
// comparing thread, since a comparison takes longer than a checkpoint. A job's final image and report wait
// for its comparisons.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include "coordinator/base/work_queue.h"
#include "coordinator/service/state/job_table.h"
#include "coordinator/store/blobs/blob_store.h"
#include "core/base/guarded.h"

namespace ls::coordinator {

struct Core;

class ReferenceComparer {
 public:
  ReferenceComparer(Guarded<Core>& core, const BlobStore& blobs) : core_(core), blobs_(blobs) {}

  // Queues the comparison of a checkpoint: of the checkpoint just taken or, after a restart, of an earlier
  // one whose comparison was not made or stored before the restart.
  void compare(Core&, const EntryPtr& entry, std::span<const RoundIndex> rounds, double spp);
  // Queues the comparison of the final image. Its result is a part of the job's report.
  void compare_last(Core&, const EntryPtr& entry);
  // Runs `task` on the comparing thread, after the comparisons that were queued before.
  void run_afterwards(std::function<void()> task) { tasks_.push(std::move(task)); }

  void loop(const std::stop_token& token);  // runs on the comparing thread

 private:
  void compare_tiles(const EntryPtr& entry, std::uint64_t curve, double spp,
                     const std::vector<TilePicture>& tiles, bool last);
  std::shared_ptr<const Reference> reference_of(const StoredJob& job);

  Guarded<Core>& core_;
  const BlobStore& blobs_;
  WorkQueue<std::function<void()>> tasks_;
  // The reference used most recently; only the comparing thread uses it
  std::shared_ptr<const Reference> reference_;
  Digest reference_digest_;
};

}  // namespace ls::coordinator

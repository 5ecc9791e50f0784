// Watches over blobs (files of scenes). Jobs whose blobs are missing or damaged are paused; this does not
// count as a failure of a unit or of a worker. The jobs resume automatically when the blobs are available
// again. Blobs that no job needs are removed. "The lock" is that of Core.
#pragma once

#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "coordinator/base/work_queue.h"
#include "coordinator/service/job_commands.h"
#include "coordinator/store/blobs/collected_blobs.h"
#include "core/base/guarded.h"

namespace ls::coordinator {

// Returns the blobs that the job needs and the store lacks. Do not hold the lock during the call: it may wait
// for the network.
Result<std::vector<BlobRef>> missing_blobs_of(const StoredJob& job, const BlobStore& blobs);
// Notes in the job's entry that it waits for the blob, and what its user can do. `damaged`: the blob exists
// but has wrong bytes. The caller pauses the job.
void await_blob(Core& core, JobEntry& entry, const BlobRef& file, bool damaged);

class BlobWatch {
 public:
  // `keep_unused`: how long blobs that no job needs are kept; nullopt: forever
  BlobWatch(Guarded<Core>& core, CollectedBlobs& blobs, const JobCommands& commands,
            std::optional<Duration> keep_unused, const Clock& clock)
      : core_(core), blobs_(blobs), commands_(commands), keep_unused_(keep_unused), clock_(clock) {}

  // Called when a worker has requested a blob that the store lacks or has only with damaged bytes: pauses the
  // jobs that need the blob. `why`: the store's error.
  void missing(const Digest& digest, const Error& why);
  // If a lookup is due, starts one: it checks whether blobs that were missing are in the store again. It runs
  // on a separate thread (look_loop()), since it may wait for the network.
  void look_if_due(Core& core);
  void look_loop(const std::stop_token& token);

  // Checks whether the blob store is available. Requests of workers do not suffice to detect an outage, since
  // hours may pass between two requests.
  void check_store();
  // Returns why the store is unavailable; empty: it is available.
  const std::string& trouble(Core&) const { return trouble_; }

  void collect();
  void collect_loop(const std::stop_token& token);

 private:
  void look_for(const std::set<Digest>& digests);
  std::optional<std::set<Digest>> needed_blobs();

  Guarded<Core>& core_;
  CollectedBlobs& blobs_;
  const JobCommands& commands_;
  const std::optional<Duration> keep_unused_;
  const Clock& clock_;
  WorkQueue<std::set<Digest>> looks_;
  TimePoint last_look_{};  // last_look_ and trouble_ are guarded by the lock of Core
  std::string trouble_;
};

}  // namespace ls::coordinator

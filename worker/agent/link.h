// How the agent reaches its coordinator (CoordinatorLink) and gets the files of jobs (BlobFiles).
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/base/error.h"
#include "util/protocol/messages.h"

namespace ls::worker {

// Receives the bytes of a blob, piece by piece and in order. An error that it returns ends the transfer.
using BlobSink = std::function<Result<void>(std::span<const std::byte>)>;

class LinkObserver {
 public:
  virtual ~LinkObserver() = default;
  virtual void received(ToWorker message) = 0;  // called in the order of arrival, on any thread
  // Called once for each connection, when it has ended. An implementation must not call connect() or close(),
  // since they wait until lost() has returned.
  virtual void lost(Error why) = 0;
};

// A request for the bytes of a blob from `offset` to its end.
struct BlobRequest {
  Digest digest;
  std::uint64_t offset = 0;
  // True if an earlier transfer delivered wrong bytes, so that the coordinator should check its copy
  bool arrived_wrong = false;
};

// The agent's connection to its coordinator. There are two implementations: over gRPC (worker/client) and
// within one process (cli/local/local_farm.h).
class CoordinatorLink {
 public:
  virtual ~CoordinatorLink() = default;
  // Opens a stream to the coordinator and sends the hello. The coordinator's messages, the first of which is
  // Welcome or Refused, are passed to the observer.
  virtual Result<void> connect(const WorkerHello& hello, std::shared_ptr<LinkObserver> observer) = 0;
  // Queues the message. It is lost if the connection ends before the message is sent.
  virtual void send(FromWorker message) = 0;
  virtual void close() = 0;
  // Fetches the bytes of a blob and passes them to `sink` in order. If `sink` returns an error (because the
  // disk is full or the digest is wrong), the transfer ends with that error.
  virtual Result<void> fetch_blob(const BlobRequest& wanted, const BlobSink& sink) = 0;
};

// A complete, verified blob on this machine. The file is not removed while the object lives.
class BlobFile {
 public:
  virtual ~BlobFile() = default;
  virtual const std::filesystem::path& path() const = 0;
};

inline const std::atomic<bool> kNeverStop{false};

// Provides the files of a job's blobs (its scene and assets). There are two implementations: a cache that
// fetches missing blobs from the coordinator (worker/cache), and `lightshaft render`, whose files are local
// already (cli/local).
class BlobFiles {
 public:
  virtual ~BlobFiles() = default;
  // Returns the blob's file, and blocks while it is fetched. The error unavailable means that the transfer
  // was interrupted; the bytes received are kept, and the caller should try again later. The errors
  // resource_exhausted and internal mean that this machine or its coordinator has a problem (a full disk, the
  // cache limit, a blob missing at the coordinator) that is not the job's fault and may pass. Other errors
  // are final: for example not_found, if no source has the blob. If `stop` becomes true, a transfer counts as
  // interrupted.
  virtual Result<std::shared_ptr<const BlobFile>> acquire(const BlobRef& blob,
                                                          const std::atomic<bool>& stop = kNeverStop) = 0;
  // Returns the digests of the blobs on this machine, at most `limit`, most recently used first. The worker's
  // hello sends this list to the coordinator.
  virtual std::vector<Digest> held(std::size_t limit) const = 0;
};

}  // namespace ls::worker

// The agent's connection to its coordinator: over gRPC (worker/client) or within one process
// (cli/local/local_link.h).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "common/base/error.h"
#include "common/protocol/messages.h"

namespace ls::worker {

class LinkObserver {
 public:
  virtual ~LinkObserver() = default;
  virtual void received(ToWorker message) = 0;  // called from any thread, in order
  virtual void lost(Error why) = 0;             // once per connection; connect() may be called again
};

// Bytes of a blob from `offset` to its end.
struct BlobRequest {
  Digest digest;
  std::uint64_t offset = 0;
  bool arrived_wrong =
      false;  // an earlier transfer delivered wrong bytes: the coordinator should check its copy
};

class CoordinatorLink {
 public:
  virtual ~CoordinatorLink() = default;
  // Opens one stream and sends the hello. Messages, first Welcome or Refused, arrive through the observer.
  virtual Result<void> connect(const WorkerHello& hello, std::shared_ptr<LinkObserver> observer) = 0;
  virtual void send(FromWorker message) = 0;  // queued; lost if the connection ends
  virtual void close() = 0;
  // The sink may return an error (disk full, wrong digest), which ends the transfer.
  virtual Result<void> fetch_blob(const BlobRequest& wanted,
                                  const std::function<Result<void>(std::span<const std::byte>)>& sink) = 0;
};

}  // namespace ls::worker

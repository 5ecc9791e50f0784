// The agent's connection to its coordinator. There are two implementations: over gRPC (worker/client) and
// within one process (cli/local/local_farm.h).
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
  // Called once per connection. connect() and close() wait for it to return, so it must not call them.
  virtual void lost(Error why) = 0;
};

// A request for the bytes of a blob from `offset` to its end.
struct BlobRequest {
  Digest digest;
  std::uint64_t offset = 0;
  // True if an earlier transfer delivered wrong bytes, so that the coordinator should check its copy
  bool arrived_wrong = false;
};

class CoordinatorLink {
 public:
  virtual ~CoordinatorLink() = default;
  // Opens a stream to the coordinator and sends the hello. The coordinator's messages, the first of which is
  // Welcome or Refused, are passed to the observer.
  virtual Result<void> connect(const WorkerHello& hello, std::shared_ptr<LinkObserver> observer) = 0;
  // Queues the message; it is lost if the connection ends before it is sent
  virtual void send(FromWorker message) = 0;
  virtual void close() = 0;
  // Fetches the bytes and passes them to `sink` in order. The transfer ends if `sink` returns an error (disk
  // full, wrong digest).
  virtual Result<void> fetch_blob(const BlobRequest& wanted,
                                  const std::function<Result<void>(std::span<const std::byte>)>& sink) = 0;
};

}  // namespace ls::worker

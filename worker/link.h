// How an agent reaches its coordinator: over gRPC (worker/client) or within one process (cli/local_link).
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
  virtual void received(ToWorker message) = 0;  // any thread, in order
  virtual void lost(Error why) = 0;             // once per connection; connect() may be called again
};

// Bytes of a blob from `offset` to its end.
struct BlobRequest {
  Digest digest;
  std::uint64_t offset = 0;
  bool arrived_wrong =
      false;  // an earlier transfer brought other bytes: the coordinator shall look at its own
};

class CoordinatorLink {
 public:
  virtual ~CoordinatorLink() = default;
  // Opens one stream and sends the hello. Messages, a Welcome or Refused first, come through the observer.
  virtual Result<void> connect(const WorkerHello& hello, std::shared_ptr<LinkObserver> observer) = 0;
  virtual void send(FromWorker message) = 0;  // queued; lost with the connection
  virtual void close() = 0;
  // The sink may refuse (disk full, digest wrong) and so ends the transfer.
  virtual Result<void> fetch_blob(const BlobRequest& wanted,
                                  const std::function<Result<void>(std::span<const std::byte>)>& sink) = 0;
};

}  // namespace ls::worker

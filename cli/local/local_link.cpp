#include "cli/local/local_link.h"

#include <algorithm>

#include "common/protocol/limits.h"

namespace ls::cli {
namespace {

class ObserverSink final : public coordinator::WorkerSink {
 public:
  explicit ObserverSink(std::shared_ptr<worker::LinkObserver> observer) : observer_(std::move(observer)) {}
  void send(ToWorker message) override { observer_->received(std::move(message)); }
  void close() override { observer_->lost({Errc::unavailable, "the coordinator has closed the stream"}); }

 private:
  std::shared_ptr<worker::LinkObserver> observer_;
};

}  // namespace

Result<void> LocalLink::connect(const WorkerHello& hello, std::shared_ptr<worker::LinkObserver> observer) {
  auto session = coordinator_.connect(hello, std::make_shared<ObserverSink>(std::move(observer)));
  if (!session) return tl::unexpected(session.error());
  session_ = std::move(*session);
  return {};
}

void LocalLink::send(FromWorker message) {
  if (!session_) return;
  if (const auto* result = std::get_if<UnitResult>(&message); result && on_result_) on_result_(*result);
  session_->receive(std::move(message));
}

void LocalLink::close() {
  if (!session_) return;
  session_->disconnected();
  session_.reset();
}

Result<void> LocalLink::fetch_blob(const worker::BlobRequest& wanted,
                                   const std::function<Result<void>(std::span<const std::byte>)>& sink) {
  const auto size = coordinator_.blobs().size(wanted.digest);
  if (!size) return tl::unexpected(size.error());
  for (std::uint64_t offset = wanted.offset; offset < *size;) {
    const auto length = std::min<std::uint64_t>(limits::kBlobChunkBytes, *size - offset);
    const auto bytes = coordinator_.blobs().read(wanted.digest, offset, length);
    if (!bytes) return tl::unexpected(bytes.error());
    if (auto taken = sink(*bytes); !taken) return taken;
    offset += length;
  }
  return {};
}

}  // namespace ls::cli

// The agent's link to a coordinator in the same process: the same messages, without sockets or encoding.
#pragma once

#include <functional>
#include <memory>

#include "coordinator/service/coordinator.h"
#include "worker/agent/link.h"

namespace ls::cli {

class LocalLink final : public worker::CoordinatorLink {
 public:
  // `coordinator` must outlive the link. `on_result`, if given, is called with every result before the
  // coordinator receives it.
  explicit LocalLink(coordinator::Coordinator& coordinator,
                     std::function<void(const UnitResult&)> on_result = {})
      : coordinator_(coordinator), on_result_(std::move(on_result)) {}

  Result<void> connect(const WorkerHello& hello, std::shared_ptr<worker::LinkObserver> observer) override;
  void send(FromWorker message) override;
  void close() override;
  Result<void> fetch_blob(const worker::BlobRequest& wanted,
                          const std::function<Result<void>(std::span<const std::byte>)>& sink) override;

 private:
  coordinator::Coordinator& coordinator_;
  std::function<void(const UnitResult&)> on_result_;
  std::unique_ptr<coordinator::WorkerSession> session_;
};

}  // namespace ls::cli

// A whole farm in this process: the coordinator without sockets, and one worker agent with all threads.
// `lightshaft render` uses it, so it renders the same pixels as a farm of many machines.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "cli/local/local_scene.h"
#include "coordinator/service/coordinator.h"
#include "coordinator/store/blobs/memory_blobs.h"
#include "worker/agent/agent.h"
#include "worker/agent/link.h"

namespace ls::cli {

// The agent's link to a coordinator in the same process. It passes the same messages as a network link,
// without sockets or encoding.
class LocalLink final : public worker::CoordinatorLink {
 public:
  // `coordinator` must outlive the link. `on_result`, if given, is called with every result just before the
  // result goes to the coordinator.
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

// Gives the worker agent in this process the blobs (scene and assets, identified by digest) of the
// coordinator in this process as files. An asset is not copied: its file is the user's own. The canonical
// scene, which the coordinator has in memory, becomes a memory file, which leaves nothing on disk.
class LocalBlobFiles final : public worker::BlobFiles {
 public:
  explicit LocalBlobFiles(std::shared_ptr<coordinator::MemoryBlobs> blobs) : blobs_(std::move(blobs)) {}
  // All errors of acquire() are final: waiting and trying again would not help.
  Result<std::shared_ptr<const worker::BlobFile>> acquire(const BlobRef& blob,
                                                          const std::atomic<bool>& stop) override;
  std::vector<Digest> held(std::size_t) const override { return {}; }

 private:
  std::shared_ptr<coordinator::MemoryBlobs> blobs_;
};

class LocalFarm {
 public:
  struct Options {
    int threads = 1;
    bool isolate = false;                       // true: render in a child process
    std::shared_ptr<const DisplayViews> views;  // as Coordinator::Options::views
  };
  static Result<std::unique_ptr<LocalFarm>> open(Options options);
  ~LocalFarm();

  coordinator::Coordinator& coordinator() { return *coordinator_; }
  // Registers a file that a job's spec may refer to by its digest.
  Result<Digest> adopt(const std::filesystem::path& file);
  tl::expected<JobId, coordinator::Rejected> submit(const LocalScene& scene, const JobSpec& spec);

  // Renders the submitted jobs until stop(). `on_result` is called with the result of every finished unit, on
  // the agent's thread. Call once.
  Result<void> start(std::function<void(const UnitResult&)> on_result);
  void stop();

  double load_seconds() const;  // the longest time that preparing a scene for rendering took
  // Why the scene could not be prepared for rendering; nullopt: it could
  std::optional<std::string> scene_fault() const;
  std::optional<Error> agent_error() const;  // the error with which the agent ended; nullopt: none

 private:
  struct Watched;  // the render backend; it records what load_seconds() and scene_fault() return
  explicit LocalFarm(Options options);
  Result<std::unique_ptr<worker::RenderBackend>> make_backend() const;

  Options options_;
  SystemClock clock_;
  std::shared_ptr<coordinator::MemoryBlobs> blobs_ = std::make_shared<coordinator::MemoryBlobs>();
  std::unique_ptr<coordinator::Coordinator> coordinator_;
  LocalBlobFiles files_{blobs_};
  std::unique_ptr<Watched> backend_;
  std::unique_ptr<LocalLink> link_;
  std::unique_ptr<worker::Agent> agent_;
  mutable std::mutex mutex_;
  std::optional<Error> agent_error_;  // guarded by mutex_
  std::jthread thread_;
};

// Runs the render child, the child process in which --isolate renders: `lightshaft --render-child THREADS`.
inline constexpr const char* kRenderChildFlag = "--render-child";
int run_render_child(const char* threads);

}  // namespace ls::cli

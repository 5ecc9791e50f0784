// A whole farm in this process: the coordinator without sockets and one worker agent with all threads.
// `lightshaft render` uses it, and so renders the same pixels as a farm of many machines.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "cli/local/local_files.h"
#include "cli/local/local_link.h"
#include "cli/local/local_scene.h"
#include "coordinator/service/coordinator.h"
#include "coordinator/store/blobs/memory_blobs.h"
#include "worker/agent/agent.h"

namespace ls::cli {

class LocalFarm {
 public:
  struct Options {
    int threads = 1;
    bool isolate = false;  // render in a child process
  };
  static Result<std::unique_ptr<LocalFarm>> open(Options options);
  ~LocalFarm();

  coordinator::Coordinator& coordinator() { return *coordinator_; }
  // Registers a file that a job's spec may refer to by its digest.
  Result<Digest> adopt(const std::filesystem::path& file);
  tl::expected<JobId, coordinator::Rejected> submit(const LocalScene& scene, const JobSpec& spec);

  // Renders the submitted jobs until stop(). `on_result` is called with the result of every finished unit
  // (one tile and range of samples), on the agent's thread. Call once.
  Result<void> start(std::function<void(const UnitResult&)> on_result);
  void stop();

  // What has been observed of the worker.
  double load_seconds() const;
  std::optional<std::string> scene_fault() const;  // why the scene could not be prepared for rendering
  std::optional<Error> agent_error() const;        // the error with which the agent ended

 private:
  struct Watched;  // wraps the render backend and records how it fares
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

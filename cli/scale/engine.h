// The interface between `lightshaft farm up` and an *engine*, which runs its workers: Slurm, ssh, Docker or
// Kubernetes. Whatever can list, start and end instances of one program can be an engine. All runs of
// `lightshaft farm up` under the same name, earlier ones and the current one, form one *farm-up*.
#pragma once

#include <fmt/format.h>

#include <fstream>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "common/base/error.h"

namespace ls::cli {

// A worker from the engine's point of view. A worker that has ended is not listed.
struct EngineWorker {
  enum class State {
    waiting,  // the engine has accepted it and will start it, or start it again
    running,
    stuck,  // the engine will not start it, or not soon
  };
  std::string id;  // the engine's id of the worker; unique among the workers that the engine lists
  State state = State::waiting;
  double seconds = 0;  // time since its last start
  int cores = 1;       // cores that the engine has reserved for it
};

class Engine {
 public:
  explicit Engine(std::string version) : version_(std::move(version)) {}
  virtual ~Engine() = default;
  const std::string& version() const { return version_; }  // of the engine, such as "slurm-wlm 22.05.8"
  // Returns the workers that this farm-up started, now or in an earlier run under the same name. An error
  // means that they are unknown, not that there are none.
  virtual Result<std::vector<EngineWorker>> list() = 0;
  // Starts up to `count` workers. Returns their ids, since a worker may end before it is ever listed. After
  // an error, some may have been started.
  virtual Result<std::vector<std::string>> start(int count) = 0;
  // Asks workers to deliver their results and end. Workers that have not started yet are withdrawn.
  virtual Result<void> drain(std::span<const EngineWorker> workers) = 0;
  virtual Result<void> kill(std::span<const EngineWorker> workers) = 0;

 private:
  const std::string version_;
};

// How a worker is started, by any engine.
struct WorkerCommand {
  std::string farm;         // name of this farm-up; a worker's name is FARM-ID, where ID is the engine's id
  std::string program;      // path of lightshaft-worker on the workers' machines
  std::string coordinator;  // address HOST:PORT under which these machines reach the coordinator
  std::string token_file;   // file that contains the join token
  int threads = 1;
  std::vector<std::string> options;  // more command line options of the worker, one word each
};

// Returns the name under which the coordinator shows the worker.
inline std::string worker_name(const std::string& farm, const std::string& id) { return farm + "-" + id; }

// Returns a new id of a worker in a container: eight random hexadecimal digits.
inline std::string new_worker_id() { return fmt::format("{:08x}", std::random_device{}()); }

// Returns the ids of the workers that run (`running` is true) or that do not run (false); nullopt: the ids of
// all workers.
inline std::vector<std::string> ids_of(std::span<const EngineWorker> workers,
                                       std::optional<bool> running = std::nullopt) {
  std::vector<std::string> ids;
  for (const EngineWorker& w : workers)
    if (!running || *running == (w.state == EngineWorker::State::running)) ids.push_back(w.id);
  return ids;
}

// Writes FOLDER/NAME.log, the log of an ended worker. If that fails, the log is lost; the caller removes the
// worker in any case.
inline void keep_log(const std::string& folder, const std::string& name, const std::string& text) {
  std::ofstream(fmt::format("{}/{}.log", folder, name)) << text;
}

// Returns the first line of a command's output, which names its version or the reason why it failed.
inline std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

}  // namespace ls::cli

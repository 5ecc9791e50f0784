// A RenderBackend that runs the renderer in a child process. If a scene crashes the renderer, hangs it or
// uses up all memory, the worker loses only that unit and continues. The child is this same executable,
// started with other arguments by posix_spawn.
//
// When the child dies, the unit at fault is the one whose thread received the signal or made no progress. The
// units on other threads are rendered again by the next child and do not count as failed. If it is unknown
// which unit was at fault (SIGKILL: the system was out of memory), all running units are reported as failed.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "core/base/error.h"
#include "worker/agent/backend.h"

namespace ls::worker {

inline constexpr int kMostChildThreads = 256;

struct ChildOptions {
  // The child's program. The default is this same program, even if its file was replaced after the start.
  std::filesystem::path executable = "/proc/self/exe";
  // Command line of the child. It must make main() (worker/main.cpp) call serve().
  std::vector<std::string> arguments;
  // Number of units that the child can render at the same time; it must be the number of the caller's render
  // threads.
  int slots = 1;
  Duration hang_limit = std::chrono::minutes(5);      // longest time that a thread may take for one sample
  Duration prepare_limit = std::chrono::minutes(30);  // longest time to make a scene ready to render
  Duration forget_limit = std::chrono::minutes(1);    // longest time to free a scene
  // Pause before a new child is started after one that exited before it was ready. The pause doubles with
  // each further child that does so.
  Duration respawn_pause = std::chrono::seconds(1);
};

// Starts the first child; returns an error if it fails to start.
Result<std::unique_ptr<RenderBackend>> make_child_backend(ChildOptions options);

}  // namespace ls::worker

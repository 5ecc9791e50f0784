// A RenderBackend whose renderer lives in a process of its own, so that a scene which crashes it, hangs it or
// eats all memory costs a unit and not the worker. The child is this same executable, started with other
// arguments by posix_spawn.
//
// When the child dies, the unit at fault is the one whose thread received the signal or made no progress;
// units that other threads held are rendered again by the next child without anybody noticing. If nobody
// knows who it was (SIGKILL: the system was out of memory), all that were being rendered are reported.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "worker/backend.h"

namespace ls::worker {

inline constexpr int kMostChildThreads = 256;

struct ChildOptions {
  // This very program, even if its file has been replaced since it was started.
  std::filesystem::path executable = "/proc/self/exe";
  std::vector<std::string> arguments;                 // that make it serve(): see worker/main.cpp
  int slots = 1;                                      // units rendered at once; the caller's threads
  Duration hang_limit = std::chrono::minutes(5);      // without finishing a sample
  Duration prepare_limit = std::chrono::minutes(30);  // to build one world
  Duration forget_limit = std::chrono::minutes(1);    // to free one
  Duration start_limit = std::chrono::minutes(2);     // until the child says hello (its numeric battery)
  // Before a new child takes the place of one that ended by itself before it was ready; twice as long each
  // time.
  Duration respawn_pause = std::chrono::seconds(1);
};

// Starts the first child; its failure to start is the error.
Result<std::unique_ptr<RenderBackend>> make_child_backend(ChildOptions options);

}  // namespace ls::worker

// Reads scene files in a process of its own, lightshaft-scene, which is shut in by the sandbox of render
// children. Scenes come from strangers: a crash, an endless loop or a hunger for memory costs that one
// submission, and who takes the process over finds no token, job or file of others in it.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "core/base/spawn.h"
#include "core/scene/reading.h"

namespace ls {

struct SceneLimits {
  unsigned seconds = 120;                               // for one scene; a frame of a sequence is one
  std::uint64_t memory_bytes = std::uint64_t{4} << 30;  // of the process
  // Once this is true, scenes are no longer read (unavailable), and processes end. Null: never
  std::shared_ptr<const std::atomic<bool>> stop = nullptr;
};

// Returns readers that each take a process when they read their first scene, and keep it for the next ones,
// such as further frames. No process serves two readers. One process is always ready for the next reader.
// Errors of a reader: invalid_argument (the process crashed, took too long or too much memory, or did not
// answer as it should: the scene is at fault), internal (the program cannot be started), resource_exhausted.
OpenReader scenes_by_processes(std::filesystem::path program = program_beside_us("lightshaft-scene"),
                               SceneLimits limits = {});

}  // namespace ls

// The main functions of the render child. It serves the agent's requests until the agent closes its end of
// the channels.
#pragma once

#include <cstdint>

#include "worker/agent/backend.h"

namespace ls::worker::child {

// Restricts the child process. Call it at the child's start, before any thread is started. It forbids new
// privileges and core files, limits the private writable memory to `memory_limit` bytes (0: no limit), and
// sets the actions for signals. Exactly these file descriptors must be open: standard input, output and
// error, and those of child/protocol.h.
void confine(std::uint64_t memory_limit);

// Serves requests by calling `backend`: those of the control channel on this thread, and those of each render
// channel on a thread of its own (`slots` threads). When the agent is gone, it ends the process and does not
// return. It returns only if it cannot start serving; the result is then the exit code, 1 or 2.
int serve(LocalBackend& backend, int slots);

}  // namespace ls::worker::child

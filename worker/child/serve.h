// The main functions of the render child. It serves the agent's requests until the agent closes its end of
// the channels.
#pragma once

#include <cstdint>

#include "worker/agent/backend.h"

namespace ls::worker::child {

// Restricts the child process. Call it at the child's start, before any thread is started. It forbids new
// privileges and core files, limits the private writable memory to `memory_limit` bytes (0: no limit), and
// sets up the signals. Exactly these file descriptors must be open: standard input, output and error, and
// those of child/protocol.h.
void confine(std::uint64_t memory_limit);

// Serves requests on the control channel and on `slots` render threads, each with its own channel, by calling
// `backend`. Normally it does not return, but exits when the agent is gone; otherwise it returns the exit
// code.
int serve(LocalBackend& backend, int slots);

}  // namespace ls::worker::child

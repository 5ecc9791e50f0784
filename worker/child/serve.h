// The render child's main: serves requests with an in-process backend until the agent closes its end.
#pragma once

#include <cstdint>

#include "worker/agent/backend.h"

namespace ls::worker::child {

// Call at the start of the child, before any thread: sets no new privileges, no core files, the memory limit
// (bytes of private writable memory; 0: none), signals. The file descriptors of child/protocol.h must be open
// and no others.
void confine(std::uint64_t memory_limit);

// Returns the exit code; normally it ends the process itself when the agent is gone.
int serve(LocalBackend& backend, int slots);

}  // namespace ls::worker::child

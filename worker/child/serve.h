// The main functions of the render child, which serves the agent's requests until the agent closes its end of
// the channels.
#pragma once

#include <cstdint>

#include "worker/agent/backend.h"

namespace ls::worker::child {

// Restricts the child process; call it at the child's start, before any thread. It forbids new privileges and
// core files, limits the private writable memory to `memory_limit` bytes (0: no limit), and sets up the
// signals. Of the file descriptors above those of standard input, output and error, those of child/protocol.h
// must be open and no others.
void confine(std::uint64_t memory_limit);

// Serves requests on the control channel and on `slots` render threads, each with a channel of its own, by
// calling `backend`. Normally it does not return, but ends the process when the agent is gone; otherwise it
// returns the exit code.
int serve(LocalBackend& backend, int slots);

}  // namespace ls::worker::child

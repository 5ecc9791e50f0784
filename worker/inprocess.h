// A backend that renders in this process. The render child uses it to serve the agent's requests
// (worker/child), and `lightshaft render` uses it directly.
#pragma once

#include <memory>

#include "worker/agent/backend.h"

namespace ls::worker {

// `threads` is the number of threads that build a world (a scene ready to render). Units are rendered on the
// threads that call render().
std::unique_ptr<LocalBackend> make_inprocess_backend(int threads);

}  // namespace ls::worker

// A backend that renders in this process: served by the render child, and used directly by `lightshaft
// render`.
#pragma once

#include <memory>

#include "worker/agent/backend.h"

namespace ls::worker {

// `threads`: for building worlds; units are rendered on the caller's threads.
std::unique_ptr<LocalBackend> make_inprocess_backend(int threads);

}  // namespace ls::worker

// A backend over the renderer in this very process: what the render child serves, and what `lightshaft
// render` uses directly.
#pragma once

#include <memory>

#include "worker/backend.h"

namespace ls::worker {

// `threads`: for building worlds; units are rendered on the caller's threads.
std::unique_ptr<LocalBackend> make_inprocess_backend(int threads);

}  // namespace ls::worker

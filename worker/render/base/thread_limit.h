// Bounds the threads that libraries start while a world is built (TBB under Embree and OpenVDB). Embree's own
// setting does not bound them.
#pragma once

#include <memory>

namespace ls::render {

// Active while the returned object lives; of several limits the tightest applies.
std::shared_ptr<void> limit_threads(int threads);

}  // namespace ls::render

// Bounds the threads that libraries start while a world is built (TBB under Embree and OpenVDB). Embree's own
// setting does not bound them.
#pragma once

#include <memory>

namespace ls::render {

// Limits those libraries to `threads` threads in this process for as long as the returned object lives. If
// several such objects live, the lowest limit applies.
std::shared_ptr<void> limit_threads(int threads);

}  // namespace ls::render

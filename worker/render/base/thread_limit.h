// Limits the threads that TBB, the library under Embree and OpenVDB, starts while a world is built. Embree's
// own setting does not limit them.
#pragma once

#include <memory>

namespace ls::render {

// Limits TBB to `threads` threads in this process as long as the returned object lives. If several such
// objects live, the lowest limit applies.
std::shared_ptr<void> limit_threads(int threads);

}  // namespace ls::render

// Bounds the threads that libraries start by themselves while a world is built (TBB under Embree and
// OpenVDB): Embree's own setting does not reach them.
#pragma once

#include <memory>

namespace ls::render {

// Holds for as long as the returned object lives; the tightest of several limits counts.
std::shared_ptr<void> limit_threads(int threads);

}  // namespace ls::render

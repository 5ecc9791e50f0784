// Lets a thread abandon the world that it builds.
#pragma once

#include <atomic>

#include "core/base/error.h"

namespace ls::render {

// While a BuildStop lives, builds of worlds by its thread fail soon with Errc::unavailable if `stop` becomes
// true.
class BuildStop {
 public:
  explicit BuildStop(const std::atomic<bool>& stop);
  ~BuildStop();
  BuildStop(const BuildStop&) = delete;
  BuildStop& operator=(const BuildStop&) = delete;

  // The flag of the BuildStop of the calling thread; null: there is none
  static const std::atomic<bool>* flag();
  // Fails with Errc::unavailable if the build should stop. Builds ask it between their parts.
  static Result<void> go_on();
};

}  // namespace ls::render

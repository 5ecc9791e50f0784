#include "worker/render/base/thread_limit.h"

#include <tbb/global_control.h>

#include <algorithm>

namespace ls::render {

std::shared_ptr<void> limit_threads(int threads) {
  const auto most = static_cast<std::size_t>(std::max(1, threads));
  return std::make_shared<tbb::global_control>(tbb::global_control::max_allowed_parallelism, most);
}

}  // namespace ls::render

// Runs work on several threads and uses the results in a fixed order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <future>
#include <type_traits>
#include <vector>

namespace ls::render {

// Computes make(0), make(1), ..., make(count - 1) on up to `threads` threads, and passes the results to
// take(), one by one and in this order, until take() returns false. So the calls of take() do not depend on
// the number of threads. When take() returns false, further results that are already computed are dropped.
// make() must be thread-safe.
template <class Make, class Take>
void in_order(int threads, std::size_t count, const Make& make, Take take) {
  const auto wave = static_cast<std::size_t>(std::max(1, threads));
  for (std::size_t first = 0; first < count; first += wave) {
    std::vector<std::future<std::invoke_result_t<const Make&, std::size_t>>> others;
    for (std::size_t i = first + 1; i < std::min(first + wave, count); ++i)
      others.push_back(
          std::async(std::launch::async | std::launch::deferred, [&make, i] { return make(i); }));
    if (!take(make(first))) return;
    for (auto& other : others)
      if (!take(other.get())) return;
  }
}

}  // namespace ls::render

// Work on several threads.
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace ls::test {

// Calls work(0), ..., work(count - 1) on several threads, and throws what one of them threw.
template <class Work>
void on_threads(int threads, std::size_t count, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr thrown;
  std::vector<std::jthread> pool;
  for (int i = 0; i < threads; ++i)
    pool.emplace_back([&] {
      try {
        for (std::size_t n; (n = next++) < count;) work(n);
      } catch (...) {
        const std::lock_guard lock(mutex);
        thrown = std::current_exception();
        next = count;
      }
    });
  pool.clear();
  if (thrown) std::rethrow_exception(thrown);
}

}  // namespace ls::test

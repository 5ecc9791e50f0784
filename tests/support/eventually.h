// Waits for a condition that another thread will make true.
#pragma once

#include <chrono>
#include <thread>

namespace ls::test {

// Returns true once `condition()` holds, or false if it does not within two minutes, so that a test cannot
// hang.
template <class Condition>
bool eventually(Condition condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::yield();
  }
  return true;
}

}  // namespace ls::test

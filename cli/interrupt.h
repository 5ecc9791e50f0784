// Ctrl-C and SIGTERM while something runs: the first asks for an end, the second ends the process as it would
// have.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

namespace ls::cli {

// Make it before any other thread, so that they inherit the blocked signals.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  // `stop` is called once, on a thread of its own, at the first signal. Call once.
  void on_signal(std::function<void()> stop);
  bool happened() const { return happened_; }

 private:
  std::atomic<bool> happened_{false};
  std::jthread thread_;
};

}  // namespace ls::cli

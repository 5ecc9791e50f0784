// Handles Ctrl-C and SIGTERM during a long operation: the first signal requests a stop, the second ends the
// process.
#pragma once

#include <functional>
#include <string>
#include <thread>

namespace ls::cli {

// The constructor blocks these signals for the calling thread. An Interrupt must be created before any other
// thread, because a thread inherits blocked signals only when it starts.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  // Calls `stop` once, on a separate thread, at the first signal. on_signal() may be called only once.
  void on_signal(std::function<void()> stop);

 private:
  std::jthread thread_;
};

// While it lives, prints `words` if Ctrl-C or SIGTERM ends the program. Like an Interrupt it must be created
// before any other thread.
class LastWords {
 public:
  explicit LastWords(std::string words);
  ~LastWords();
  LastWords(const LastWords&) = delete;
  LastWords& operator=(const LastWords&) = delete;

 private:
  std::jthread thread_;
};

}  // namespace ls::cli

#include "cli/output/interrupt.h"

#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <utility>

#include "cli/output/console.h"

namespace ls::cli {
namespace {

// Returns the signals to wait for, including SIGUSR1, which wakes the waiting thread when the Interrupt is
// destroyed.
sigset_t watched() {
  sigset_t set;
  sigemptyset(&set);
  for (const int s : {SIGINT, SIGTERM, SIGUSR1}) sigaddset(&set, s);
  return set;
}

void die_of(int signal) {
  ::signal(signal, SIG_DFL);
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, signal);
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
  ::raise(signal);
}

}  // namespace

Interrupt::Interrupt() {
  const sigset_t set = watched();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

void Interrupt::on_signal(std::function<void()> stop) {
  thread_ = std::jthread([stop = std::move(stop)] {
    const sigset_t set = watched();
    int signal = 0;
    bool stopping = false;
    while (sigwait(&set, &signal) == 0 && signal != SIGUSR1) {
      if (std::exchange(stopping, true)) die_of(signal);
      print_note("lightshaft: stopping; once more ends at once");
      stop();
    }
  });
}

Interrupt::~Interrupt() {
  if (thread_.joinable()) pthread_kill(thread_.native_handle(), SIGUSR1);
}

LastWords::LastWords(std::string words) {
  const sigset_t set = watched();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  thread_ = std::jthread([words = std::move(words)] {
    const sigset_t set = watched();
    int signal = 0;
    if (sigwait(&set, &signal) != 0 || signal == SIGUSR1) return;
    if (::isatty(STDERR_FILENO) == 1) fmt::print(stderr, "\n");
    print_note(words);
    die_of(signal);
  });
}

LastWords::~LastWords() {
  pthread_kill(thread_.native_handle(), SIGUSR1);
  thread_.join();
  const sigset_t set = watched();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

}  // namespace ls::cli

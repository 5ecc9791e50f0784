// One render child process, from spawn to exit.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "worker/child/child.h"
#include "worker/child/protocol.h"

namespace ls::worker::child {

class Process {
 public:
  static Result<std::shared_ptr<Process>> spawn(const ChildOptions& options);
  ~Process();  // kills it
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  struct Answer {
    Reply reply;
    std::string text;
  };
  // Sends a request and waits for the answer, calling `watch` about every 50 ms, which may kill(). nullopt:
  // the child died, or sent a malformed answer and was killed.
  std::optional<Answer> ask(int fd, Request request, const std::string& text, const Watch& watch);

  void kill();
  // How the process ended. Waits for its end, which must be imminent; kill() works meanwhile.
  struct End {
    std::optional<int> signal;
    int exit_code = 0;
    std::string text;
  };
  End end();
  bool alive();
  std::uint64_t rss_bytes() const;

  int control_fd() const { return control_; }
  int slot_fd(int slot) const { return slot_fds_[static_cast<std::size_t>(slot)]; }
  Slot& slot(int index) { return slots_[index]; }
  int slots() const { return static_cast<int>(slot_fds_.size()); }
  bool some_slot_crashed() const;

  std::atomic<int> hung_slot{-1};      // the slot for whose lack of progress the watchdog killed it
  std::atomic<bool> garbled{false};    // it was killed because of a malformed answer
  std::atomic<bool> preparing{false};  // a world is being built
  std::mutex prepared_mutex;
  std::set<std::uint64_t> prepared;  // jobs whose worlds it has; guarded by prepared_mutex

 private:
  Process() = default;
  std::optional<Answer> exchange(int fd, const Request& request, const std::string& text, const Watch& watch);
  Result<void> start(const ChildOptions& options, const std::vector<int>& theirs);

  pid_t pid_ = -1;
  int control_ = -1;
  std::vector<int> slot_fds_;
  Slot* slots_ = nullptr;
  std::size_t memory_bytes_ = 0;
  std::mutex reap_mutex_;
  std::optional<End> end_;  // guarded by reap_mutex_
};

}  // namespace ls::worker::child

// The agent's handle of one render child process (see child.h), from spawn to exit.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "common/base/spawn.h"
#include "worker/child/child.h"
#include "worker/child/protocol.h"

namespace ls::worker::child {

class Process {
 public:
  static Result<std::shared_ptr<Process>> spawn(const ChildOptions& options);
  ~Process();  // kills the process and waits for its end
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  struct Answer {
    Reply reply;
    std::string text;
  };
  // Sends a request, followed by `text`, to the child on the channel `fd` and waits for the answer. While it
  // waits, it calls `watch` about every 50 ms; `watch` may call kill(). Returns nullopt if the child died, or
  // if it gave a malformed answer, for which it is killed.
  std::optional<Answer> ask(int fd, Request request, const std::string& text, const Watch& watch);

  void kill();
  // Waits for the end of the process, which must be imminent, and returns how it ended. kill() may be called
  // meanwhile.
  struct End {
    std::optional<int> signal;
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

  // Number of the slot (render thread) without progress, for which the agent killed the child; -1: none
  std::atomic<int> hung_slot{-1};
  std::atomic<bool> garbled{false};  // true if the child was killed for a malformed answer
  // True while the child builds a scene. If the child dies meanwhile, it stays true.
  std::atomic<bool> preparing{false};
  std::mutex prepared_mutex;
  // Numbers of the jobs whose scenes the child has built; guarded by prepared_mutex.
  std::set<std::uint64_t> prepared;

 private:
  Process() = default;
  std::optional<Answer> exchange(int fd, const Request& request, const std::string& text, const Watch& watch);
  Result<void> start(const ChildOptions& options, const std::list<Descriptor>& theirs);

  pid_t pid_ = -1;
  int control_ = -1;
  std::vector<int> slot_fds_;
  Slot* slots_ = nullptr;
  std::size_t memory_bytes_ = 0;
  std::mutex reap_mutex_;
  std::optional<End> end_;  // guarded by reap_mutex_
};

}  // namespace ls::worker::child

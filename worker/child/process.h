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
#include <thread>
#include <vector>

#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/base/program_output.h"
#include "core/base/spawn.h"
#include "worker/child/child.h"
#include "worker/child/protocol.h"

namespace ls::worker::child {

class Process {
 public:
  // `lines`: how many lines the child may still write to our log
  static Result<std::shared_ptr<Process>> spawn(const ChildOptions& options, LineBudget& lines);
  ~Process();  // kills the process and waits for its end
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  struct Answer {
    Reply reply;
    std::string text;
  };
  // Sends a request, followed by `text`, to the child on the channel of a slot, or on the control channel
  // (kControl), and waits for the answer. While it waits, it calls `watch` about every 50 ms; `watch` may
  // call kill() or condemn(). Returns nullopt if the child died. A child that gives a malformed answer, or
  // closes the channel and lives on, is condemned for it.
  static constexpr int kControl = -1;
  std::optional<Answer> ask(int slot, Request request, const std::string& text, const Watch& watch);

  // Why the agent killed the child
  enum class Fault { hung, answered_nonsense, closed_its_channel };
  struct Condemned {
    int slot;  // whose unit is at fault; kControl: none
    Fault fault;
  };
  // Kills the child because of what one slot did. Only the first call counts.
  void condemn(int slot, Fault fault);
  std::optional<Condemned> condemned();
  void kill();  // also kills all processes that the child has started
  // Waits for the end of the process, which must be imminent, and returns how it ended. kill() may be called
  // meanwhile.
  struct End {
    std::optional<int> signal;
    std::string text;
  };
  End end();
  bool alive();
  std::uint64_t rss_bytes() const;

  Slot& slot(int index) { return shared_->slots()[index]; }
  std::atomic<bool>& stop_build() { return shared_->stop_build; }
  int slots() const { return static_cast<int>(slot_fds_.size()); }
  bool some_slot_crashed() const;

  std::atomic<int> rendering{0};  // number of slots that are waiting for a unit's answer
  // True while the child builds a scene. If the child dies meanwhile, it stays true.
  std::atomic<bool> preparing{false};
  std::mutex prepared_mutex;
  // Numbers of the jobs whose scenes the child has built; guarded by prepared_mutex.
  std::set<std::uint64_t> prepared;

 private:
  Process() = default;
  std::optional<Answer> exchange(int slot, const Request& request, const std::string& text,
                                 const Watch& watch);
  Result<void> share_memory(int slots, std::list<Descriptor>& theirs);
  Result<void> start(const ChildOptions& options, const std::list<Descriptor>& theirs, LineBudget& lines);
  bool ends_soon();

  pid_t pid_ = -1;
  int control_ = -1;
  std::vector<int> slot_fds_;
  Shared* shared_ = nullptr;
  std::size_t shared_bytes_ = 0;
  std::unique_ptr<ProgramOutput> output_;
  std::jthread log_thread_;
  std::mutex reap_mutex_;
  std::optional<End> end_;              // guarded by reap_mutex_
  std::optional<Condemned> condemned_;  // guarded by reap_mutex_
};

}  // namespace ls::worker::child

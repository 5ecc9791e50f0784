#include "worker/child/serve.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <thread>
#include <vector>

#include "worker/child/protocol.h"

namespace ls::worker::child {
namespace {

constexpr std::size_t kAltStackBytes = 64 << 10;

thread_local Slot* t_slot = nullptr;  // slot of this render thread, used by the signal handler

// Marks the slot of the crashing thread, then dies of the same signal (SA_RESETHAND has restored the default
// action).
extern "C" void on_fatal_signal(int signal) {
  if (t_slot) t_slot->crashed.store(true, std::memory_order_relaxed);
  ::raise(signal);
}

void watch_fatal_signals() {
  struct sigaction action {};
  action.sa_handler = on_fatal_signal;
  action.sa_flags = SA_RESETHAND | SA_ONSTACK | SA_NODEFER;
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) ::sigaction(signal, &action, nullptr);
}

// A separate stack on which the signal handler runs, because the thread's own stack may have overflowed.
struct AltStack {
  AltStack() : memory(kAltStackBytes) {
    stack_t stack{};
    stack.ss_sp = memory.data();
    stack.ss_size = memory.size();
    ::sigaltstack(&stack, nullptr);
  }
  ~AltStack() {
    stack_t off{};
    off.ss_flags = SS_DISABLE;
    ::sigaltstack(&off, nullptr);
  }
  std::vector<char> memory;
};

class Server {
 public:
  Server(LocalBackend& backend, Shared& shared)
      : backend_(backend), stop_build_(shared.stop_build), slots_(shared.slots()) {}

  void control_loop() {
    Request request;
    std::string text;
    while (receive_all(kControlFd, &request, sizeof request)) {
      if (request.text_bytes > kTextBytes) break;
      text.resize(request.text_bytes);
      if (!receive_all(kControlFd, text.data(), text.size())) break;
      Reply reply;
      std::string reason = guarded(reply, [&] { return control(request, text, reply); });
      if (!answer(kControlFd, reply, reason)) break;
    }
    ::_exit(0);  // the agent is gone: exit without waiting for render threads in the middle of a sample
  }

  void render_loop(int index) {
    const AltStack stack;
    t_slot = &slots_[index];
    Request request;
    while (receive_all(kFirstSlotFd + index, &request, sizeof request)) {
      Reply reply;
      const std::string reason = guarded(reply, [&] { return render(request, *t_slot, reply); });
      if (!answer(kFirstSlotFd + index, reply, reason)) return;
    }
  }

 private:
  // Calls `run` and returns the text that it returns, for the reply. If `run` throws, sets the reply's
  // outcome and returns the reason.
  template <class Run>
  static std::string guarded(Reply& reply, Run run) {
    try {
      return run();
    } catch (const std::bad_alloc&) {
      reply.outcome = Outcome::out_of_memory;
      return "the renderer ran out of its memory limit";
    } catch (const std::exception& e) {
      reply.outcome = Outcome::failed;
      return std::string("the renderer failed: ") + e.what();
    }
  }

  static bool answer(int fd, Reply& reply, const std::string& reason) {
    reply.text_bytes = static_cast<std::uint32_t>(std::min(reason.size(), kReasonBytes));
    return send_all(fd, &reply, sizeof reply) && send_all(fd, reason.data(), reply.text_bytes);
  }

  static std::string refused(Reply& reply, const UnitFailure& failure) {
    reply.outcome = failure.scene_at_fault ? Outcome::scene_at_fault : Outcome::failed;
    return failure.reason;
  }

  std::string control(const Request& request, const std::string& text, Reply& reply) {
    if (request.kind == Kind::hello) {
      reply.numeric_class = backend_.numeric_class();
      return backend_.platform();
    } else if (request.kind == Kind::prepare) {
      auto job = from_text(text);
      if (!job) return refused(reply, UnitFailure{.reason = job.error().message});
      if (auto ok = backend_.prepare(*job, stop_build_); !ok) {
        if (!stop_build_) return refused(reply, ok.error());
        reply.outcome = Outcome::stopped;
        return {};
      }
      const std::lock_guard lock(mutex_);
      jobs_[request.job] = std::make_shared<const LocalJob>(std::move(*job));
    } else if (request.kind == Kind::forget) {
      std::shared_ptr<const LocalJob> job;
      {
        const std::lock_guard lock(mutex_);
        if (const auto node = jobs_.extract(request.job)) job = node.mapped();
      }
      if (job) backend_.forget(job->brief.job);
    }
    return {};
  }

  std::string render(const Request& request, Slot& slot, Reply& reply) {
    std::shared_ptr<const LocalJob> job;
    {
      const std::lock_guard lock(mutex_);
      const auto it = jobs_.find(request.job);
      if (it != jobs_.end()) job = it->second;
    }
    if (!job) return refused(reply, UnitFailure{.reason = "the render child does not know this job"});
    const LeaseUnit unit{request.tile, request.round, request.rect, request.samples};
    auto rendered = backend_.render_marked(*job, unit, slot.stop, &slot.where);
    if (slot.stop) {
      reply.outcome = Outcome::stopped;
      return {};
    }
    if (!rendered) return refused(reply, rendered.error());
    const std::vector<float>& sums = rendered->partial.sums;
    if (sums.size() > kSlotFloats) return refused(reply, UnitFailure{.reason = "the tile is too large"});
    std::copy(sums.begin(), sums.end(), slot.sums);
    reply.cpu_seconds = rendered->cpu_seconds;
    reply.wall_seconds = rendered->wall_seconds;
    reply.techniques = rendered->techniques.bits();
    return rendered->health.clean() ? "" : canonical_json(rendered->health);
  }

  LocalBackend& backend_;
  const std::atomic<bool>& stop_build_;
  Slot* slots_;
  std::mutex mutex_;
  std::map<std::uint64_t, std::shared_ptr<const LocalJob>> jobs_;
};

}  // namespace

void confine(std::uint64_t memory_limit) {
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  // Without this, the process would be named "exe", because it was started by /proc/self/exe.
  ::prctl(PR_SET_NAME, "ls-render-child");
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  // The child ignores these signals, which whoever ends a service may send to all of its processes: only the
  // agent should react. It ends the child when it no longer needs it.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) ::signal(signal, SIG_IGN);
#if !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)  // sanitizers reserve more memory than any limit allows
  if (memory_limit > 0) {
    const rlimit data{memory_limit, memory_limit};
    ::setrlimit(RLIMIT_DATA, &data);
  }
#else
  (void)memory_limit;
#endif
  watch_fatal_signals();
}

int serve(LocalBackend& backend, int slots) {
  if (slots < 1 || slots > kMostSlots) return 2;
  void* memory =
      ::mmap(nullptr, Shared::bytes(slots), PROT_READ | PROT_WRITE, MAP_SHARED, kSharedMemoryFd, 0);
  if (memory == MAP_FAILED) return 1;
  Server server(backend, *static_cast<Shared*>(memory));
  std::vector<std::jthread> threads;
  for (int i = 0; i < slots; ++i) threads.emplace_back([&server, i] { server.render_loop(i); });
  const AltStack stack;
  server.control_loop();
  return 0;
}

}  // namespace ls::worker::child

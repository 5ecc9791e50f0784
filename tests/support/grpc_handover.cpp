// Tells ThreadSanitizer of the points where gRPC hands work from one thread to another. Debian's gRPC is not
// compiled for ThreadSanitizer, which therefore sees none of gRPC's own synchronisation and reports a race
// for every object that passes through it.
//
// The functions below replace those of the library that start an operation or schedule a reaction; each calls
// the library's. They state what gRPC promises and no more, so a race of our own code stays a race:
//   - what a thread did before it started an operation happens before the operation's completion runs;
//   - OnDone runs after every other reaction of its call, OnCancel after the call's handler;
//   - a server is destroyed after the last reaction of its calls;
//   - operations may be started before a reactor is bound to its call: gRPC's headers keep them under a
//   mutex.
// TSAN_OPTIONS=ignore_noninstrumented_modules=1 silences what the library itself allocates and frees. Linked
// into tests built with -fsanitize=thread only.
#include <absl/synchronization/mutex.h>
#include <dlfcn.h>
#include <grpc/grpc.h>
#include <grpcpp/support/client_callback.h>
#include <grpcpp/support/server_callback.h>
#include <link.h>
#include <sanitizer/tsan_interface.h>

#include <array>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

// Code that must not synchronise by itself: locks and atomics visible to ThreadSanitizer would order
// everything that passes through here, and hide races.
#define UNSEEN __attribute__((no_sanitize("thread")))

extern "C" const char __executable_start, etext;  // first and last address of this program's code

namespace {

using Completion = void (*)(grpc_completion_queue_functor*, int);

template <class Function>
Function library(const char* name) {
  void* found = dlsym(RTLD_NEXT, name);
  if (!found) {
    std::fprintf(stderr, "tests/support/grpc_handover.cpp: this gRPC has no %s; adapt the file to it\n",
                 name);
    std::abort();
  }
  return reinterpret_cast<Function>(found);
}

// A completion is a functor of gRPC's headers, of which there are a few kinds. The function of each kind is
// replaced by a separate trampoline, so that no table of objects is needed.
constexpr std::size_t kKinds = 16;
Completion kinds[kKinds];
bool kinds_locked = false;

template <std::size_t kind>
void complete(grpc_completion_queue_functor* functor, int ok) {
  __tsan_acquire(functor);
  kinds[kind](functor, ok);
}
template <std::size_t... kind>
constexpr std::array<Completion, kKinds> trampolines(std::index_sequence<kind...>) {
  return {complete<kind>...};
}
constexpr std::array<Completion, kKinds> kTrampolines = trampolines(std::make_index_sequence<kKinds>());

UNSEEN Completion trampoline_of(Completion run) {
  for (const Completion each : kTrampolines)
    if (each == run) return run;
  while (__atomic_test_and_set(&kinds_locked, __ATOMIC_ACQUIRE)) {
  }
  std::size_t kind = 0;
  while (kind < kKinds && kinds[kind] && kinds[kind] != run) ++kind;
  if (kind == kKinds) std::abort();
  kinds[kind] = run;
  __atomic_clear(&kinds_locked, __ATOMIC_RELEASE);
  return kTrampolines[kind];
}

// The tag of an operation is either a functor, which begins with the address of a function (if its completion
// queue uses callbacks), or an object with a vtable, which begins with an address of data. Returns 2 for an
// address of code, 1 for one of data, 0 for one outside of all modules.
UNSEEN int find_code(dl_phdr_info* module, std::size_t, void* address) {
  for (int i = 0; i < module->dlpi_phnum; ++i) {
    const auto& part = module->dlpi_phdr[i];
    const auto start = module->dlpi_addr + part.p_vaddr;
    const auto at = reinterpret_cast<std::uintptr_t>(address);
    if (part.p_type == PT_LOAD && at >= start && at < start + part.p_memsz)
      return part.p_flags & PF_X ? 2 : 1;
  }
  return 0;
}
UNSEEN void started(void* tag) {
  if (!tag) return;
  auto* functor = static_cast<grpc_completion_queue_functor*>(tag);
  if (dl_iterate_phdr(find_code, reinterpret_cast<void*>(functor->functor_run)) == 2)
    functor->functor_run = trampoline_of(functor->functor_run);
  __tsan_release(tag);
}

// Runs reactions in order on a separate thread, whose queue ThreadSanitizer sees. It cannot see the library's
// own executor, which would run them otherwise.
class Reactions {
 public:
  void run(std::function<void()> reaction) {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(reaction));
    changed_.notify_one();
  }

 private:
  void work(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [this] { return !waiting_.empty(); })) {
      const auto reaction = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      reaction();
      __tsan_release(this);
      lock.lock();
    }
  }
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<std::function<void()>> waiting_;
  std::jthread thread_{[this](const std::stop_token& stop) { work(stop); }};
};
Reactions& reactions() {
  static auto* one = new Reactions;  // never destroyed, since reactions may come while the process ends
  return *one;
}

// The library's use of its own mutexes stays invisible: it is not part of gRPC's promises, and would order
// too much.
UNSEEN bool is_in_this_program(const void* address) {
  return address >= &__executable_start && address < &etext;
}

struct Reached : grpc::internal::ServerCallbackCall {
  static constexpr auto kRef = &Reached::Ref;
};

}  // namespace

// The library makes its own object for the next call without an operation, on the thread that received the
// previous call, and ends it after OnDone. ThreadSanitizer sees no order in this, so its report is
// suppressed.
extern "C" const char* __tsan_default_suppressions() {
  return "race:CallbackCallTag::ContinueRunAfterInterception()::{lambda\n";
}

extern "C" {

grpc_call_error grpc_call_start_batch(grpc_call* call, const grpc_op* ops, size_t count, void* tag,
                                      void* reserved) {
  static const auto next = library<decltype(&grpc_call_start_batch)>("grpc_call_start_batch");
  started(tag);
  return next(call, ops, count, tag, reserved);
}

grpc_event grpc_completion_queue_pluck(grpc_completion_queue* queue, void* tag, gpr_timespec deadline,
                                       void* reserved) {
  static const auto next = library<decltype(&grpc_completion_queue_pluck)>("grpc_completion_queue_pluck");
  const grpc_event event = next(queue, tag, deadline, reserved);
  __tsan_acquire(tag);
  return event;
}

void grpc_server_destroy(grpc_server* server) {
  static const auto next = library<decltype(&grpc_server_destroy)>("grpc_server_destroy");
  __tsan_acquire(&reactions());
  next(server);
}

}  // extern "C"

namespace grpc::internal {

// The number of outstanding reactions is an atomic that the library decrements invisibly. Here an
// instrumented operation adds two references and removes one. So everything that the other reactions did
// before they decremented the number happens before OnDone. The remaining reference is never counted again.
void ServerCallbackCall::ScheduleOnDone(bool) {
  static const auto next =
      library<void (*)(ServerCallbackCall*, bool)>("_ZN4grpc8internal18ServerCallbackCall14ScheduleOnDoneEb");
  (this->*Reached::kRef)();
  (this->*Reached::kRef)();
  MaybeDone();
  reactions().run([this] { next(this, true); });
}

void ServerCallbackCall::CallOnCancel(ServerReactor* reactor) {
  (this->*Reached::kRef)();
  reactions().run([this, reactor] {
    reactor->OnCancel();
    MaybeDone();
  });
}

void ClientReactor::InternalScheduleOnDone(grpc::Status status) {
  reactions().run([this, status = std::move(status)] { OnDone(status); });
}

}  // namespace grpc::internal

namespace absl {
ABSL_NAMESPACE_BEGIN

void Mutex::Lock() {
  static const auto next = library<void (*)(Mutex*)>("_ZN4absl7debian35Mutex4LockEv");
  next(this);
  if (is_in_this_program(__builtin_return_address(0))) __tsan_acquire(this);
}

void Mutex::Unlock() {
  static const auto next = library<void (*)(Mutex*)>("_ZN4absl7debian35Mutex6UnlockEv");
  if (is_in_this_program(__builtin_return_address(0))) __tsan_release(this);
  next(this);
}

ABSL_NAMESPACE_END
}  // namespace absl

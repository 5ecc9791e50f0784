#include "util/sandbox/call_filter.h"

#include <asm/ioctls.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/sched.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

namespace ls {
namespace {

// The allowed system calls, by what needs them. A call is listed only if the process itself is all that it
// can affect, or what it opens is restricted otherwise (Landlock in sandbox.cpp). Old calls that arm64 does
// not have are in the groups of x86-64: the C library still makes some of them there.
constexpr std::uint32_t kAllowed[] = {
    // Memory: malloc, thread stacks, the dynamic loader, Embree's and TBB's pools, OpenVDB's mapped files.
    // mbind and similar calls move memory between nodes and are not needed.
    SYS_mmap,
    SYS_munmap,
    SYS_mremap,
    SYS_mprotect,
    SYS_brk,
    SYS_get_mempolicy,
    // Threads and locks: C library, TBB. The call clone has a rule of its own below.
    SYS_futex,
    SYS_set_robust_list,
    SYS_get_robust_list,
    SYS_set_tid_address,
    SYS_rseq,
    SYS_restart_syscall,
    SYS_sched_yield,
    SYS_sched_getaffinity,
    SYS_sched_getparam,
    SYS_sched_getscheduler,
    SYS_sched_get_priority_max,
    SYS_sched_get_priority_min,
    SYS_getcpu,
    // Signals: handlers, masks and waiting; timers that signal this process only. The call tgkill has a rule
    // of its own below.
    SYS_rt_sigaction,
    SYS_rt_sigprocmask,
    SYS_rt_sigreturn,
    SYS_rt_sigsuspend,
    SYS_rt_sigtimedwait,
    SYS_rt_sigpending,
    SYS_sigaltstack,
    SYS_setitimer,
    SYS_getitimer,
    // Time
    SYS_clock_gettime,
    SYS_clock_getres,
    SYS_clock_nanosleep,
    SYS_nanosleep,
    SYS_gettimeofday,
    // Files: reading what Landlock permits, and reading and writing open descriptors. ftruncate needs a
    // descriptor that is open for writing, of which the process has only those of memory that it has made
    // itself or that is sealed. The call openat has a rule of its own below.
    SYS_close,
    SYS_close_range,
    SYS_read,
    SYS_readv,
    SYS_pread64,
    SYS_preadv,
    SYS_write,
    SYS_writev,
    SYS_pwrite64,
    SYS_pwritev,
    SYS_lseek,
    SYS_fstat,
    SYS_newfstatat,
    SYS_statx,
    SYS_statfs,
    SYS_fstatfs,
    SYS_faccessat,
    SYS_faccessat2,
    SYS_readlinkat,
    SYS_getdents64,
    SYS_getcwd,
    SYS_fadvise64,
    SYS_dup,
    SYS_dup3,
    SYS_pipe2,
    SYS_ppoll,
    SYS_pselect6,
    SYS_memfd_create,
    SYS_ftruncate,
    // The channels to the agent: socket pairs that the process has inherited. Without sendmsg and recvmsg no
    // descriptor goes through them.
    SYS_sendto,
    SYS_recvfrom,
    // Processes: lightshaft-vdb is started with posix_spawn. setsid and setpgid are not among them, so that
    // the
    // agent can end all processes that the renderer has started.
    SYS_execve,
    SYS_wait4,
    SYS_waitid,
    SYS_exit,
    SYS_exit_group,
    // Facts about this process and the machine
    SYS_getpid,
    SYS_getppid,
    SYS_getsid,
    SYS_gettid,
    SYS_getuid,
    SYS_geteuid,
    SYS_getgid,
    SYS_getegid,
    SYS_getrusage,
    SYS_times,
    SYS_uname,
    SYS_sysinfo,
    SYS_getrandom,
    // Restrictions that a descendant puts on itself besides
    SYS_seccomp,
    SYS_capget,
    SYS_capset,
    SYS_landlock_create_ruleset,
    SYS_landlock_add_rule,
    SYS_landlock_restrict_self,
#ifdef __x86_64__
    SYS_arch_prctl,  // the C library sets the register of thread-local variables with it
    SYS_access,
    SYS_stat,
    SYS_lstat,
    SYS_readlink,
    SYS_dup2,
    SYS_pipe,
    SYS_poll,
    SYS_select,
    SYS_vfork,  // has no flags: the same as clone without any
    SYS_time,
    SYS_alarm,
    SYS_pause,
    SYS_getrlimit,
#endif
};

// A rule for a system call whose permission depends on one argument. The filter looks only at the lower 32
// bits of the argument, since the kernel ignores its upper 32 bits for these calls, or has no flags there. A
// call with a rule is not in kAllowed and has one rule only.
struct Decided {
  enum class How { one_of, none_of, without_bits };
  std::uint32_t call;
  unsigned argument;
  How how;
  // one_of, none_of: the call is allowed if the argument is, or is not, one of these. without_bits: one
  // value, of whose bits the argument may have none.
  std::vector<std::uint32_t> values;
};

constexpr std::uint32_t kNamespaces =
    CLONE_NEWNS | CLONE_NEWCGROUP | CLONE_NEWUTS | CLONE_NEWIPC | CLONE_NEWUSER | CLONE_NEWPID | CLONE_NEWNET;
// PR_SCHED_CORE (since Linux 5.14) may name another process. All other options concern the caller.
constexpr std::uint32_t kPrSchedCore = 62;
// Protects the end of a stack; since Linux 6.13, and used by the C library since 2.42.
constexpr std::uint32_t kMadvGuardInstall = 102, kMadvGuardRemove = 103;

std::vector<Decided> decided() {
  using enum Decided::How;
  // O_RDONLY | O_TRUNC cuts a file short that may only be read; Landlock prevents this since Linux 6.2 only.
  const std::vector<std::uint32_t> cuts{O_TRUNC};
  return {
      {SYS_openat, 2, without_bits, cuts},
#ifdef __x86_64__
      {SYS_open, 1, without_bits, cuts},
#endif
      // With CLONE_PARENT the new process would be a child of the agent, which does not wait for it.
      {SYS_clone, 0, without_bits, {kNamespaces | CLONE_PARENT | CLONE_PTRACE}},
      // raise() and abort() send signals to a thread of this process.
      {SYS_tgkill, 0, one_of, {static_cast<std::uint32_t>(::getpid())}},
      {SYS_prlimit64, 0, one_of, {0}},
      {SYS_sched_setaffinity, 0, one_of, {0}},
      {SYS_prctl, 0, none_of, {kPrSchedCore}},
      // Other commands lock files, or make the kernel send signals to a chosen process when a descriptor
      // becomes ready.
      {SYS_fcntl,
       1,
       one_of,
       {F_DUPFD, F_DUPFD_CLOEXEC, F_GETFD, F_SETFD, F_GETFL, F_SETFL, F_ADD_SEALS, F_GET_SEALS}},
      // Is it a terminal, how much can be read: the standard libraries ask this. Other requests type into a
      // terminal, redirect the console, or change what is behind a descriptor.
      {SYS_ioctl, 1, one_of, {TCGETS, FIONREAD}},
      // MADV_HWPOISON, for one, makes shared memory unreadable for the agent too.
      {SYS_madvise,
       2,
       one_of,
       {MADV_NORMAL, MADV_RANDOM, MADV_SEQUENTIAL, MADV_WILLNEED, MADV_DONTNEED, MADV_FREE, MADV_DONTFORK,
        MADV_DOFORK, MADV_HUGEPAGE, MADV_NOHUGEPAGE, MADV_DONTDUMP, MADV_DODUMP, MADV_COLD, MADV_PAGEOUT,
        MADV_POPULATE_READ, MADV_POPULATE_WRITE, kMadvGuardInstall, kMadvGuardRemove}},
  };
}

// On x86-64 each system call has a second number, its own plus kX32, in the x32 ABI (32-bit pointers). The
// filter denies all of these.
constexpr std::uint32_t kX32 = 0x40000000;
// The newest system call that was considered for the list (mseal, Linux 6.10; the same number everywhere)
constexpr std::uint32_t kNewest = 462;
#ifdef __x86_64__
constexpr std::uint32_t kPlatform = AUDIT_ARCH_X86_64;
#else
constexpr std::uint32_t kPlatform = AUDIT_ARCH_AARCH64;
#endif

constexpr std::uint32_t kAllow = SECCOMP_RET_ALLOW, kDeny = SECCOMP_RET_ERRNO | EPERM,
                        kUnknown = SECCOMP_RET_ERRNO | ENOSYS;

using Filter = std::vector<sock_filter>;

void load(std::size_t offset, Filter& filter) {
  filter.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset)));
}
void answer(std::uint32_t result, Filter& filter) { filter.push_back(BPF_STMT(BPF_RET | BPF_K, result)); }
// Appends a comparison of the loaded word with `value`, and the number of instructions to skip if it holds
// (`then`) and if it does not (`otherwise`).
void compare(std::uint16_t how, std::uint32_t value, std::size_t then, std::size_t otherwise,
             Filter& filter) {
  filter.push_back(BPF_JUMP(static_cast<std::uint16_t>(BPF_JMP | how | BPF_K), value,
                            static_cast<std::uint8_t>(then), static_cast<std::uint8_t>(otherwise)));
}

// Appends one rule. Before it, the number of the system call is loaded. If it is not the rule's call, the
// filter goes on after the rule with the number still loaded. Otherwise the argument decides.
void add(const Decided& rule, Filter& filter) {
  const std::size_t n = rule.values.size();
  compare(BPF_JEQ, rule.call, 0, n + 3, filter);
  load(offsetof(seccomp_data, args) + rule.argument * sizeof(std::uint64_t), filter);
  const bool bits = rule.how == Decided::How::without_bits;
  for (std::size_t i = 0; i < n; ++i) compare(bits ? BPF_JSET : BPF_JEQ, rule.values[i], n - i, 0, filter);
  const bool listed = rule.how == Decided::How::one_of;
  answer(listed ? kDeny : kAllow, filter);
  answer(listed ? kAllow : kDeny, filter);
}

Filter filter_of_calls() {
  constexpr std::size_t kCount = std::size(kAllowed);
  static_assert(kCount < 250, "jumps of a filter have 8 bits");
  Filter filter;
  load(offsetof(seccomp_data, arch), filter);
  compare(BPF_JEQ, kPlatform, 1, 0, filter);
  answer(SECCOMP_RET_KILL_PROCESS, filter);
  load(offsetof(seccomp_data, nr), filter);
  compare(BPF_JGE, kX32, 0, 1, filter);
  answer(kDeny, filter);
  // The flags of clone3 are in memory, where a filter cannot read them. ENOSYS makes the C library use clone.
  compare(BPF_JEQ, SYS_clone3, 1, 0, filter);
  compare(BPF_JGT, kNewest, 0, 1, filter);
  answer(kUnknown, filter);
  for (std::size_t i = 0; i < kCount; ++i)
    compare(BPF_JEQ, kAllowed[i], kCount - 1 - i, i + 1 < kCount ? 0 : 1, filter);
  answer(kAllow, filter);
  for (const Decided& rule : decided()) add(rule, filter);
  answer(kDeny, filter);
  return filter;
}

Filter filter_of_starts() {
  constexpr std::uint32_t kStarts[] = {
      SYS_clone, SYS_clone3, SYS_execve, SYS_execveat,
#ifdef __x86_64__
      SYS_fork,  SYS_vfork,
#endif
  };
  Filter filter;
  load(offsetof(seccomp_data, nr), filter);
  for (std::size_t i = 0; i < std::size(kStarts); ++i)
    compare(BPF_JEQ, kStarts[i], std::size(kStarts) - i, 0, filter);
  answer(kAllow, filter);
  answer(kDeny, filter);
  return filter;
}

Filter filter_of_children() {
  Filter filter;
  load(offsetof(seccomp_data, nr), filter);
#ifdef __x86_64__
  compare(BPF_JEQ, SYS_fork, 1, 0, filter);
  compare(BPF_JEQ, SYS_vfork, 0, 1, filter);
  answer(kDeny, filter);
#endif
  compare(BPF_JEQ, SYS_clone3, 0, 1, filter);
  answer(kUnknown, filter);  // as in filter_of_calls()
  // With PR_SET_PDEATHSIG the process would outlive the one that has started it.
  add({SYS_prctl, 0, Decided::How::none_of, {PR_SET_PDEATHSIG}}, filter);
  compare(BPF_JEQ, SYS_clone, 1, 0, filter);
  answer(kAllow, filter);
  load(offsetof(seccomp_data, args), filter);
  compare(BPF_JSET, CLONE_THREAD, 0, 1, filter);
  answer(kAllow, filter);
  answer(kDeny, filter);
  return filter;
}

bool install(Filter filter) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  (void)filter;
  return false;  // sanitizers use ptrace, and write files anywhere
#else
  const sock_fprog whole{static_cast<unsigned short>(filter.size()), filter.data()};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &whole, 0, 0) == 0;
#endif
}

}  // namespace

bool limit_calls() { return install(filter_of_calls()); }

bool forbid_processes() { return install(filter_of_starts()); }

bool forbid_children() { return install(filter_of_children()); }

}  // namespace ls

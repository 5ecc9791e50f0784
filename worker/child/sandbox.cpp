#include "worker/child/sandbox.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/sched.h>
#include <linux/seccomp.h>
#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <system_error>
#include <vector>

#include "common/base/spawn.h"

namespace ls::worker::child {
namespace {

// The first part of this file restricts system calls by a seccomp filter. kDeny is the filter's result for a
// denied call: the call fails with EPERM.
constexpr std::uint32_t kDeny = SECCOMP_RET_ERRNO | EPERM;
// Numbers of the system calls that are always denied. io_uring is among them because it can open sockets
// without the call `socket`.
constexpr std::uint32_t kDenied[] = {
    SYS_socket,
    SYS_ptrace,
    SYS_process_vm_readv,
    SYS_process_vm_writev,
    SYS_io_uring_setup,
    SYS_unshare,
    SYS_setns,
    SYS_mount,
    SYS_umount2,
    SYS_pivot_root,
    SYS_chroot,
    SYS_bpf,
    SYS_userfaultfd,
    SYS_perf_event_open,
    SYS_keyctl,
    SYS_add_key,
    SYS_request_key,
    SYS_init_module,
    SYS_finit_module,
    SYS_delete_module,
    SYS_kexec_load,
    SYS_kexec_file_load,
    SYS_reboot,
    SYS_swapon,
    SYS_swapoff,
    SYS_open_by_handle_at,
    SYS_pidfd_getfd,
    SYS_settimeofday,
    SYS_clock_settime,
    SYS_acct,
    SYS_quotactl,
    // Calls that affect the agent and other processes of its user: signals, scheduling, memory.
    SYS_kill,
    SYS_tkill,
    SYS_rt_sigqueueinfo,
    SYS_rt_tgsigqueueinfo,
    SYS_pidfd_open,
    SYS_pidfd_send_signal,
    SYS_setpriority,
    SYS_ioprio_set,
    SYS_sched_setparam,
    SYS_sched_setscheduler,
    SYS_sched_setattr,
    SYS_migrate_pages,
    SYS_move_pages,
    SYS_process_madvise,
    SYS_kcmp,
    // Calls that make objects that outlive the process and are not counted in its memory limit.
    SYS_shmget,
    SYS_shmat,
    SYS_semget,
    SYS_msgget,
    SYS_mq_open,
};
// On x86-64 each system call has a second number, its own plus kX32, in the x32 ABI (32-bit pointers). The
// filter denies all of these.
constexpr std::uint32_t kX32 = 0x40000000;
#ifdef __x86_64__
constexpr std::uint32_t kPlatform = AUDIT_ARCH_X86_64;
#else
constexpr std::uint32_t kPlatform = AUDIT_ARCH_AARCH64;
#endif

// A rule for a system call whose permission depends on the value of one argument. The filter compares only
// the lower 32 bits of the argument, since the kernel ignores its upper 32 bits for the calls in decided().
// Each call has at most one rule.
struct Decided {
  std::uint32_t call;
  unsigned argument;
  bool allowed;  // true: allowed only with one of `values`; false: denied with one of `values`, else allowed
  std::vector<std::uint32_t> values;
};
std::vector<Decided> decided() {
  // tgkill may send signals to this process only: raise() and abort() need that.
  return {{SYS_tgkill, 0, true, {static_cast<std::uint32_t>(::getpid())}},
          {SYS_prlimit64, 0, true, {0}},
          {SYS_sched_setaffinity, 0, true, {0}},
          // These commands are denied, because with them the kernel would send signals to a chosen process
          // when a descriptor becomes ready.
          {SYS_fcntl, 1, false, {F_SETOWN, F_SETOWN_EX, F_SETSIG}},
          {SYS_ioctl, 1, false, {FIOSETOWN, SIOCSPGRP}}};
}

// Appends one rule to the filter program. Before the rule, the accumulator contains the number of the system
// call. If it is not the rule's call, the program continues after the rule, with the accumulator unchanged.
// Otherwise the argument decides, and the program ends.
void put(const Decided& d, std::vector<sock_filter>& program) {
  const auto n = static_cast<std::uint8_t>(d.values.size());
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, d.call, 0, static_cast<std::uint8_t>(n + 3)));
  const auto lower_half =
      static_cast<std::uint32_t>(offsetof(seccomp_data, args) + d.argument * sizeof(std::uint64_t));
  program.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, lower_half));
  for (std::uint8_t i = 0; i < n; ++i)
    program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, d.values[i], static_cast<std::uint8_t>(n - i), 0));
  program.push_back(BPF_STMT(BPF_RET | BPF_K, d.allowed ? kDeny : SECCOMP_RET_ALLOW));
  program.push_back(BPF_STMT(BPF_RET | BPF_K, d.allowed ? SECCOMP_RET_ALLOW : kDeny));
}

// Flags of clone that make new namespaces
constexpr std::uint32_t kNamespaces =
    CLONE_NEWNS | CLONE_NEWCGROUP | CLONE_NEWUTS | CLONE_NEWIPC | CLONE_NEWUSER | CLONE_NEWPID | CLONE_NEWNET;

bool filter_calls() {
  constexpr std::size_t kCount = std::size(kDenied);
  static_assert(kCount < 200, "jumps of a filter have 8 bits");
  std::vector<sock_filter> program;
  const auto put = [&](sock_filter failpoint) { program.push_back(failpoint); };
  put(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch)));
  put(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kPlatform, 1, 0));
  put(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS));
  put(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)));
  put(BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, kX32, static_cast<std::uint8_t>(kCount), 0));
  for (std::size_t i = 0; i < kCount; ++i)
    put(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kDenied[i], static_cast<std::uint8_t>(kCount - 1 - i),
                 static_cast<std::uint8_t>(i + 1 < kCount ? 0 : 1)));
  put(BPF_STMT(BPF_RET | BPF_K, kDeny));
  // The flags of clone3 are in memory, where a filter cannot read them. ENOSYS makes the C library use clone
  // instead, of which the filter denies the flags of namespaces.
  put(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_clone3, 0, 1));
  put(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOSYS));
  put(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_clone, 0, 4));
  put(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, args)));
  put(BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, kNamespaces, 0, 1));
  put(BPF_STMT(BPF_RET | BPF_K, kDeny));
  put(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  for (const Decided& d : decided()) child::put(d, program);
  put(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  const sock_fprog whole{static_cast<unsigned short>(program.size()), program.data()};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &whole, 0, 0) == 0;
}

// The rest of this file restricts access to files by Landlock. kRead and kWrite are access rights of its ABI
// 1 (Linux 5.13); later ABIs have more.
constexpr std::uint64_t kRead = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr std::uint64_t kWrite = LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_REMOVE_DIR |
                                 LANDLOCK_ACCESS_FS_REMOVE_FILE | LANDLOCK_ACCESS_FS_MAKE_CHAR |
                                 LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_MAKE_REG |
                                 LANDLOCK_ACCESS_FS_MAKE_SOCK | LANDLOCK_ACCESS_FS_MAKE_FIFO |
                                 LANDLOCK_ACCESS_FS_MAKE_BLOCK | LANDLOCK_ACCESS_FS_MAKE_SYM;
// The right to truncate files; since ABI 3 (Linux 6.2)
constexpr std::uint64_t kTruncate = std::uint64_t{1} << 14;
constexpr std::uint64_t kFileRights =  // rights that apply to files; the rest apply to folders
    LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_EXECUTE | kTruncate;

// Adds a rule that allows `rights` for the file `path`, or for everything in the folder `path`. A path that
// does not exist needs no rule, so the result is then true.
bool allow(int rules, const std::filesystem::path& path, std::uint64_t rights) {
  const Descriptor place{::open(path.c_str(), O_PATH | O_CLOEXEC)};
  struct stat info {};
  if (place.fd < 0 || ::fstat(place.fd, &info) != 0) return true;
  if (!S_ISDIR(info.st_mode)) rights &= kFileRights;
  const landlock_path_beneath_attr rule{rights, place.fd};
  return ::syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0;
}

// The kernel's landlock_ruleset_attr, including fields that are newer than the kernel headers of the build.
struct Ruleset {
  std::uint64_t files = 0;    // file rights that are denied unless a rule allows them; since ABI 1
  std::uint64_t network = 0;  // the same for network rights; always 0 here; since ABI 4
  std::uint64_t scoped = 0;   // actions limited to processes in the sandbox; since ABI 6
};
// A bit of Ruleset::scoped: the process can send signals only to processes within the sandbox. This also
// holds for signals that the kernel sends on its behalf (fcntl with F_SETOWN).
constexpr std::uint64_t kScopeSignal = 2;

bool bound_files(const std::vector<std::filesystem::path>& readable, long abi) {
  if (abi < 1) return false;
  Ruleset attr;
  attr.files = kRead | kWrite | LANDLOCK_ACCESS_FS_EXECUTE | (abi >= 3 ? kTruncate : 0);
  attr.scoped = abi >= 6 ? kScopeSignal : 0;
  const std::size_t known = abi >= 6 ? sizeof attr : sizeof attr.files;
  const Descriptor rules{static_cast<int>(::syscall(SYS_landlock_create_ruleset, &attr, known, 0))};
  if (rules.fd < 0) return false;
  bool done = true;
  std::error_code error;
  const auto own = std::filesystem::read_symlink("/proc/self/exe", error);
  constexpr std::uint64_t kRun = kRead | LANDLOCK_ACCESS_FS_EXECUTE;
  for (const char* folder : {"/usr", "/lib", "/lib64"}) done &= allow(rules.fd, folder, kRun);
  // This program and the OpenVDB reader beside it are allowed, but not the folder that contains them.
  done &= allow(rules.fd, own, kRun);
  done &= allow(rules.fd, own.parent_path() / "lightshaft-vdb", kRun);
  // The dynamic loader and the thread library read these files and folders. Nothing in /proc about other
  // processes is among them.
  for (const char* path : {"/etc/ld.so.cache", "/etc/ld.so.preload", "/sys", "/proc/self", "/proc/cpuinfo",
                           "/proc/meminfo", "/proc/sys/vm", "/dev/urandom", "/dev/random"})
    done &= allow(rules.fd, path, kRead);
  done &= allow(rules.fd, "/dev/null", kRead | LANDLOCK_ACCESS_FS_WRITE_FILE);
  for (const auto& folder : readable) done &= allow(rules.fd, folder, kRead);
  return done && ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         ::syscall(SYS_landlock_restrict_self, rules.fd, 0) == 0;
}

}  // namespace

Sandboxed enter_sandbox(const std::vector<std::filesystem::path>& readable) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  (void)readable;
  // Builds with sanitizers have no sandbox: sanitizers use ptrace and may write files anywhere.
  (void)filter_calls;
  (void)bound_files;
  return {};
#else
  const long abi = ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  // bound_files() is called before filter_calls(), so that the filter need not allow the system calls that
  // bound_files() makes.
  const bool files = bound_files(readable, abi);
  return {filter_calls(), files, files && abi >= 3};
#endif
}

}  // namespace ls::worker::child

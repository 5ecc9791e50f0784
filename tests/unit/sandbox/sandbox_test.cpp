// What a process in the sandbox can still do. Each attempt is made in a new process, as the user of the test
// and, if that is root, as a user without rights too.
#include "util/sandbox/sandbox.h"

#include <fcntl.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <linux/landlock.h>
#include <linux/sched.h>
#include <linux/sockios.h>
#include <poll.h>
#include <sched.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/ipc.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/msg.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/sem.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/timex.h>
#include <sys/wait.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "util/sandbox/call_filter.h"

namespace ls {
namespace {

constexpr int kNotSandboxed = 200;

constexpr uid_t kNobody = 65534;

enum class As { test, nobody };

class Cage : public testing::TestWithParam<As> {
 protected:
  void SetUp() override {
    if (GetParam() == As::nobody && ::geteuid() != 0) GTEST_SKIP() << "only root can become another user";
    std::string name = (std::filesystem::temp_directory_path() / "lightshaft-cage-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    root_ = name;
    std::filesystem::create_directories(root_ / "cache/sub");
    std::ofstream(root_ / "cache/sub/asset") << "asset";
    std::ofstream(root_ / "secret") << "secret";
    if (GetParam() == As::test) return;
    for (const char* file : {"", "cache", "cache/sub", "cache/sub/asset", "secret"})
      ASSERT_EQ(::chown((root_ / file).c_str(), kNobody, kNobody), 0);
  }
  void TearDown() override {
    if (!root_.empty()) std::filesystem::remove_all(root_);
  }

  static bool become() {
    return GetParam() == As::test ||
           (::setgroups(0, nullptr) == 0 && ::setgid(kNobody) == 0 && ::setuid(kNobody) == 0);
  }
  // Returns 0 if `attempt` returned 0 in a sandboxed process, otherwise its errno; kNotSandboxed if the
  // sandbox lacks `needs`. `before` is called before the process enters the sandbox.
  int try_sandboxed(const std::function<int()>& attempt, bool Sandboxed::*needs,
                    const std::function<void()>& before = {}) const {
    const pid_t pid = ::fork();
    if (pid == 0) {
      if (before) before();
      if (!become()) ::_exit(kNotSandboxed);
      const Sandboxed sandboxed = enter_sandbox({root_ / "cache"});
      if (!(sandboxed.*needs)) ::_exit(kNotSandboxed);
      ::_exit(attempt() == 0 ? 0 : errno);
    }
    int status = 0;
    ::waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  // The same for a call that gives -1 if it fails.
  int try_call(const std::function<long()>& call) const {
    return try_sandboxed([&] { return call() == -1 ? 1 : 0; }, &Sandboxed::calls);
  }
  int try_open(const std::filesystem::path& path, int flags) const {
    return try_sandboxed([&] { return ::open(path.c_str(), flags, 0600) >= 0 ? 0 : 1; }, &Sandboxed::files);
  }

  std::filesystem::path root_;
};

// Returns the version of the kernel's Landlock; less than 1: it has none.
[[maybe_unused]] long landlock() {
  return ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
}

// Returns the reason for which the sandbox may lack `needs` here; empty: there is none, and the test must
// fail.
std::string why_uncaged(bool Sandboxed::*needs) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  (void)needs;
  return "sanitizers trace, and write where they are told: they leave it out";
#else
  if (needs == &Sandboxed::files && landlock() < 1)
    return "this kernel has no Landlock (Linux 5.13, switched on)";
  return "";
#endif
}

#define SKIP_UNCAGED(code, needs)                                                      \
  if (code == kNotSandboxed) {                                                         \
    if (const std::string why = why_uncaged(needs); !why.empty()) GTEST_SKIP() << why; \
    FAIL() << "nothing is caged, and the kernel is no reason";                         \
  }

TEST_P(Cage, CanReadOnlyAssetsAndLibraries) {
  const int asset = try_open(root_ / "cache/sub/asset", O_RDONLY);
  SKIP_UNCAGED(asset, &Sandboxed::files);
  EXPECT_EQ(asset, 0);
  EXPECT_EQ(try_open(root_ / "secret", O_RDONLY), EACCES);
  EXPECT_EQ(try_open(root_ / "cache/../secret", O_RDONLY), EACCES);
  EXPECT_EQ(try_open("/etc/passwd", O_RDONLY), EACCES);
  EXPECT_EQ(try_open("/proc/1/environ", O_RDONLY), EACCES);
  EXPECT_EQ(try_open("/proc/self/status", O_RDONLY), 0);
}

TEST_P(Cage, CannotWriteFiles) {
  const int made = try_open(root_ / "cache/new", O_WRONLY | O_CREAT);
  SKIP_UNCAGED(made, &Sandboxed::files);
  EXPECT_EQ(made, EACCES);
  EXPECT_EQ(try_open(root_ / "cache/sub/asset", O_WRONLY), EACCES);
  EXPECT_EQ(try_open("/tmp/lightshaft-cage-test", O_WRONLY | O_CREAT), EACCES);
  EXPECT_EQ(try_open("/dev/null", O_RDWR), 0);
  EXPECT_EQ(try_call([&] { return ::unlink((root_ / "cache/sub/asset").c_str()); }), EPERM);
}

TEST_P(Cage, CannotMoveOrLinkFiles) {
  const auto asset = root_ / "cache/sub/asset", beside = root_ / "cache/sub/other", out = root_ / "out";
  const int moved = try_call([&] { return ::rename(asset.c_str(), beside.c_str()); });
  SKIP_UNCAGED(moved, &Sandboxed::calls);
  EXPECT_EQ(moved, EPERM);
  EXPECT_EQ(try_call([&] { return ::rename(asset.c_str(), out.c_str()); }), EPERM);
  EXPECT_EQ(try_call([&] { return ::link(asset.c_str(), out.c_str()); }), EPERM);
  EXPECT_EQ(try_call([&] { return ::symlink(asset.c_str(), beside.c_str()); }), EPERM);
  EXPECT_TRUE(std::filesystem::exists(asset));
}

TEST_P(Cage, CannotTruncateFiles) {
  const auto asset = root_ / "cache/sub/asset";
  const int cut = try_call([&] { return ::truncate(asset.c_str(), 0); });
  SKIP_UNCAGED(cut, &Sandboxed::calls);
  EXPECT_EQ(cut, EPERM);
  EXPECT_EQ(try_call([&] { return ::open(asset.c_str(), O_RDONLY | O_TRUNC); }), EPERM);
#ifdef SYS_open
  EXPECT_EQ(try_call([&] { return ::syscall(SYS_open, asset.c_str(), O_RDONLY | O_TRUNC, 0); }), EPERM);
#endif
  EXPECT_EQ(std::filesystem::file_size(asset), 5u);
}

TEST_P(Cage, CannotChangeModeOwnerTimeOrAttributes) {
  const auto asset = root_ / "cache/sub/asset";
  const char* const file = asset.c_str();
  const auto opened = [&] { return ::open(file, O_RDONLY); };
  const timespec times[2]{};
  constexpr int kFchmodat2 = 452;
  const std::vector<std::function<long()>> calls = {
      [&] { return ::chmod(file, 0777); },
      [&] { return ::fchmod(opened(), 0777); },
      [&] { return ::syscall(SYS_fchmodat, AT_FDCWD, file, 0777); },
      [&] { return ::syscall(kFchmodat2, AT_FDCWD, file, 0777, 0); },
      [&] { return ::chown(file, ::getuid(), ::getgid()); },
      [&] { return ::lchown(file, ::getuid(), ::getgid()); },
      [&] { return ::fchown(opened(), ::getuid(), ::getgid()); },
      [&] { return ::fchownat(AT_FDCWD, file, ::getuid(), ::getgid(), 0); },
      [&] { return ::utimensat(AT_FDCWD, file, times, 0); },
      [&] { return ::futimens(opened(), times); },
      [&] { return ::utimes(file, nullptr); },
      [&] { return ::setxattr(file, "user.a", "b", 1, 0); },
      [&] { return ::fsetxattr(opened(), "user.a", "b", 1, 0); },
      [&] { return ::removexattr(file, "user.a"); },
      [&] { return ::mkdir((root_ / "made").c_str(), 0700); },
      [&] { return ::mknod((root_ / "made").c_str(), S_IFIFO | 0600, 0); },
  };
  const int first = try_call(calls.front());
  SKIP_UNCAGED(first, &Sandboxed::calls);
  for (std::size_t i = 0; i < calls.size(); ++i) EXPECT_EQ(try_call(calls[i]), EPERM) << "call " << i;
}

TEST_P(Cage, CannotLockFiles) {
  const auto asset = root_ / "cache/sub/asset";
  const auto opened = [&] { return ::open(asset.c_str(), O_RDONLY); };
  const int locked = try_call([&] { return ::flock(opened(), LOCK_EX | LOCK_NB); });
  SKIP_UNCAGED(locked, &Sandboxed::calls);
  EXPECT_EQ(locked, EPERM);
  const struct flock readers { .l_type = F_RDLCK, .l_whence = SEEK_SET };
  EXPECT_EQ(try_call([&] { return ::fcntl(opened(), F_SETLK, &readers); }), EPERM);
  EXPECT_EQ(try_call([&] { return ::fcntl(opened(), F_OFD_SETLK, &readers); }), EPERM);
  EXPECT_EQ(try_call([&] { return ::fcntl(opened(), F_SETLEASE, F_RDLCK); }), EPERM);
}

TEST_P(Cage, CannotTypeIntoATerminal) {
  const int master = ::posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_GE(master, 0);
  ASSERT_EQ(::grantpt(master), 0);
  ASSERT_EQ(::unlockpt(master), 0);
  const int terminal = ::open(::ptsname(master), O_RDWR | O_NOCTTY);
  ASSERT_GE(terminal, 0);
  const auto own_terminal = [&] {
    ::setsid();
    ::ioctl(terminal, TIOCSCTTY, 0);
  };
  const auto request = [&](unsigned long what) {
    char letter = 'x';
    return try_sandboxed([&] { return ::ioctl(terminal, what, &letter); }, &Sandboxed::calls, own_terminal);
  };
  const int typed = request(TIOCSTI);
  SKIP_UNCAGED(typed, &Sandboxed::calls);
  EXPECT_EQ(typed, EPERM);
  for (const unsigned long what : {TIOCLINUX, TIOCCONS, TIOCSETD, TIOCSTI, TIOCNOTTY, TIOCSPGRP, TCSETS})
    EXPECT_EQ(request(what), EPERM) << what;
  EXPECT_EQ(try_sandboxed([&] { return ::isatty(terminal) ? 0 : 1; }, &Sandboxed::calls), 0);
  pollfd readable{terminal, POLLIN, 0};
  EXPECT_EQ(::poll(&readable, 1, 0), 0) << "something was typed";
  ::close(terminal), ::close(master);
}

TEST_P(Cage, HasNoRootRights) {
  const auto capabilities = [] {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("Cap") && line.find_first_not_of("0\t", line.find(':') + 1) != std::string::npos)
        return errno = EISCONN, 1;  // any number that is no answer of the kernel
    return 0;
  };
  const int none = try_sandboxed(capabilities, &Sandboxed::calls);
  SKIP_UNCAGED(none, &Sandboxed::calls);
  // A user without rights keeps the bounding set, which gives nothing to a process that cannot gain rights.
  if (GetParam() == As::test && ::geteuid() == 0) {
    EXPECT_EQ(none, 0);
  }
  constexpr int kFsOpen = 430, kOpenTree = 428, kMoveMount = 429, kFsMount = 432, kFsPick = 433,
                kMountSetattr = 442;
  char name[] = "taken";
  timex nothing{};
  void* const page = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  const std::vector<std::function<long()>> calls = {
      [&] { return ::sethostname(name, sizeof name); },
      [&] { return ::setdomainname(name, sizeof name); },
      [&] { return ::adjtimex(&nothing); },
      [&] { return ::clock_adjtime(CLOCK_REALTIME, &nothing); },
      [&] { return ::syscall(kFsOpen, "tmpfs", 0); },
      [&] { return ::syscall(kFsMount, -1, 0, 0); },
      [&] { return ::syscall(kFsPick, AT_FDCWD, "/", 0); },
      [&] { return ::syscall(kOpenTree, AT_FDCWD, "/", 0); },
      [&] { return ::syscall(kMoveMount, -1, "", -1, "", 0); },
      [&] { return ::syscall(kMountSetattr, AT_FDCWD, "/", 0, nullptr, 0); },
      [&] { return ::mount("none", "/mnt", "tmpfs", 0, nullptr); },
      [&] { return ::syscall(SYS_fanotify_init, 0, 0); },
      [&] { return ::syscall(SYS_inotify_init1, 0); },
      [&] { return ::syscall(SYS_syslog, 10, nullptr, 0); },
      [&] { return ::syscall(SYS_personality, 0x0040000); },
      [&] { return ::syscall(SYS_bpf, 0, nullptr, 0); },
      [&] { return ::syscall(SYS_userfaultfd, 0); },
      [&] { return ::syscall(SYS_setuid, 0); },
      [&] { return ::syscall(SYS_setgid, 0); },
      [&] { return ::madvise(page, 4096, MADV_HWPOISON); },
  };
  for (std::size_t i = 0; i < calls.size(); ++i) EXPECT_EQ(try_call(calls[i]), EPERM) << "call " << i;
}

TEST_P(Cage, DeniesUnknownNewSystemCalls) {
  constexpr long kOfTheFuture = 1000;
  const int code = try_call([] { return ::syscall(kOfTheFuture); });
  SKIP_UNCAGED(code, &Sandboxed::calls);
  EXPECT_EQ(code, ENOSYS);
}

TEST_P(Cage, CannotOpenSocketsOrTraceProcesses) {
  const int tcp =
      try_sandboxed([] { return ::socket(AF_INET, SOCK_STREAM, 0) >= 0 ? 0 : 1; }, &Sandboxed::calls);
  SKIP_UNCAGED(tcp, &Sandboxed::calls);
  EXPECT_EQ(tcp, EPERM);
  for (const int family : {AF_INET6, AF_UNIX, AF_NETLINK})
    EXPECT_EQ(try_sandboxed([=] { return ::socket(family, SOCK_DGRAM, 0) >= 0 ? 0 : 1; }, &Sandboxed::calls),
              EPERM);
  EXPECT_EQ(try_sandboxed([] { return ::ptrace(PTRACE_ATTACH, ::getppid(), 0, 0) == 0 ? 0 : 1; },
                          &Sandboxed::calls),
            EPERM);
}

TEST_P(Cage, CannotMakeNamespaces) {
  const auto cloned = [](long made) {
    if (made == 0) ::_exit(0);  // the new process
    return made > 0 ? 0 : 1;
  };
  const auto clone_with = [&](unsigned long flags) {
    return try_sandboxed([&] { return cloned(::syscall(SYS_clone, flags | SIGCHLD, 0, 0, 0, 0)); },
                         &Sandboxed::calls);
  };
  const int user = clone_with(CLONE_NEWUSER);
  SKIP_UNCAGED(user, &Sandboxed::calls);
  EXPECT_EQ(user, EPERM);
  EXPECT_EQ(clone_with(CLONE_NEWUSER | CLONE_NEWNET), EPERM);
  EXPECT_EQ(clone_with(CLONE_NEWPID), EPERM);
  EXPECT_EQ(clone_with(CLONE_PARENT), EPERM) << "the agent would have another child";
  EXPECT_EQ(clone_with(0), 0) << "processes without namespaces of their own may be started";
  clone_args args{};
  args.flags = CLONE_NEWUSER;
  args.exit_signal = SIGCHLD;
  EXPECT_EQ(
      try_sandboxed([&] { return cloned(::syscall(SYS_clone3, &args, sizeof args)); }, &Sandboxed::calls),
      ENOSYS);
  EXPECT_EQ(try_sandboxed([] { return ::unshare(CLONE_NEWUSER); }, &Sandboxed::calls), EPERM);
  EXPECT_EQ(try_sandboxed([] { return std::thread([] {}).join(), 0; }, &Sandboxed::calls), 0);
}

// Starts a process that ends at once. Returns its id, or -1.
std::function<long()> clone_with(unsigned long flags) {
  return [flags] {
    const long made = ::syscall(SYS_clone, flags, 0, 0, 0, 0);
    if (made == 0) ::_exit(0);
    return made;
  };
}

// Turns this process into one that ends at once. Returns only if that fails: -1.
long become_another_program() {
  char name[] = "/bin/true";
  char* arguments[] = {name, nullptr};
  return ::execve(name, arguments, nullptr);
}

TEST_P(Cage, CannotStartProcessesOnceForbidden) {
  const auto tried = [&](const std::function<long()>& start) {
    return try_sandboxed([&] { return forbid_processes() && start() < 0 ? 1 : 0; }, &Sandboxed::calls);
  };

  const int process = tried(clone_with(SIGCHLD));
  SKIP_UNCAGED(process, &Sandboxed::calls);

  EXPECT_EQ(process, EPERM);
  EXPECT_EQ(tried(clone_with(CLONE_VM | CLONE_VFORK | SIGCHLD)), EPERM) << "as posix_spawn does";
  EXPECT_EQ(tried(become_another_program), EPERM);
  EXPECT_EQ(tried([] { return 0; }), 0);
}

TEST_P(Cage, CannotStartChildrenOnceForbidden) {
  const auto tried = [&](const std::function<long()>& start) {
    return try_sandboxed([&] { return forbid_children() && start() < 0 ? 1 : 0; }, &Sandboxed::calls);
  };

  const int process = tried(clone_with(SIGCHLD));
  SKIP_UNCAGED(process, &Sandboxed::calls);

  EXPECT_EQ(process, EPERM);
  EXPECT_EQ(tried(clone_with(CLONE_VM | CLONE_VFORK | SIGCHLD)), EPERM) << "as posix_spawn does";
#ifdef __x86_64__
  EXPECT_EQ(tried([] { return ::syscall(SYS_fork); }), EPERM);
  EXPECT_EQ(tried([] { return ::syscall(SYS_vfork); }), EPERM);
#endif
  EXPECT_EQ(tried([] { return std::thread([] {}).join(), 0; }), 0);
  EXPECT_EQ(tried([] { return ::prctl(PR_SET_PDEATHSIG, 0); }), EPERM) << "it ends with what has started it";
  EXPECT_EQ(tried(become_another_program), 0);
}

TEST_P(Cage, CannotSignalOtherProcesses) {
  const int agent = try_sandboxed([] { return ::kill(::getppid(), 0); }, &Sandboxed::calls);
  SKIP_UNCAGED(agent, &Sandboxed::calls);
  EXPECT_EQ(agent, EPERM);
  const auto denied = [&](const std::function<long()>& call) {
    return try_sandboxed([&] { return call() == -1 ? 1 : 0; }, &Sandboxed::calls) == EPERM;
  };
  EXPECT_TRUE(denied([] { return ::setsid(); })) << "the agent ends the processes of its child's session";
  EXPECT_TRUE(denied([] { return ::setpgid(0, 0); }));
  siginfo_t info{};
  EXPECT_TRUE(denied([] { return ::syscall(SYS_tkill, ::getppid(), 0); }));
  EXPECT_TRUE(denied([] { return ::syscall(SYS_tgkill, ::getppid(), ::getppid(), 0); }));
  EXPECT_TRUE(denied([&] { return ::syscall(SYS_rt_sigqueueinfo, ::getppid(), SIGTERM, &info); }));
  EXPECT_TRUE(denied([] { return ::syscall(SYS_pidfd_open, ::getppid(), 0); }));
  // Signals that the kernel would send for this process when a pipe becomes ready.
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  EXPECT_TRUE(denied([&] { return ::fcntl(ends[0], F_SETOWN, ::getppid()); }));
  EXPECT_TRUE(denied([&] { return ::fcntl(ends[0], F_SETSIG, SIGTERM); }));
  int owner = ::getpid();
  EXPECT_TRUE(denied([&] { return ::ioctl(ends[0], FIOSETOWN, &owner); }));
  EXPECT_FALSE(denied([&] { return ::fcntl(ends[0], F_SETFL, O_NONBLOCK); }));
  for (const int end : ends) ::close(end);
}

TEST_P(Cage, CanStillDieOfSignals) {
  for (const bool aborts : {true, false}) {
    const pid_t pid = ::fork();
    if (pid == 0) {
      if (!become()) ::_exit(kNotSandboxed);
      if (!enter_sandbox({root_ / "cache"}).calls) ::_exit(kNotSandboxed);
      if (aborts) std::abort();
      ::raise(SIGTERM);
      ::_exit(0);
    }
    int status = 0;
    ::waitpid(pid, &status, 0);
    if (WIFEXITED(status)) SKIP_UNCAGED(WEXITSTATUS(status), &Sandboxed::calls);
    ASSERT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(WTERMSIG(status), aborts ? SIGABRT : SIGTERM);
  }
}

TEST_P(Cage, CanChangeOnlyItsOwnLimits) {
  const auto set = [](pid_t of) {
    rlimit files{};
    return ::prlimit(of, RLIMIT_NOFILE, nullptr, &files) == 0 &&
                   ::prlimit(of, RLIMIT_NOFILE, &files, nullptr) == 0
               ? 0
               : 1;
  };
  const int agent = try_sandboxed([&] { return set(::getppid()); }, &Sandboxed::calls);
  SKIP_UNCAGED(agent, &Sandboxed::calls);
  EXPECT_EQ(agent, EPERM);
  EXPECT_EQ(try_sandboxed([&] { return set(0); }, &Sandboxed::calls), 0);
  EXPECT_EQ(try_sandboxed([] { return ::setpriority(PRIO_PROCESS, static_cast<id_t>(::getppid()), 19); },
                          &Sandboxed::calls),
            EPERM);
}

TEST_P(Cage, CannotLeaveSharedMemoryBehind) {
  const int shared = try_sandboxed([] { return ::shmget(IPC_PRIVATE, 4096, IPC_CREAT | 0600) >= 0 ? 0 : 1; },
                                   &Sandboxed::calls);
  SKIP_UNCAGED(shared, &Sandboxed::calls);
  EXPECT_EQ(shared, EPERM);
  EXPECT_EQ(
      try_sandboxed([] { return ::msgget(IPC_PRIVATE, IPC_CREAT | 0600) >= 0 ? 0 : 1; }, &Sandboxed::calls),
      EPERM);
  EXPECT_EQ(try_sandboxed([] { return ::semget(IPC_PRIVATE, 1, IPC_CREAT | 0600) >= 0 ? 0 : 1; },
                          &Sandboxed::calls),
            EPERM);
}

TEST_P(Cage, AlsoRestrictsChildProcesses) {
  const auto read_secret = [&] {
    const std::string command = "cat '" + (root_ / "secret").string() + "' 2>&1";
    return ::system(command.c_str()) == 0 ? 0 : 1;
  };
  const int code =
      try_sandboxed([&] { return read_secret() == 0 ? 0 : (errno = EACCES, 1); }, &Sandboxed::files);
  SKIP_UNCAGED(code, &Sandboxed::files);
  EXPECT_EQ(code, EACCES);
  EXPECT_EQ(try_sandboxed([] { return ::system("true") == 0 ? 0 : (errno = ENOENT, 1); }, &Sandboxed::files),
            0);
}

INSTANTIATE_TEST_SUITE_P(Users, Cage, testing::Values(As::test, As::nobody), [](const auto& info) {
  return info.param == As::test ? "OfTheTest" : "WithoutRights";
});

}  // namespace
}  // namespace ls

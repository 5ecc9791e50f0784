// What a process in the sandbox can still do. Each attempt is made in a new process.
#include "worker/child/sandbox.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/landlock.h>
#include <linux/sched.h>
#include <sched.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/ipc.h>
#include <sys/msg.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/sem.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

namespace ls::worker::child {
namespace {

constexpr int kNotSandboxed = 200;

class Cage : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "lightshaft-cage-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    root_ = name;
    std::filesystem::create_directories(root_ / "cache/sub");
    std::ofstream(root_ / "cache/sub/asset") << "asset";
    std::ofstream(root_ / "secret") << "secret";
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  // Returns 0 if `attempt` returned 0 in a sandboxed process, otherwise its errno; kNotSandboxed if the
  // sandbox lacks `needs`.
  int try_sandboxed(const std::function<int()>& attempt, bool Sandboxed::*needs) const {
    const pid_t pid = ::fork();
    if (pid == 0) {
      const Sandboxed sandboxed = enter_sandbox({root_ / "cache"});
      if (!(sandboxed.*needs)) ::_exit(kNotSandboxed);
      ::_exit(attempt() == 0 ? 0 : errno);
    }
    int status = 0;
    ::waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
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
  if (needs == &Sandboxed::sizes && landlock() < 3)
    return "this kernel's Landlock does not know of sizes (Linux 6.2)";
  return "";
#endif
}

#define SKIP_UNCAGED(code, needs)                                                      \
  if (code == kNotSandboxed) {                                                         \
    if (const std::string why = why_uncaged(needs); !why.empty()) GTEST_SKIP() << why; \
    FAIL() << "nothing is caged, and the kernel is no reason";                         \
  }

TEST_F(Cage, ReadsAssetsAndNothingElseOfTheMachine) {
  const int asset = try_open(root_ / "cache/sub/asset", O_RDONLY);
  SKIP_UNCAGED(asset, &Sandboxed::files);
  EXPECT_EQ(asset, 0);
  EXPECT_EQ(try_open(root_ / "secret", O_RDONLY), EACCES);
  EXPECT_EQ(try_open(root_ / "cache/../secret", O_RDONLY), EACCES);
  EXPECT_EQ(try_open("/etc/passwd", O_RDONLY), EACCES);
  EXPECT_EQ(try_open("/proc/1/environ", O_RDONLY), EACCES);
  EXPECT_EQ(try_open("/proc/self/status", O_RDONLY), 0);
}

TEST_F(Cage, WritesNothing) {
  const int made = try_open(root_ / "cache/new", O_WRONLY | O_CREAT);
  SKIP_UNCAGED(made, &Sandboxed::files);
  EXPECT_EQ(made, EACCES);
  EXPECT_EQ(try_open(root_ / "cache/sub/asset", O_WRONLY), EACCES);
  EXPECT_EQ(try_open("/tmp/lightshaft-cage-test", O_WRONLY | O_CREAT), EACCES);
  EXPECT_EQ(try_open("/dev/null", O_RDWR), 0);
  EXPECT_EQ(try_sandboxed([&] { return ::unlink((root_ / "cache/sub/asset").c_str()); }, &Sandboxed::files),
            EACCES);
}

TEST_F(Cage, MovesAndLinksNothing) {
  const auto asset = root_ / "cache/sub/asset", beside = root_ / "cache/sub/other", out = root_ / "out";
  const int moved = try_sandboxed([&] { return ::rename(asset.c_str(), beside.c_str()); }, &Sandboxed::files);
  SKIP_UNCAGED(moved, &Sandboxed::files);
  EXPECT_EQ(moved, EACCES);
  // Older kernels answer moves and links between folders as if the folders were on different disks (EXDEV).
  EXPECT_THAT(try_sandboxed([&] { return ::rename(asset.c_str(), out.c_str()); }, &Sandboxed::files),
              testing::AnyOf(EACCES, EXDEV));
  EXPECT_THAT(try_sandboxed([&] { return ::link(asset.c_str(), out.c_str()); }, &Sandboxed::files),
              testing::AnyOf(EACCES, EXDEV));
  EXPECT_EQ(try_sandboxed([&] { return ::symlink(asset.c_str(), beside.c_str()); }, &Sandboxed::files),
            EACCES);
  EXPECT_TRUE(std::filesystem::exists(asset));
}

TEST_F(Cage, CutsNoFileShort) {
  const auto asset = root_ / "cache/sub/asset";
  const int cut = try_sandboxed([&] { return ::truncate(asset.c_str(), 0); }, &Sandboxed::sizes);
  SKIP_UNCAGED(cut, &Sandboxed::sizes);
  EXPECT_EQ(cut, EACCES);
  EXPECT_EQ(std::filesystem::file_size(asset), 5u);
}

TEST_F(Cage, OpensNoSocketAndTracesNobody) {
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

TEST_F(Cage, MakesNoNamespaces) {
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

TEST_F(Cage, SignalsNobodyButItself) {
  const int agent = try_sandboxed([] { return ::kill(::getppid(), 0); }, &Sandboxed::calls);
  SKIP_UNCAGED(agent, &Sandboxed::calls);
  EXPECT_EQ(agent, EPERM);
  const auto denied = [&](const std::function<long()>& call) {
    return try_sandboxed([&] { return call() == -1 ? 1 : 0; }, &Sandboxed::calls) == EPERM;
  };
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

TEST_F(Cage, DiesOfItsOwnSignals) {
  for (const bool aborts : {true, false}) {
    const pid_t pid = ::fork();
    if (pid == 0) {
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

TEST_F(Cage, ChangesLimitsOfNobodyButItself) {
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

TEST_F(Cage, LeavesNoMemoryBehind) {
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

TEST_F(Cage, HoldsWhatItStartsToTheSame) {
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

}  // namespace
}  // namespace ls::worker::child

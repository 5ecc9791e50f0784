#include "worker/child/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

extern char** environ;

namespace ls::worker::child {
namespace {

constexpr int kPollMs = 50;
// Their ends are first moved above all the numbers that they will have in the child, so that no dup2
// overwrites another.
constexpr int kHighFd = kFirstSlotFd + kMostSlots + 1;

int raised(int fd) {
  const int high = ::fcntl(fd, F_DUPFD_CLOEXEC, kHighFd);
  ::close(fd);
  return high;
}

tl::unexpected<Error> system_error(const char* what) {
  return fail(Errc::internal,
              fmt::format("cannot start the render child: {}: {}", what, std::strerror(errno)));
}

// The environment without secrets: the child has no use for the join token.
std::vector<char*> child_environment() {
  std::vector<char*> kept;
  for (char** e = environ; *e; ++e)
    if (std::strncmp(*e, "LIGHTSHAFT_JOIN_TOKEN=", 22) != 0 && std::strncmp(*e, "LIGHTSHAFT_TOKEN=", 17) != 0)
      kept.push_back(*e);
  kept.push_back(nullptr);
  return kept;
}

}  // namespace

Result<std::shared_ptr<Process>> Process::spawn(const ChildOptions& options) {
  std::shared_ptr<Process> process(new Process);
  std::vector<int> theirs;
  const auto close_theirs = [&theirs] {
    for (const int fd : theirs) ::close(fd);
  };
  process->memory_bytes_ = sizeof(Slot) * static_cast<std::size_t>(options.slots);
  const int memory = ::memfd_create("lightshaft-render", MFD_CLOEXEC);
  if (memory < 0) return system_error("memfd_create");
  theirs.push_back(raised(memory));
  if (::ftruncate(theirs[0], static_cast<off_t>(process->memory_bytes_)) != 0) {
    close_theirs();
    return system_error("shared memory");
  }
  void* mapped = ::mmap(nullptr, process->memory_bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, theirs[0], 0);
  if (mapped == MAP_FAILED) {
    close_theirs();
    return system_error("mmap");
  }
  process->slots_ = static_cast<Slot*>(mapped);
  for (int i = 0; i <= options.slots; ++i) {
    int pair[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0) {
      close_theirs();
      return system_error("socketpair");
    }
    (i == 0 ? process->control_ : process->slot_fds_.emplace_back()) = pair[0];
    theirs.push_back(raised(pair[1]));
  }
  const auto started = process->start(options, theirs);
  close_theirs();
  if (!started) return tl::unexpected<Error>(started.error());
  return process;
}

Result<void> Process::start(const ChildOptions& options, const std::vector<int>& theirs) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  for (std::size_t i = 0; i < theirs.size(); ++i)
    posix_spawn_file_actions_adddup2(&actions, theirs[i], kSharedMemoryFd + static_cast<int>(i));
  posix_spawn_file_actions_addclosefrom_np(&actions, kSharedMemoryFd + static_cast<int>(theirs.size()));
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);

  std::vector<std::string> arguments = {options.executable.string()};
  arguments.insert(arguments.end(), options.arguments.begin(), options.arguments.end());
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const int error = ::posix_spawn(&pid_, options.executable.c_str(), &actions, &attributes, argv.data(),
                                  child_environment().data());
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error == 0) return {};
  pid_ = -1;
  errno = error;
  return system_error(options.executable.c_str());
}

Process::~Process() {
  kill();
  end();
  if (control_ >= 0) ::close(control_);
  for (const int fd : slot_fds_) ::close(fd);
  if (slots_) ::munmap(slots_, memory_bytes_);
}

void Process::kill() {
  const std::lock_guard lock(reap_mutex_);
  if (pid_ > 0 && !end_) ::kill(pid_, SIGKILL);
}

Process::End Process::end() {
  const std::lock_guard lock(reap_mutex_);
  if (end_) return *end_;
  End end;
  int status = 0;
  if (pid_ > 0) {
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    if (WIFSIGNALED(status)) {
      end.signal = WTERMSIG(status);
      end.text = fmt::format("died of signal {} ({})", *end.signal, ::strsignal(*end.signal));
    } else {
      end.exit_code = WEXITSTATUS(status);
      end.text = fmt::format("ended with exit code {}", end.exit_code);
    }
  }
  end_ = end;
  return end;
}

bool Process::alive() {
  const std::lock_guard lock(reap_mutex_);
  if (end_ || pid_ <= 0) return false;
  siginfo_t info{};
  return ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         info.si_pid == 0;
}

std::uint64_t Process::rss_bytes() const {
  std::uint64_t total = 0, resident = 0;
  if (FILE* file = std::fopen(fmt::format("/proc/{}/statm", pid_).c_str(), "re")) {
    if (std::fscanf(file, "%lu %lu", &total, &resident) != 2) resident = 0;
    std::fclose(file);
  }
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

bool Process::some_slot_crashed() const {
  for (int i = 0; i < slots(); ++i)
    if (slots_[i].crashed.load(std::memory_order_relaxed)) return true;
  return false;
}

bool Process::readable(int fd) {
  pollfd p{fd, POLLIN, 0};
  return ::poll(&p, 1, kPollMs) > 0;
}

std::optional<Process::Answer> Process::receive(int fd) {
  Answer answer;
  if (!receive_all(fd, &answer.reply, sizeof answer.reply) || answer.reply.text_bytes > kTextBytes)
    return std::nullopt;
  answer.text.resize(answer.reply.text_bytes);
  if (!receive_all(fd, answer.text.data(), answer.text.size())) return std::nullopt;
  return answer;
}

}  // namespace ls::worker::child

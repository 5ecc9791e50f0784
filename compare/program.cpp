#include "compare/program.h"
#include "compare/race_machine.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <optional>
#include <string_view>

#include "common/base/plain_text.h"

extern char** environ;

namespace ls::race {
namespace {

constexpr std::size_t kKeptOutput = 8192;
constexpr std::size_t kShownLine = 400;
constexpr int kLookMilliseconds = 20;  // polling interval

std::vector<char*> environment() {
  std::vector<char*> kept;
  for (char** e = environ; *e; ++e)
    if (!std::string_view(*e).starts_with("LIGHTSHAFT_")) kept.push_back(*e);
  kept.push_back(nullptr);
  return kept;
}

// The last non-empty line.
std::string last_line(std::string_view output) {
  while (!output.empty()) {
    const auto at = output.find_last_of('\n');
    const std::string_view line = at == std::string_view::npos ? output : output.substr(at + 1);
    if (line.find_first_not_of(" \t\r") != std::string_view::npos)
      return plain_text(std::string(line.substr(0, kShownLine)));
    output = at == std::string_view::npos ? std::string_view() : output.substr(0, at);
  }
  return "";
}

class Running {
 public:
  Running() = default;
  ~Running() {
    if (pid_ > 0) kill_group();
    if (pid_ > 0) reap();
    if (read_ >= 0) ::close(read_);
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  int start(const std::vector<std::string>& command) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return errno;
    read_ = ends[0];
    ::fcntl(read_, F_SETFL, O_NONBLOCK);
    const int error = spawn(command, ends[1]);
    ::close(ends[1]);
    return error;
  }
  // Waits briefly, and reads what the program has written.
  void look() {
    pollfd waited{read_, POLLIN, 0};
    ::poll(&waited, closed_ ? 0 : 1, kLookMilliseconds);
    drain();
  }
  bool ended() {
    siginfo_t info{};
    return ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == pid_;
  }
  void kill_group() { ::kill(-pid_, SIGKILL); }
  // Waits for the program's end and returns its exit status; call after ended() or kill_group(). Also kills
  // processes that the program left behind.
  int reap() {
    kill_group();
    int status = 0;
    while (::wait4(pid_, &status, 0, &usage_) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    drain();
    return status;
  }
  double cpu_seconds() const { return race::cpu_seconds(usage_); }
  std::string last_words() const {
    const std::string line = last_line(output_);
    return line.empty() ? "; it said nothing" : fmt::format("; its last words: {}", line);
  }

 private:
  int spawn(const std::vector<std::string>& command, int output) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, output, 1);
    posix_spawn_file_actions_adddup2(&actions, output, 2);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
    std::vector<std::string> texts = command;
    std::vector<char*> argv;
    for (std::string& text : texts) argv.push_back(text.data());
    argv.push_back(nullptr);
    const int error =
        ::posix_spawnp(&pid_, argv[0], &actions, &attributes, argv.data(), environment().data());
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    if (error != 0) pid_ = -1;
    return error;
  }

  void drain() {
    std::array<char, 4096> bytes;
    for (ssize_t n = 1; n > 0;) {
      n = ::read(read_, bytes.data(), bytes.size());
      if (n == 0) closed_ = true;
      if (n <= 0) break;
      output_.append(bytes.data(), static_cast<std::size_t>(n));
      if (output_.size() > 2 * kKeptOutput) output_.erase(0, output_.size() - kKeptOutput);
    }
  }

  pid_t pid_ = -1;
  int read_ = -1;
  bool closed_ = false;
  std::string output_;
  rusage usage_{};
};

}  // namespace

Result<Cost> run_program(const Program& program, const Clock& clock, const std::atomic<bool>& stop) {
  Running running;
  const TimePoint begin = clock.now();
  const std::string& name = program.command.front();
  if (const int error = running.start(program.command); error != 0)
    return fail(Errc::invalid_argument, fmt::format("{} cannot be started: {}", name, std::strerror(error)));
  while (!running.ended()) {
    if (stop) return fail(Errc::failed_precondition, "told to stop");
    if (seconds(clock.now() - begin) > program.most_seconds) {
      running.kill_group();
      running.reap();
      return fail(Errc::resource_exhausted, fmt::format("{} ran for more than {:g} s and was ended{}", name,
                                                        program.most_seconds, running.last_words()));
    }
    running.look();
  }
  const double wall = seconds(clock.now() - begin);
  const int status = running.reap();
  if (WIFSIGNALED(status))
    return fail(Errc::invalid_argument, fmt::format("{} died of signal {} ({}){}", name, WTERMSIG(status),
                                                    ::strsignal(WTERMSIG(status)), running.last_words()));
  if (WEXITSTATUS(status) != 0)
    return fail(Errc::invalid_argument,
                fmt::format("{} ended with exit code {}{}", name, WEXITSTATUS(status), running.last_words()));
  return Cost{wall, running.cpu_seconds()};
}

}  // namespace ls::race

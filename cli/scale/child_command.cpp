#include "cli/scale/child_command.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "common/base/clock.h"
#include "common/base/spawn.h"

namespace ls::cli {
namespace {

constexpr int kTick = 50;  // milliseconds between checks whether a program has ended
constexpr std::size_t kMostOutput = std::size_t{64} << 20;

struct Pipe {
  int read = -1, write = -1;
  Pipe() {
    std::array<int, 2> ends{-1, -1};
    if (::pipe2(ends.data(), O_CLOEXEC) == 0) read = ends[0], write = ends[1];
  }
  ~Pipe() { close(read), close(write); }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  static void close(int& fd) {
    if (fd >= 0) ::close(std::exchange(fd, -1));
  }
};

Result<pid_t> start_program(const Words& words, std::vector<int> standard_files) {
  const auto inherits = [](std::string_view variable) { return !variable.starts_with("LIGHTSHAFT_"); };
  return spawn({words.front(), words, std::move(standard_files), inherits});
}

int exit_code(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status); }

// Appends to `text` what can be read now. Closes our end of the pipe once the program has closed its own.
void read_some(int& fd, std::string& text) {
  std::array<char, 4096> bytes;
  const ssize_t count = ::read(fd, bytes.data(), bytes.size());
  if (count < 0 && (errno == EINTR || errno == EAGAIN)) return;
  if (count <= 0) return Pipe::close(fd);
  text.append(bytes.data(), static_cast<std::size_t>(count));
}

void write_some(int& fd, const std::string& text, std::size_t& written) {
  const ssize_t count = ::write(fd, text.data() + written, text.size() - written);
  if (count > 0) written += static_cast<std::size_t>(count);
  if ((count < 0 && errno != EINTR && errno != EAGAIN) || written == text.size()) Pipe::close(fd);
}

}  // namespace

Result<CommandOutput> run_command(const Words& words, const std::string& input, double most_seconds) {
  const SystemClock clock;
  const TimePoint deadline = clock.now() + from_seconds(most_seconds);
  Pipe in, out, err;
  if (in.read < 0 || out.read < 0 || err.read < 0)
    return fail(Errc::resource_exhausted, "no pipe to run a program with");
  const auto pid = start_program(words, {in.read, out.write, err.write});
  if (!pid) return tl::unexpected(pid.error());
  Pipe::close(in.read), Pipe::close(out.write), Pipe::close(err.write);
  ::fcntl(in.write, F_SETFL, O_NONBLOCK);
  CommandOutput output;
  std::size_t written = 0;
  if (input.empty()) Pipe::close(in.write);
  std::optional<int> code;
  // Reading stops soon after the program has ended, even if child processes that it left running keep its
  // output open.
  while (out.read >= 0 || err.read >= 0 || !code) {
    if (!code)
      if (const auto status = poll_end(*pid)) code = exit_code(*status);
    const bool late = clock.now() >= deadline;
    if (!code && (late || std::max(output.out.size(), output.err.size()) > kMostOutput)) {
      ::kill(-*pid, SIGKILL);
      wait_for_end(*pid);
      if (late)
        return fail(Errc::unavailable,
                    fmt::format("{} did not end within {:.0f} s", words.front(), most_seconds));
      return fail(Errc::resource_exhausted,
                  fmt::format("{} printed more than {} MiB", words.front(), kMostOutput >> 20));
    }
    std::array<pollfd, 3> wait{{{in.write, POLLOUT, 0}, {out.read, POLLIN, 0}, {err.read, POLLIN, 0}}};
    const int ready = ::poll(wait.data(), wait.size(), code ? 0 : kTick);
    if (ready == 0 && code) break;
    if (wait[0].revents) write_some(in.write, input, written);
    if (wait[1].revents) read_some(out.read, output.out);
    if (wait[2].revents) read_some(err.read, output.err);
  }
  output.code = *code;
  return output;
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
  return parts;
}

Result<LongCommand> LongCommand::start(const Words& words, const std::string& input, const std::string& log) {
  Pipe in;
  if (in.read < 0) return fail(Errc::resource_exhausted, "no pipe to run a program with");
  int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  if (file < 0) return bad_argument(fmt::format("{}: {}", log, std::strerror(errno)));
  // The input is written before the program runs. A pipe holds 64 KiB without a reader, far more than the
  // command line and token of a worker. If the input were longer, the write would fail instead of blocking.
  ::fcntl(in.write, F_SETFL, O_NONBLOCK);
  const bool sent = ::write(in.write, input.data(), input.size()) == static_cast<ssize_t>(input.size());
  const Result<pid_t> pid =
      sent ? start_program(words, {in.read, file, file}) : bad_argument("the command is too long");
  Pipe::close(file);
  if (!pid) return tl::unexpected(pid.error());
  return LongCommand(*pid, std::exchange(in.write, -1));
}

LongCommand::LongCommand(LongCommand&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), input_(std::exchange(other.input_, -1)) {}

LongCommand::~LongCommand() {
  close_input();
  kill();
}

bool LongCommand::ended() {
  if (pid_ > 0 && poll_end(pid_)) pid_ = -1;
  return pid_ < 0;
}

void LongCommand::close_input() { Pipe::close(input_); }

void LongCommand::kill() {
  if (pid_ < 0) return;
  ::kill(-pid_, SIGKILL);
  wait_for_end(std::exchange(pid_, -1));
}

}  // namespace ls::cli

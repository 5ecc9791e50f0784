#include "worker/own_program.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string_view>
#include <system_error>

#include "core/base/clock.h"
#include "core/base/program_output.h"
#include "core/base/spawn.h"

namespace ls::worker {
namespace {

constexpr const char* kRunning = "/proc/self/exe";
// Longest time for the program to tell its version, and the pause between two looks at it
constexpr Duration kCheckLimit = std::chrono::seconds(10);
constexpr int kLookMs = 20;

// Returns the absolute path of the program that a shell runs by this name; empty: there is none.
std::filesystem::path found_as(const std::string& name) {
  if (name.find('/') != std::string::npos) return std::filesystem::absolute(name);
  const char* folders = std::getenv("PATH");
  std::string_view left = folders ? folders : "";
  while (!left.empty()) {
    const std::string_view folder = left.substr(0, left.find(':'));
    left.remove_prefix(std::min(left.size(), folder.size() + 1));
    std::filesystem::path candidate = std::filesystem::absolute(std::filesystem::path(folder) / name);
    if (::access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return {};
}

std::filesystem::path path_of_this_program(const std::string& name) {
  std::error_code error;
  const std::filesystem::path named = found_as(name);
  if (!named.empty() && std::filesystem::equivalent(named, kRunning, error) && !error) return named;
  // Whoever started it has given it another name
  return std::filesystem::read_symlink(kRunning, error);
}

tl::unexpected<Error> not_usable(const std::filesystem::path& path, const std::string& why) {
  return fail(Errc::failed_precondition,
              fmt::format("{} {}; install it, and ask for the restart again", path.string(), why));
}

std::string end_in_words(int status, const std::string& last_line) {
  const std::string end = WIFSIGNALED(status) ? fmt::format("was ended by signal {}", WTERMSIG(status))
                                              : fmt::format("ended with {}", WEXITSTATUS(status));
  return fmt::format("cannot be run: with --version it {}{}{}", end, last_line.empty() ? "" : ": ",
                     last_line);
}

}  // namespace

OwnProgram::OwnProgram(int argc, char** argv) : arguments_(argv, argv + argc) {
  path_ = path_of_this_program(arguments_.empty() ? "" : arguments_.front());
}

Result<void> OwnProgram::check() const {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path_, error)) return not_usable(path_, "is gone");
  if (::access(path_.c_str(), X_OK) != 0)
    return not_usable(path_, fmt::format("cannot be executed ({})", std::strerror(errno)));
  LineBudget lines;
  auto output = ProgramOutput::open(path_.filename().string(), lines);
  if (!output) return tl::unexpected<Error>(output.error());
  const int out = (*output)->write_end();
  const auto pid =
      spawn({path_.string(), {path_.string(), "--version"}, {kDevNull, out, out}, [](std::string_view) {
               return true;
             }});
  if (!pid) return not_usable(path_, "cannot be run: " + pid.error().message);
  (*output)->close_write_end();
  const SystemClock clock;
  const TimePoint end = clock.now() + kCheckLimit;
  bool in_time = true;
  std::optional<int> status;
  while (!(status = poll_end(*pid))) {
    if (!(*output)->read(kLookMs)) ::usleep(kLookMs * 1000);
    in_time = in_time && clock.now() < end;
    if (!in_time) ::kill(*pid, SIGKILL);
  }
  const std::string last_line = (*output)->end();
  if (!in_time)
    return not_usable(path_, fmt::format("did not tell its version within {:.0f} s", seconds(kCheckLimit)));
  if (*status != 0) return not_usable(path_, end_in_words(*status, last_line));
  return {};
}

Error OwnProgram::restart() const {
  std::vector<char*> arguments;
  for (const std::string& one : arguments_) arguments.push_back(const_cast<char*>(one.c_str()));
  arguments.push_back(nullptr);
  // They are closed by execv() if that succeeds.
  ::close_range(STDERR_FILENO + 1, ~0U, CLOSE_RANGE_CLOEXEC);
  ::execv(path_.c_str(), arguments.data());
  return {Errc::internal,
          fmt::format("cannot start {} again: {}; start the worker", path_.string(), std::strerror(errno))};
}

}  // namespace ls::worker

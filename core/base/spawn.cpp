#include "core/base/spawn.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <future>
#include <semaphore>
#include <sstream>
#include <thread>
#include <utility>

#include "core/base/program_output.h"

extern char** environ;

namespace ls {
namespace {

constexpr int kLookMs = 20;  // longest time between looks whether a helper has ended, in milliseconds

// Duplicates of the files that the program will inherit. Their numbers are higher than all numbers that the
// program will use, so that dup2() of one file to its final number cannot overwrite another file that is
// still to be moved.
class HighFiles {
 public:
  ~HighFiles() {
    for (const int fd : fds_) ::close(fd);
  }
  // Duplicates `fd` to a number of at least `lowest`. Returns an error number, 0 for success.
  int add(int fd, int lowest) {
    const int high = ::fcntl(fd, F_DUPFD_CLOEXEC, lowest);
    // EINVAL: `lowest` is above the process's limit for descriptors
    if (high < 0) return errno == EINVAL ? EMFILE : errno;
    fds_.push_back(high);
    return 0;
  }
  int last() const { return fds_.back(); }

 private:
  std::vector<int> fds_;
};

std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> result;
  for (std::string& word : words) result.push_back(word.data());
  result.push_back(nullptr);
  return result;
}

std::vector<char*> environment(const std::function<bool(std::string_view)>& inherits) {
  std::vector<char*> kept;
  for (char** e = environ; *e; ++e)
    if (inherits(*e)) kept.push_back(*e);
  kept.push_back(nullptr);
  return kept;
}

// Returns true for variables that the loader, the allocator and the sanitizers read.
bool inherits(std::string_view variable) {
  const std::string_view name = variable.substr(0, variable.find('='));
  return name.starts_with("LD_") || name.starts_with("MALLOC_") || name.ends_with("SAN_OPTIONS");
}

bool leads_session_without_terminal() {
  if (::getsid(0) != ::getpid()) return false;
  std::string stat;
  std::getline(std::ifstream("/proc/self/stat"), stat);
  // After the name in parentheses: state, parent, process group, session, terminal (0: none)
  std::istringstream fields(stat.substr(std::min(stat.size(), stat.rfind(')') + 1)));
  std::string word;
  for (int i = 0; i < 4; ++i) fields >> word;
  return fields >> word && word == "0";
}

int wait_with(pid_t pid, int flags, int& status) {
  int got = -1;
  while ((got = ::waitpid(pid, &status, flags)) < 0 && errno == EINTR) {
  }
  return got;
}

}  // namespace

Result<pid_t> spawn(Program program) {
  if (std::any_of(program.files.begin(), program.files.end(), [](int fd) { return ::isatty(fd) != 0; }))
    return fail(Errc::internal, fmt::format("cannot start {}: it would inherit a terminal", program.path));
  const int count = static_cast<int>(program.files.size());
  HighFiles high;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  int error = 0;
  for (int i = 0; i < count && error == 0; ++i) {
    const int fd = program.files[static_cast<std::size_t>(i)];
    if (fd == kDevNull) {
      error = posix_spawn_file_actions_addopen(&actions, i, "/dev/null", O_RDWR, 0);
    } else if (error = high.add(fd, count); error == 0) {
      error = posix_spawn_file_actions_adddup2(&actions, high.last(), i);
    }
  }
  if (error == 0) error = posix_spawn_file_actions_addclosefrom_np(&actions, count);

  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, all;
  sigemptyset(&none), sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  const int session = program.own_session ? POSIX_SPAWN_SETSID : 0;
  posix_spawnattr_setflags(&attributes,
                           static_cast<short>(POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | session));
  pid_t pid = -1;
  if (error == 0)
    error = ::posix_spawnp(&pid, program.path.c_str(), &actions, &attributes,
                           pointers(program.arguments).data(), environment(program.inherits).data());
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error == 0) return pid;
  return fail(error == ENOENT ? Errc::not_found : Errc::internal,
              fmt::format("cannot start {}: {}{}", program.path, std::strerror(error),
                          error == EMFILE ? "; raise the limit of open files (ulimit -n)" : ""));
}

int wait_for_end(pid_t pid) {
  int status = 0;
  wait_with(pid, 0, status);
  return status;
}

std::optional<int> poll_end(pid_t pid) {
  int status = 0;
  if (wait_with(pid, WNOHANG, status) == 0) return std::nullopt;
  return status;
}

std::filesystem::path program_beside_us(std::string_view name) {
  std::error_code unknown;
  return std::filesystem::read_symlink("/proc/self/exe", unknown).parent_path() / name;
}

Descriptor::~Descriptor() {
  if (fd >= 0) ::close(fd);
}

Result<HelperEnd> run_helper(const std::filesystem::path& program, std::vector<std::string> arguments,
                             int shared, const std::atomic<bool>* stop) {
  static LineBudget budget;  // of all helpers of this process together
  auto output = ProgramOutput::open(program.filename().string(), budget);
  if (!output) return tl::unexpected<Error>(output.error());
  const int out = (*output)->write_end();
  arguments.insert(arguments.begin(), program.string());
  // The helper of a render child stays in the child's process group, and so is killed with the child. A child
  // in a sandbox may not signal it: but the kernel ends helpers that ask for it (PR_SET_PDEATHSIG) with the
  // thread that has started them, so a thread of its own does that, and ends when the helper shall.
  std::promise<Result<pid_t>> started;
  std::jthread parent([&](std::stop_token asked) {
    started.set_value(spawn({program.string(),
                             std::move(arguments),
                             {kDevNull, out, out, shared},
                             inherits,
                             !leads_session_without_terminal()}));
    std::binary_semaphore end{0};
    const std::stop_callback on_stop(asked, [&] { end.release(); });
    end.acquire();
  });
  const auto pid = started.get_future().get();
  if (!pid) return fail(Errc::internal, pid.error().message);
  (*output)->close_write_end();
  // The output ends with the program, unless the program has closed it before or has left processes behind
  // that keep it open: so both are looked at.
  std::optional<int> status;
  bool open = true;
  for (int pause = 1; !status; status = poll_end(*pid)) {
    if (stop && *stop) ::kill(*pid, SIGKILL), parent.request_stop();
    if (open) {
      open = (*output)->read(kLookMs);
    } else {
      ::poll(nullptr, 0, pause);  // a program ends right after its output, unless it has closed that before
      pause = std::min(2 * pause, kLookMs);
    }
  }
  return HelperEnd{*status, (*output)->end()};
}

}  // namespace ls

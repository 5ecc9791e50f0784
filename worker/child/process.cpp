#include "worker/child/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <string_view>

#include "core/base/spawn.h"

namespace ls::worker::child {
namespace {

constexpr int kLogMs = 200;    // longest wait for output of the child before a look whether to stop
constexpr int kDyingMs = 500;  // longest time from the end of a child's channels to its death

tl::unexpected<Error> system_error(const char* what, int error = errno) {
  const char* help = error == EMFILE ? "; raise the limit of open files (ulimit -n)" : "";
  return fail(Errc::internal,
              fmt::format("cannot start the render child: {}: {}{}", what, std::strerror(error), help));
}

// Returns true for environment variables that the child gets: only those that its libraries use. The others
// are withheld, because they may contain secrets of the agent (the join token, cloud keys), and an untrusted
// scene file may take over the renderer.
bool may_see(std::string_view variable) {
  constexpr std::array kNames{"PATH=", "HOME=", "USER=", "TMPDIR=", "TZ=", "LANG=", "LANGUAGE="};
  constexpr std::array kFamilies{"LC_", "LD_", "MALLOC_", "GLIBC_TUNABLES=", "TBB_", "LIGHTSHAFT_LOG="};
  const auto begins = [&](const char* with) { return variable.starts_with(with); };
  const std::string_view name = variable.substr(0, variable.find('='));
  return std::any_of(kNames.begin(), kNames.end(), begins) ||
         std::any_of(kFamilies.begin(), kFamilies.end(), begins) || name.ends_with("SAN_OPTIONS");
}

}  // namespace

Result<std::shared_ptr<Process>> Process::spawn(const ChildOptions& options, LineBudget& lines) {
  std::shared_ptr<Process> process(new Process);
  // The descriptors that the child will get, in the order of their numbers in the child. The first one gets
  // the number kSharedMemoryFd.
  std::list<Descriptor> theirs;
  if (const auto ok = process->share_memory(options.slots, theirs); !ok) return tl::unexpected(ok.error());
  for (int i = 0; i <= options.slots; ++i) {
    int pair[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0) return system_error("socketpair");
    (i == 0 ? process->control_ : process->slot_fds_.emplace_back()) = pair[0];
    theirs.emplace_back(pair[1]);
  }
  if (const auto ok = process->start(options, theirs, lines); !ok) return tl::unexpected<Error>(ok.error());
  return process;
}

Result<void> Process::share_memory(int slots, std::list<Descriptor>& theirs) {
  const std::size_t bytes = shared_bytes_ = Shared::bytes(slots);
  const int fd = ::memfd_create("lightshaft-render", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (fd < 0) return system_error("memfd_create");
  theirs.emplace_back(fd);
  // The seals keep the child from cutting the memory short: reading it would then kill the agent.
  if (::ftruncate(fd, static_cast<off_t>(bytes)) != 0 ||
      ::fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    return system_error("shared memory");
  void* mapped = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  if (mapped == MAP_FAILED) return system_error("mmap");
  shared_ = static_cast<Shared*>(mapped);
  return {};
}

Result<void> Process::start(const ChildOptions& options, const std::list<Descriptor>& theirs,
                            LineBudget& lines) {
  auto output = ProgramOutput::open("renderer", lines);
  if (!output) return tl::unexpected<Error>(output.error());
  output_ = std::move(*output);
  // The process list should show the name of the program's file, not that of the link /proc/self/exe
  std::error_code no_link;
  const std::filesystem::path behind = std::filesystem::read_symlink(options.executable, no_link);
  Program program{.path = options.executable.string(),
                  .arguments = {no_link ? options.executable.string() : behind.string()},
                  .files = {kDevNull, output_->write_end(), output_->write_end()},
                  .inherits = may_see};
  program.arguments.insert(program.arguments.end(), options.arguments.begin(), options.arguments.end());
  for (const Descriptor& end : theirs) program.files.push_back(end.fd);
  const auto pid = ls::spawn(std::move(program));
  if (!pid) return fail(Errc::internal, "cannot start the render child: " + pid.error().message);
  pid_ = *pid;
  output_->close_write_end();
  log_thread_ = std::jthread([this](std::stop_token stop) {
    sigset_t all;
    sigfillset(&all);
    ::pthread_sigmask(SIG_BLOCK, &all, nullptr);  // other threads wait for this process's signals
    while (!stop.stop_requested() && output_->read(kLogMs)) {
    }
    output_->end();
  });
  return {};
}

Process::~Process() {
  kill();
  end();
  log_thread_ = {};
  if (control_ >= 0) ::close(control_);
  for (const int fd : slot_fds_) ::close(fd);
  if (shared_) ::munmap(shared_, shared_bytes_);
}

void Process::condemn(int slot, Fault fault) {
  {
    const std::lock_guard lock(reap_mutex_);
    if (!condemned_) condemned_ = Condemned{slot, fault};
  }
  kill();
}

std::optional<Process::Condemned> Process::condemned() {
  const std::lock_guard lock(reap_mutex_);
  return condemned_;
}

void Process::kill() {
  const std::lock_guard lock(reap_mutex_);
  if (pid_ > 0 && !end_) ::kill(-pid_, SIGKILL);
}

Process::End Process::end() {
  // The wait is done without the lock, so that kill(), which needs the lock, can be called meanwhile. WNOWAIT
  // leaves the ended process as a zombie, so kill() cannot hit another process that has got its id.
  if (alive()) {
    siginfo_t info{};
    while (::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOWAIT) < 0 && errno == EINTR) {
    }
  }
  const std::lock_guard lock(reap_mutex_);
  if (end_) return *end_;
  End end;
  if (pid_ > 0) {
    ::kill(-pid_, SIGKILL);  // the processes that it has started
    const int status = wait_for_end(pid_);
    if (WIFSIGNALED(status)) {
      end.signal = WTERMSIG(status);
      end.text = fmt::format("died of signal {} ({})", *end.signal, ::strsignal(*end.signal));
    } else {
      end.text = fmt::format("ended with exit code {}", WEXITSTATUS(status));
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

std::uint64_t Process::rss_bytes() const { return resident_bytes(pid_); }

bool Process::some_slot_crashed() const {
  for (int i = 0; i < slots(); ++i)
    if (shared_->slots()[i].crashed.load(std::memory_order_relaxed)) return true;
  return false;
}

std::optional<Process::Answer> Process::ask(int slot, Request request, const std::string& text,
                                            const Watch& watch) {
  request.text_bytes = static_cast<std::uint32_t>(text.size());
  auto answer = exchange(slot, request, text, watch);
  // A missing answer does not prove that the child is dead: it may only have closed its end of the channel.
  // So it is killed, because otherwise end() could wait forever.
  if (!answer && !ends_soon()) condemn(slot, Fault::closed_its_channel);
  return answer;
}

// Returns true if the process is dead or dies within kDyingMs: the system closes the channels of a process
// that dies a moment before it is dead.
bool Process::ends_soon() {
  for (int waited = 0; alive(); ++waited) {
    if (waited == kDyingMs) return false;
    ::poll(nullptr, 0, 1);
  }
  return true;
}

std::optional<Process::Answer> Process::exchange(int slot, const Request& request, const std::string& text,
                                                 const Watch& watch) {
  const int fd = slot == kControl ? control_ : slot_fds_[static_cast<std::size_t>(slot)];
  Answer answer;
  if (!send_all(fd, &request, sizeof request, watch) || !send_all(fd, text.data(), text.size(), watch) ||
      !receive_all(fd, &answer.reply, sizeof answer.reply, watch))
    return std::nullopt;
  if (answer.reply.text_bytes > kReasonBytes || answer.reply.outcome > Outcome::stopped) {
    condemn(slot, Fault::answered_nonsense);
    return std::nullopt;
  }
  answer.text.resize(answer.reply.text_bytes);
  if (!receive_all(fd, answer.text.data(), answer.text.size(), watch)) return std::nullopt;
  return answer;
}

}  // namespace ls::worker::child

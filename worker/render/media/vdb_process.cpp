#include "worker/render/media/vdb_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <mutex>

#include "core/base/spawn.h"
#include "worker/render/base/build_stop.h"

namespace ls::render {
namespace {

tl::unexpected<Error> no_program(const std::string& why) {
  return fail(Errc::internal, "cannot read OpenVDB files: " + why);
}
tl::unexpected<Error> no_program(const char* what, int error) {
  return no_program(fmt::format("{}: {}", what, std::strerror(error)));
}

tl::unexpected<Error> how_it_ended(const HelperEnd& end) {
  const int status = end.status;
  if (!WIFSIGNALED(status))
    return fail(Errc::internal,
                fmt::format("the program that reads OpenVDB files ended with code {}{}{}",
                            WEXITSTATUS(status), end.last_line.empty() ? "" : ": ", end.last_line));
  switch (WTERMSIG(status)) {
    case SIGXCPU:
      return fail(Errc::resource_exhausted, "reading it takes too long: is it a damaged OpenVDB file?");
    case SIGKILL:
      return fail(Errc::resource_exhausted,
                  "the process that read it was killed: there was not enough memory");
    default:
      return fail(
          Errc::invalid_argument,
          fmt::format("not a readable OpenVDB or NanoVDB file: it crashes the library that reads it ({})",
                      ::strsignal(WTERMSIG(status))));
  }
}

// Guards the limit RLIMIT_DATA, because changing it takes two steps: it is read and then set.
std::mutex& limit_mutex() {
  static std::mutex one;
  return one;
}

// Lowers this process's limit RLIMIT_DATA by `bytes`, but not below 0. Returns the number of bytes by which
// it was lowered: 0 if there is no limit.
std::uint64_t lower_limit(std::uint64_t bytes) {
  const std::lock_guard lock(limit_mutex());
  rlimit limit{};
  if (::getrlimit(RLIMIT_DATA, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return 0;
  bytes = std::min<std::uint64_t>(bytes, limit.rlim_cur);
  limit.rlim_cur -= bytes;
  return ::setrlimit(RLIMIT_DATA, &limit) == 0 ? bytes : 0;
}
void raise_limit(std::uint64_t bytes) {
  const std::lock_guard lock(limit_mutex());
  rlimit limit{};
  if (bytes == 0 || ::getrlimit(RLIMIT_DATA, &limit) != 0) return;
  limit.rlim_cur += bytes;
  ::setrlimit(RLIMIT_DATA, &limit);
}

}  // namespace

std::uint64_t data_left() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_DATA, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kNoDataLimit;
  std::uint64_t size = 0, resident = 0, shared = 0, text = 0, library = 0, data = 0;
  std::ifstream("/proc/self/statm") >> size >> resident >> shared >> text >> library >> data;
  const std::uint64_t bytes = data * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  return limit.rlim_cur - std::min<std::uint64_t>(bytes, limit.rlim_cur);
}

Result<VdbFile> VdbFile::read(const std::filesystem::path& path, const std::string& grid_name,
                              std::uint64_t max_bytes, const std::filesystem::path& program) {
  const Descriptor reply(::memfd_create("lightshaft-vdb", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (reply.fd < 0) return no_program("memfd_create", errno);
  const auto end =
      run_helper(program, {path.string(), grid_name, std::to_string(max_bytes), std::to_string(data_left())},
                 reply.fd, BuildStop::flag());
  if (!end) return no_program(end.error().message);
  if (auto ok = BuildStop::go_on(); !ok) return tl::unexpected(ok.error());
  if (!WIFEXITED(end->status) || WEXITSTATUS(end->status) != 0) return how_it_ended(*end);

  // If the program started other processes, they may still have the reply's file open and could change it. So
  // the reply is sealed against changes before it is read, and rejected if sealing fails.
  if (::fcntl(reply.fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE) != 0) return vdb_nonsense();
  struct stat written {};
  if (::fstat(reply.fd, &written) != 0) return no_program("fstat", errno);
  const auto bytes = static_cast<std::uint64_t>(written.st_size);
  if (bytes == 0) return vdb_nonsense();
  VdbFile file;
  void* mapped = ::mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE, reply.fd, 0);
  if (mapped == MAP_FAILED) return no_program("mmap", errno);
  file.mapped_ = {mapped, [bytes, taken = lower_limit(bytes)](void* m) {
                    ::munmap(m, bytes);
                    raise_limit(taken);
                  }};
  const auto grid = validated_grid({static_cast<const std::byte*>(mapped), bytes}, max_bytes);
  if (!grid) return tl::unexpected(grid.error());
  file.grid_ = *grid;
  return file;
}

}  // namespace ls::render

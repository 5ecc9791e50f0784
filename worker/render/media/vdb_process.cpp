#include "worker/render/media/vdb_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include "worker/render/media/vdb_reply.h"
#include "worker/render/media/vdb_validate.h"

extern char** environ;

namespace ls::render {
namespace {

tl::unexpected<Error> no_program(const std::string& what, int error) {
  return fail(Errc::internal, fmt::format("cannot read OpenVDB files: {}: {}", what, std::strerror(error)));
}

// An open file descriptor, closed by the destructor.
struct Descriptor {
  explicit Descriptor(int opened) : fd(opened) {}
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  const int fd;
};

// The environment of the child process: only the variables that the loader and the sanitizers need, so that
// no secrets are passed to it.
std::vector<char*> environment() {
  std::vector<char*> kept;
  for (char** e = environ; *e; ++e) {
    const std::string_view variable(*e), name = variable.substr(0, variable.find('='));
    if (name.starts_with("LD_") || name.starts_with("MALLOC_") || name.ends_with("SAN_OPTIONS"))
      kept.push_back(*e);
  }
  kept.push_back(nullptr);
  return kept;
}

// Runs the program and returns its exit status. The program inherits the file descriptor `reply` as
// kVdbReplyFd.
Result<int> run(const std::filesystem::path& program, std::vector<std::string> arguments, int reply) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  int error = posix_spawn_file_actions_adddup2(&actions, reply, kVdbReplyFd);
  for (const int standard : {0, 1})
    if (error == 0) error = posix_spawn_file_actions_addopen(&actions, standard, "/dev/null", O_RDWR, 0);
  if (error == 0) error = posix_spawn_file_actions_addclosefrom_np(&actions, kVdbReplyFd + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, all;
  sigemptyset(&none), sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  pid_t pid = -1;
  if (error == 0)
    error = ::posix_spawn(&pid, program.c_str(), &actions, &attributes, argv.data(), environment().data());
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) return no_program(program.string(), error);
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0)
    if (errno != EINTR) return no_program("waitpid", errno);
  return status;
}

tl::unexpected<Error> how_it_ended(int status) {
  if (!WIFSIGNALED(status))
    return fail(Errc::internal,
                fmt::format("the program that reads OpenVDB files ended with code {}", WEXITSTATUS(status)));
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

}  // namespace

VdbFile::VdbFile(VdbFile&& from) noexcept
    : grid_(std::exchange(from.grid_, {})),
      mapped_(std::exchange(from.mapped_, nullptr)),
      mapped_bytes_(from.mapped_bytes_),
      taken_(std::move(from.taken_)) {}

VdbFile::~VdbFile() {
  if (mapped_) ::munmap(mapped_, mapped_bytes_);
}

std::filesystem::path VdbFile::program_beside_us() {
  std::error_code unknown;
  return std::filesystem::read_symlink("/proc/self/exe", unknown).parent_path() / "lightshaft-vdb";
}

Result<VdbFile> VdbFile::read(const std::filesystem::path& path, const std::string& grid_name,
                              std::uint64_t max_values, const std::filesystem::path& program) {
  const Descriptor reply(::memfd_create("lightshaft-vdb", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (reply.fd < 0) return no_program("memfd_create", errno);
  const auto status = run(
      program,
      {program.string(), path.string(), grid_name, std::to_string(max_values), std::to_string(data_left())},
      reply.fd);
  if (!status) return tl::unexpected(status.error());
  if (!WIFEXITED(*status) || WEXITSTATUS(*status) != 0) return how_it_ended(*status);

  // Processes that the program left behind may still have the reply open. So it is sealed against changes
  // before it is read, and rejected if that fails.
  if (::fcntl(reply.fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE) != 0) return vdb_nonsense();
  struct stat written {};
  if (::fstat(reply.fd, &written) != 0) return no_program("fstat", errno);
  const auto bytes = static_cast<std::uint64_t>(written.st_size);
  if (bytes == 0) return vdb_nonsense();
  VdbFile file;
  file.mapped_bytes_ = bytes;
  void* mapped = ::mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE, reply.fd, 0);
  if (mapped == MAP_FAILED) return no_program("mmap", errno);
  file.mapped_ = mapped;
  file.taken_ = DataTaken(bytes);
  const auto grid = validated_grid({static_cast<const std::byte*>(mapped), bytes}, max_values);
  if (!grid) return tl::unexpected(grid.error());
  file.grid_ = *grid;
  return file;
}

}  // namespace ls::render

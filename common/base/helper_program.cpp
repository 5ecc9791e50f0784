#include "common/base/helper_program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

extern char** environ;

namespace ls {
namespace {

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

}  // namespace

std::filesystem::path program_beside_us(std::string_view name) {
  std::error_code unknown;
  return std::filesystem::read_symlink("/proc/self/exe", unknown).parent_path() / name;
}

Descriptor::~Descriptor() {
  if (fd >= 0) ::close(fd);
}

Result<int> run_helper(const std::filesystem::path& program, std::vector<std::string> arguments, int shared) {
  arguments.insert(arguments.begin(), program.string());
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  int error = posix_spawn_file_actions_adddup2(&actions, shared, kHelperFd);
  for (const int standard : {0, 1})
    if (error == 0) error = posix_spawn_file_actions_addopen(&actions, standard, "/dev/null", O_RDWR, 0);
  if (error == 0) error = posix_spawn_file_actions_addclosefrom_np(&actions, kHelperFd + 1);
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
  if (error != 0) return fail(Errc::internal, fmt::format("{}: {}", program.string(), std::strerror(error)));
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0)
    if (errno != EINTR) return fail(Errc::internal, fmt::format("waitpid: {}", std::strerror(errno)));
  return status;
}

}  // namespace ls

#include "common/base/helper_program.h"

#include <unistd.h>

#include <utility>

#include "common/base/spawn.h"

namespace ls {
namespace {

// Returns true for variables that the loader, the allocator and the sanitizers read.
bool inherits(std::string_view variable) {
  const std::string_view name = variable.substr(0, variable.find('='));
  return name.starts_with("LD_") || name.starts_with("MALLOC_") || name.ends_with("SAN_OPTIONS");
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
  const auto pid =
      spawn({program.string(), std::move(arguments), {kDevNull, kDevNull, STDERR_FILENO, shared}, inherits});
  if (!pid) return fail(Errc::internal, pid.error().message);
  return wait_for_end(*pid);
}

}  // namespace ls

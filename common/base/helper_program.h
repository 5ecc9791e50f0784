// Runs helper programs, which are installed beside this one. They use third-party libraries that may crash,
// hang or take too much memory: reading OpenVDB files, denoising. They share memory with this program through
// one inherited file.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"

namespace ls {

// The file descriptor of the shared file in the helper program.
inline constexpr int kHelperFd = 3;

// Returns the path of a program in the folder of the running executable.
std::filesystem::path program_beside_us(std::string_view name);

// An open file descriptor, closed by the destructor.
class Descriptor {
 public:
  explicit Descriptor(int opened) : fd(opened) {}
  ~Descriptor();
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  const int fd;
};

// Runs the program, waits for its end, and returns its wait status, as waitpid() gives it. The program
// inherits only two files: `shared` as kHelperFd, and standard error. Of the environment it inherits only
// the variables that the loader, the allocator and the sanitizers read, so that it gets no secrets.
// internal: it could not be started.
Result<int> run_helper(const std::filesystem::path& program, std::vector<std::string> arguments, int shared);

}  // namespace ls

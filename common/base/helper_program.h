// Runs the programs that are installed beside ours and do work that may crash, hang or take too much memory
// in a library that is not ours: reading OpenVDB files, denoising. They share memory with us through one
// file that they inherit.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"

namespace ls {

// The number under which a helper finds the file that it shares with us.
inline constexpr int kHelperFd = 3;

// The path of a program in the folder of the running executable.
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
// inherits `shared` as kHelperFd and no other file but standard error, and of the environment only what the
// loader and the sanitizers read, so that no secrets are passed to it. internal: it could not be started.
Result<int> run_helper(const std::filesystem::path& program, std::vector<std::string> arguments, int shared);

}  // namespace ls

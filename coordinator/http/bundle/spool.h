// Buffers a request's body on disk, in an unnamed file that disappears with the Spool object or the process.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "common/base/error.h"

namespace ls::http {

class Spool {
 public:
  // Creates the file in `folder`, which is created if it is missing. An empty path means the system's folder
  // for temporary files.
  static Result<Spool> open(const std::filesystem::path& folder);
  ~Spool();
  Spool(Spool&& other) noexcept;
  Spool& operator=(Spool&&) = delete;

  Result<void> append(std::span<const std::byte> bytes);  // resource_exhausted: the disk is full
  int fd() const { return fd_; }
  std::uint64_t size() const { return size_; }

 private:
  explicit Spool(int fd) : fd_(fd) {}
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace ls::http

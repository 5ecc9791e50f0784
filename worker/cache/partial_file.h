// The file of a blob in transfer (a partial file): bytes are appended to it while their digest is computed. A
// transfer continues after the bytes that an earlier attempt left in the file. The file is locked, so that
// two workers that share a folder cannot write to the same file.
//
// Errors: resource_exhausted if the disk is full, internal if this machine cannot write or read for another
// reason.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "common/base/digest.h"
#include "common/base/error.h"

namespace ls::worker {

// Makes an error from errno after an operation on `path` failed: resource_exhausted if the disk is full, else
// internal.
tl::unexpected<Error> io_error(const std::string& what, const std::filesystem::path& path);

class PartialFile {
 public:
  // Opens or creates the file at `path` and reads the bytes that are in it already, to compute their digest.
  // If another process is writing that file, creates a different file for this transfer.
  static Result<PartialFile> open(const std::filesystem::path& path);
  PartialFile(PartialFile&&) noexcept;
  PartialFile& operator=(PartialFile&&) = delete;
  ~PartialFile();

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  Result<void> append(std::span<const std::byte> bytes);
  // Checks the digest, syncs the file and moves it to `place`. Returns false if `place` already has a file,
  // which is kept, since it may be in use. invalid_argument: the digest is not `expected`; the file is
  // removed.
  Result<bool> finish(const Digest& expected, const std::filesystem::path& place);
  void discard();

 private:
  PartialFile(std::filesystem::path path, int fd) : path_(std::move(path)), fd_(fd) {}
  static Result<PartialFile> open_own(const std::filesystem::path& path);
  Result<void> read_existing();

  std::filesystem::path path_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
  Sha256 hash_;
};

}  // namespace ls::worker

// A blob in transfer: bytes are appended to a separate file while their digest is computed; resumes from the
// bytes of an earlier attempt. The file is locked, so that two workers on one folder cannot write to the same
// one.
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

// Error for errno on `path`: resource_exhausted if the disk is full, else internal.
tl::unexpected<Error> io_error(const std::string& what, const std::filesystem::path& path);

class PartialFile {
 public:
  // Reads the bytes that exist already. If another process is writing the same blob, starts a new file of its
  // own.
  static Result<PartialFile> open(const std::filesystem::path& path);
  PartialFile(PartialFile&&) noexcept;
  PartialFile& operator=(PartialFile&&) = delete;
  ~PartialFile();

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  Result<void> append(std::span<const std::byte> bytes);
  // Verifies, syncs and moves the file to its final place. false: a file was already there and is kept, as it
  // may be in use. invalid_argument: the digest differs; the file is removed.
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

// The one door to libarchive: a zip, or a tar (plain or gzip), as a row of entries whose bytes stream. Knows
// nothing of what a bundle may contain; only that damaged archives are errors and that no archive makes it
// hold more than a bounded amount of memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>

#include "common/base/error.h"

namespace ls::http {

enum class ArchiveKind { zip, tar };

struct ArchiveEntry {
  enum class Kind { file, folder, link, other };
  std::string name;  // as written in the archive; may be anything, or not be UTF-8
  Kind kind = Kind::other;
  std::optional<std::uint64_t> bytes;  // announced; what comes may differ only in damaged archives
  bool encrypted = false;
  bool packed_oddly = false;  // by another method than deflate: of a zip
};

class ArchiveReader {
 public:
  // Reads `fd`, a regular file, from its beginning, by offset: the file stays the caller's, and so does its
  // position. invalid_argument: this is no such archive. A stop ends any later call with `unavailable`.
  static Result<ArchiveReader> open(int fd, ArchiveKind kind, std::stop_token stop);
  ~ArchiveReader();
  ArchiveReader(ArchiveReader&&) noexcept;

  // Nothing: the archive's end, which is there and not only where the file ends. The entry before has been
  // read to its end.
  Result<std::optional<ArchiveEntry>> next();
  // The entry's next bytes; 0: its end, and its checksum, if there is one, was right.
  Result<std::size_t> read(std::span<std::byte> into);

 private:
  struct State;
  explicit ArchiveReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace ls::http

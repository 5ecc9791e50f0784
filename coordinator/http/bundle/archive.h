// The only user of libarchive: reads a zip, or a tar (plain or gzip), as a sequence of entries whose bytes
// stream. Knows nothing about bundles; it only guarantees that damaged archives are errors and that memory
// stays bounded.
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
  std::string name;  // as in the archive; any bytes, possibly not UTF-8
  Kind kind = Kind::other;
  std::optional<std::uint64_t> bytes;  // as announced; differs from the actual size only in damaged archives
  bool encrypted = false;
  bool packed_oddly = false;  // zip: compressed by another method than deflate
};

class ArchiveReader {
 public:
  // Reads `fd`, a regular file, from its beginning, by offset: the caller keeps the file, and its position
  // does not change. invalid_argument: no such archive. After a stop request any later call fails with
  // `unavailable`.
  static Result<ArchiveReader> open(int fd, ArchiveKind kind, std::stop_token stop);
  ~ArchiveReader();
  ArchiveReader(ArchiveReader&&) noexcept;

  // Requires that the previous entry was read to its end. nullopt: the archive's end marker (a file that
  // merely ends is an error).
  Result<std::optional<ArchiveEntry>> next();
  // Reads the entry's next bytes; 0: its end, and its checksum, if any, was right.
  Result<std::size_t> read(std::span<std::byte> into);

 private:
  struct State;
  explicit ArchiveReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace ls::http

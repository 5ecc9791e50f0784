// ArchiveReader reads a zip, or a tar (plain or gzip), entry by entry, and each entry's bytes piece by piece.
// Only archive.cpp uses libarchive. A damaged archive gives an error, and memory stays bounded. What a bundle
// may contain is checked in bundle.h, not here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>

#include "core/base/error.h"

namespace ls::http {

enum class ArchiveKind { zip, tar };

struct ArchiveEntry {
  enum class Kind { file, folder, link, other };
  std::string name;  // as in the archive: any bytes, which may be invalid UTF-8
  Kind kind = Kind::other;
  // Size announced in the header; it differs from the actual size only in damaged archives
  std::optional<std::uint64_t> bytes;
  bool encrypted = false;
  bool packed_oddly = false;  // true for an entry of a zip that is compressed, but not by deflate
};

class ArchiveReader {
 public:
  // Opens the archive in `fd`, a regular file that the caller keeps open. The file's position does not
  // change, since it is read by offset (pread). invalid_argument: the file is not an archive of this kind.
  // After a stop request through `stop` every later call of the reader fails with `unavailable`.
  static Result<ArchiveReader> open(int fd, ArchiveKind kind, std::stop_token stop);
  ~ArchiveReader();
  ArchiveReader(ArchiveReader&&) noexcept;

  // Moves to the next entry; the previous one must have been read to its end. nullopt: the end marker of the
  // archive has been reached. A file that ends without an end marker is an error.
  Result<std::optional<ArchiveEntry>> next();
  // Reads the next bytes of the current entry and returns their number. 0: the entry has ended, and its
  // checksum, if it has one, is right.
  Result<std::size_t> read(std::span<std::byte> into);

 private:
  struct State;
  explicit ArchiveReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace ls::http

// The body of a response that lies in a file. It is sent slice by slice, so that it does not fill memory
// while a slow client reads it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "common/base/error.h"

namespace ls::http {

struct FileBody {
  // Closed with the last copy of the FileBody; readable even after the file's removal.
  std::shared_ptr<const int> fd;
  std::uint64_t size = 0;  // bytes
};

// not_found: there is no such file.
Result<FileBody> open_file_body(const std::filesystem::path& path);

// Reads bytes from `offset` on and returns their number; 0: the file has become shorter, or cannot be read.
std::size_t read_slice(const FileBody& file, std::uint64_t offset, std::span<std::byte> into);

}  // namespace ls::http

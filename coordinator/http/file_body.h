// A body that lies in a file: sent slice by slice, so that no slow reader keeps it in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "common/base/error.h"

namespace ls::http {

struct FileBody {
  std::shared_ptr<const int> fd;  // closed with the last copy; goes on though the file is removed
  std::uint64_t size = 0;         // bytes
};

// not_found: there is no such file.
Result<FileBody> open_file_body(const std::filesystem::path& path);

// Bytes read into `into`, from `offset` on; 0: the file is shorter than it was, or cannot be read.
std::size_t read_slice(const FileBody& file, std::uint64_t offset, std::span<std::byte> into);

}  // namespace ls::http

// NanoVDB files (.nvdb) of ABI 32, as NanoVDB of OpenVDB 9 to 11 writes them. Read here, byte by byte with
// every offset checked: NanoVDB's own reader trusts the file. A grid is a buffer that its nodes point around
// in, compressed as a whole by nothing, zlib or Blosc; layout by PNanoVDB.h, the library's portable
// description.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "worker/render/vdb_module.h"

namespace ls::render {

bool is_nvdb(const std::filesystem::path& path);  // by its first bytes

// As ls_vdb_read, but throws Refused and std::bad_alloc; out.values is then to be freed all the same.
void read_nvdb(const std::filesystem::path& path, const std::string& wanted, std::uint64_t max_values,
               LsVdbGrid& out);

// Of its parts: the bytes of a file, and a grid's buffer into values. `name` for messages.
void decode_nvdb(std::span<const std::byte> file, const std::string& wanted, std::uint64_t max_values,
                 LsVdbGrid& out);
void expand_nvdb(const std::string& name, std::span<const std::byte> buffer, std::uint64_t max_values,
                 LsVdbGrid& out);

}  // namespace ls::render

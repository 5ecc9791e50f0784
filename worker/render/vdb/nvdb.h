// Reader of NanoVDB files (.nvdb) of ABI 32, as written by NanoVDB of OpenVDB 9 to 11. Every offset is
// checked, because NanoVDB's own reader trusts the file. A grid is a buffer with offsets between its nodes,
// stored as a whole uncompressed, with zlib or with Blosc; layout by PNanoVDB.h, the library's portable
// description.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "worker/render/media/vdb_module.h"

namespace ls::render {

bool is_nvdb(const std::filesystem::path& path);  // decided by its first bytes

// Like ls_vdb_read, but throws Refused and std::bad_alloc; out.values must be freed even then.
void read_nvdb(const std::filesystem::path& path, const std::string& wanted, std::uint64_t max_values,
               LsVdbGrid& out);

// Its two steps: from the bytes of a file, and from a grid's buffer to values. `name` is for messages.
void decode_nvdb(std::span<const std::byte> file, const std::string& wanted, std::uint64_t max_values,
                 LsVdbGrid& out);
void expand_nvdb(const std::string& name, std::span<const std::byte> buffer, std::uint64_t max_values,
                 LsVdbGrid& out);

}  // namespace ls::render

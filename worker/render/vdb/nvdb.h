// Reader of NanoVDB files (.nvdb) of ABI 32, as written by NanoVDB of OpenVDB 9 to 11. Every offset is
// checked, because NanoVDB's own reader trusts the file. A grid is a buffer with offsets between its nodes.
// It is stored as a whole: uncompressed, or compressed by zlib or Blosc. The layout follows PNanoVDB.h, the
// library's portable description of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "worker/render/media/vdb_module.h"

namespace ls::render {

bool is_nvdb(const std::filesystem::path& path);  // true for an .nvdb file, decided by its first bytes

// Reads the grid `wanted` like ls_vdb_read(), but reports failure by throwing Refused or std::bad_alloc. The
// caller must free out.values even then.
void read_nvdb(const std::filesystem::path& path, const std::string& wanted, std::uint64_t max_values,
               LsVdbGrid& out);

// The two steps of read_nvdb(): decode_nvdb() finds the wanted grid in the bytes of a file, decompresses it
// and calls expand_nvdb(), which turns the buffer of a grid into values. `name` is for messages.
void decode_nvdb(std::span<const std::byte> file, const std::string& wanted, std::uint64_t max_values,
                 LsVdbGrid& out);
void expand_nvdb(const std::string& name, std::span<const std::byte> buffer, std::uint64_t max_values,
                 LsVdbGrid& out);

}  // namespace ls::render

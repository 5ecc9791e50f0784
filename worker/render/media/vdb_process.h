// Reads grids of .vdb and .nvdb files in a separate program, lightshaft-vdb, installed beside the
// executable. OpenVDB trusts its input: a damaged or malicious file may make it crash, loop or write out of
// bounds. In a separate process without secrets this leads only to an error message. The memory of the
// process and its reply count towards the caller's limit. The separate process also keeps OpenVDB from being
// mapped into the renderer, which would take 30 ms and 29 MB.
//
// The child process that reads a file may use as much memory as remains of this process's limit
// (RLIMIT_DATA). Its reply is a mapped file, which the kernel does not count towards that limit, so this
// process lowers its limit by the size of the file while the file is mapped.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "core/base/error.h"
#include "core/base/spawn.h"
#include "worker/render/media/vdb_reply.h"

namespace ls::render {

// Returns the number of bytes that this process may still allocate under its limit RLIMIT_DATA; kNoDataLimit
// if there is no limit.
std::uint64_t data_left();

class VdbFile {
 public:
  // Reads the grid `grid_name` of the file `path`. If grid_name is empty, it reads the only grid, or the grid
  // "density" if there are several. Fails with invalid_argument if the file is at fault; with
  // resource_exhausted if the grid's bricks take more than max_bytes or another limit (memory, time) is
  // exceeded; and with internal if the program could not be started or ended with an error code.
  static Result<VdbFile> read(const std::filesystem::path& path, const std::string& grid_name,
                              std::uint64_t max_bytes,
                              const std::filesystem::path& program = program_beside_us("lightshaft-vdb"));
  // The grid's shape, which is valid: its sizes are at least 1, and its transform is finite.
  const VdbShape& shape() const { return grid_.shape; }
  // The values of a channel, which are finite and not negative. They remain where the program has written
  // them, which is memory that is freed with the last of these and this object.
  Bricks channel(int c) const {
    return {shape().size_of_box(), shape().lead_of_box(), grid_.channels[static_cast<std::size_t>(c)],
            mapped_};
  }

 private:
  VdbFile() = default;

  VdbView grid_;
  std::shared_ptr<const void> mapped_;
};

}  // namespace ls::render

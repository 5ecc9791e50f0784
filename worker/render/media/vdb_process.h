// Reads grids of .vdb and .nvdb files in a separate program, lightshaft-vdb, installed beside the executable.
// OpenVDB trusts its input: a damaged or malicious file may crash it, keep it busy or make it write out of
// bounds. In a separate process, which holds nothing of value, that merely gives an error message; its memory
// and its reply count towards the caller's limit. It also keeps OpenVDB from being mapped into the renderer
// (30 ms, 29 MB).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "common/base/error.h"
#include "worker/render/media/vdb_limit.h"
#include "worker/render/media/vdb_module.h"

namespace ls::render {

class VdbFile {
 public:
  // The grid of this name; with an empty name the only grid, or "density". invalid_argument: the file is at
  // fault; resource_exhausted: a limit is exceeded; internal: the program could not be started.
  static Result<VdbFile> read(const std::filesystem::path& path, const std::string& grid_name,
                              std::uint64_t max_values,
                              const std::filesystem::path& program = program_beside_us());
  static std::filesystem::path program_beside_us();
  VdbFile(VdbFile&& from) noexcept;
  VdbFile& operator=(VdbFile&&) = delete;
  ~VdbFile();

  // Sizes are at least 1, values finite and not negative, the transform finite.
  const LsVdbGrid& grid() const { return grid_; }

 private:
  VdbFile() = default;

  LsVdbGrid grid_{};
  void* mapped_ = nullptr;
  std::uint64_t mapped_bytes_ = 0;
  DataTaken taken_;
};

}  // namespace ls::render

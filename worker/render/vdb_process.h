// Grids of .vdb and .nvdb files, read by a program of their own, lightshaft-vdb, which stands beside the
// executable. OpenVDB trusts the files that it reads: one that is damaged, or made to harm, may crash it,
// keep it busy or make it write where it must not. Here that costs a process without anything in it and gives
// an error with a text; its memory and its reply count towards the limit of who reads. Nor is OpenVDB ever
// mapped (30 ms, 29 MB) by what renders.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "common/base/error.h"
#include "worker/render/vdb_limit.h"
#include "worker/render/vdb_module.h"

namespace ls::render {

class VdbFile {
 public:
  // The grid of this name; without a name the only one, or "density". invalid_argument: the file is at fault;
  // resource_exhausted: a limit; internal: the program could not be started.
  static Result<VdbFile> read(const std::filesystem::path& path, const std::string& grid_name,
                              std::uint64_t max_values,
                              const std::filesystem::path& program = program_beside_us());
  static std::filesystem::path program_beside_us();
  VdbFile(VdbFile&& from) noexcept;
  VdbFile& operator=(VdbFile&&) = delete;
  ~VdbFile();

  // Its sizes are 1 at least, its values finite and not negative, its transform finite.
  const LsVdbGrid& grid() const { return grid_; }

 private:
  VdbFile() = default;

  LsVdbGrid grid_{};
  void* mapped_ = nullptr;
  std::uint64_t mapped_bytes_ = 0;
  DataTaken taken_;
};

}  // namespace ls::render

#include "cli/local/partial_dir.h"

#include <fmt/format.h>

#include <fstream>

#include "cli/output/output_file.h"

namespace ls::cli {

namespace fs = std::filesystem;

Result<PartialDir> PartialDir::open(fs::path folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    return fail(Errc::unavailable,
                fmt::format("--partial-dir {} cannot be made: {}", folder.string(), error.message()));
  if (auto ok = check_folder("--partial-dir", folder); !ok) return tl::unexpected(ok.error());
  return PartialDir(std::move(folder));
}

fs::path PartialDir::path(TileIndex tile, RoundIndex round) const {
  return folder_ / fmt::format("tile-{:06}-round-{:05}.exr", tile, round);
}

Result<void> PartialDir::keep(const UnitResult& result) {
  const fs::path file = path(result.unit.tile, result.unit.round);
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(result.exr.data()),
            static_cast<std::streamsize>(result.exr.size()));
  out.close();
  if (!out) return fail(Errc::resource_exhausted, fmt::format("{} cannot be written", file.string()));
  kept_.emplace_back(result.unit.tile, result.unit.round);
  return {};
}

Result<void> PartialDir::drop_unfolded(std::span<const RoundIndex> folded) {
  for (const auto& [tile, round] : kept_) {
    if (tile < folded.size() && round < folded[tile]) continue;
    std::error_code error;
    fs::remove(path(tile, round), error);
    if (error)
      return fail(Errc::unavailable,
                  fmt::format("{} cannot be removed: {}", path(tile, round).string(), error.message()));
  }
  return {};
}

}  // namespace ls::cli

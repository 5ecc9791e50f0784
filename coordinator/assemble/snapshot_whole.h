// Reads snapshots of earlier versions, which are all in one piece: {"LSSNAP1\n", format, film, error sums,
// health}, closed by a SHA-256. They are no longer written.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "coordinator/assemble/assembly.h"

namespace ls::coordinator {

inline constexpr std::string_view kWholeSnapshotMagic = "LSSNAP1\n";

std::optional<Assembly> load_whole_snapshot(const std::filesystem::path& path, const TileGrid& grid,
                                            bool keep_relative, std::string_view format, AovSet aovs);

}  // namespace ls::coordinator

// Stores every unit's partial EXR of a render in a folder, for `lightshaft merge`.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/base/error.h"
#include "common/protocol/messages.h"

namespace ls::cli {

class PartialDir {
 public:
  // Creates the folder. Files of earlier renders stay, except those of the same tile and round, which are
  // replaced.
  static Result<PartialDir> open(std::filesystem::path folder);

  Result<void> keep(const UnitResult& result);
  // Removes stored rounds that the image does not contain: a tile that reached the target error has units
  // that were rendered ahead and dropped. `folded`: rounds of each tile.
  Result<void> drop_unfolded(std::span<const RoundIndex> folded);

  std::filesystem::path path(TileIndex tile, RoundIndex round) const;

 private:
  explicit PartialDir(std::filesystem::path folder) : folder_(std::move(folder)) {}
  std::filesystem::path folder_;
  std::vector<std::pair<TileIndex, RoundIndex>> kept_;
};

}  // namespace ls::cli

// Stores the partial (the pixel sums) of every unit of a render as an EXR file in a folder, for `lightshaft
// merge`. A unit is one tile and one round (range of samples).
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
  // Creates the folder if it is missing. Files of earlier renders stay, except those of the same tile and
  // round, which are replaced.
  static Result<PartialDir> open(std::filesystem::path folder);

  Result<void> keep(const UnitResult& result);
  // Removes stored rounds that are not part of the image: when a tile reaches the target error, those of its
  // units that were rendered ahead are dropped. `folded` has the number of rounds of each tile that are part
  // of the image.
  Result<void> drop_unfolded(std::span<const RoundIndex> folded);

  std::filesystem::path path(TileIndex tile, RoundIndex round) const;

 private:
  explicit PartialDir(std::filesystem::path folder) : folder_(std::move(folder)) {}
  std::filesystem::path folder_;
  std::vector<std::pair<TileIndex, RoundIndex>> kept_;
};

}  // namespace ls::cli

// Folds the partials of an image (files with the pixel sums of one tile and range of samples) into a film,
// exactly as the coordinator does; for `lightshaft merge`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/image/film/film.h"
#include "common/image/film/partial.h"

namespace ls {

struct PartialSource {
  std::string name;                                      // name for messages
  std::function<Result<std::vector<std::byte>>()> read;  // reads the file; may be called twice
};

struct Merged {
  Film film;
  Digest scene, settings, numeric_class;
  std::uint64_t duplicates = 0;  // number of equal partials that were dropped
};

// Groups the partials by tile and folds those of a tile in the order of their first sample (s0). If a tile
// has both a full and a truncated version of a round (range of samples), the full one is used. Only the
// pixels of one partial are in memory at a time. These are errors, which name the files: partials of
// different scenes, settings or numeric classes (machines of one class compute the same bits); frames or AOVs
// that differ; tiles that do not fit one tiling; gaps and overlaps in a tile's samples; different partials of
// the same range; tiles of the frame without a partial.
Result<Merged> merge_partials(const std::vector<PartialSource>& sources);

}  // namespace ls

// Folds partial files exactly as the coordinator does: `lightshaft merge`.
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
  std::string name;                                      // for the messages
  std::function<Result<std::vector<std::byte>>()> read;  // may be called twice
};

struct Merged {
  Film film;
  Digest scene, settings, numeric_class;
  std::uint64_t duplicates = 0;  // equal partials that were dropped
};

// Groups by tile, orders by s0. Rejects, naming the files: partials of different scenes, settings or numeric
// classes; frames or AOVs that differ; tiles that do not fit one tiling; gaps and overlaps in a tile's
// samples; duplicates that differ; tiles of the frame without a partial. Of a cut round and its full one,
// uses the full one. Holds one partial's pixels at a time.
Result<Merged> merge_partials(const std::vector<PartialSource>& sources);

}  // namespace ls

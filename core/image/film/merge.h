// Adds partials to a film, exactly as the coordinator does. `lightshaft merge` uses it. A partial is a file
// with the pixel sums of one tile and one round.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/image/film/film.h"
#include "core/image/film/partial.h"

namespace ls {

struct PartialSource {
  std::string name;                                      // name of the file, for messages
  std::function<Result<std::vector<std::byte>>()> read;  // reads the file; may be called twice
};

struct Merged {
  Film film;
  Digest scene, settings, numeric_class;
  std::uint64_t duplicates = 0;  // number of partials that were dropped because an equal one was given
};

// Groups the partials by tile. The partials of a tile are added in the order of their first samples. If there
// are several versions of a round, the longest one is used. Besides the film, only the pixels of one partial
// are in memory at a time. Errors, whose messages name the files: the partials have different scenes,
// settings, frame sizes, AOVs or numeric classes; their rectangles are not tiles of one tiling; the samples
// of a tile have gaps or overlaps; two partials of the same tile and range differ; a tile of the frame has no
// partial.
Result<Merged> merge_partials(const std::vector<PartialSource>& sources);

}  // namespace ls

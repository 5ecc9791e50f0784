// A final EXR of ours, read back: its pixels and what it says of itself, so that it can be rendered again and
// compared. The file is somebody's: sizes are bounded, headers and layers must be what final_exr() writes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/image/film.h"
#include "common/image/final_image.h"
#include "common/image/frame.h"
#include "common/job/settings.h"

namespace ls {

struct SealedImage {
  FinalPicture picture;
  Digest scene, numeric_class;
  RenderSettings settings;
  std::string build;
  std::vector<Digest> tiles;  // one per tile, see Film::tile_digest

  TileGrid grid() const { return {picture.size, settings.tile}; }
};

// invalid_argument: what is missing or wrong, by the name of the header or layer.
Result<SealedImage> read_sealed_image(FinalPicture picture, const std::string& name);

// How many samples the tile's pixels say they have. invalid_argument: they do not agree.
Result<std::uint64_t> tile_samples(const SealedImage& image, TileIndex tile);

// The first value of the tile that is not the film's, as final_exr() would store it; in the order of layers.
// Where the image lacks the whole layer, that of the tile's first pixel.
struct PixelDifference {
  int x = 0, y = 0;
  std::string layer;
};
std::optional<PixelDifference> first_difference(const SealedImage& image, const Film& film, TileIndex tile);

}  // namespace ls

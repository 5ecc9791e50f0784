// A final EXR of ours, read back with its provenance, so that it can be rendered again and compared. The file
// is untrusted: sizes are bounded, headers and layers must be as final_exr() writes them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/image/exr/final_image.h"
#include "common/image/film/film.h"
#include "common/image/frame/frame.h"
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

// invalid_argument: names the header or layer that is missing or wrong.
Result<SealedImage> read_sealed_image(FinalPicture picture, const std::string& name);

// The tile's number of samples according to its pixels. invalid_argument: they disagree.
Result<std::uint64_t> tile_samples(const SealedImage& image, TileIndex tile);

// The tile's first value that differs from what final_exr() would store for the film, in the order of layers.
// If the image lacks a whole layer, its first pixel in the tile.
struct PixelDifference {
  int x = 0, y = 0;
  std::string layer;
};
std::optional<PixelDifference> first_difference(const SealedImage& image, const Film& film, TileIndex tile);

}  // namespace ls

// Reads a final EXR of this program with its provenance, so that it can be rendered again and compared. The
// file is untrusted: sizes are limited, and headers and layers must have the form that final_exr() writes.
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
  std::vector<Digest> tiles;  // one per tile: Film::tile_digest

  TileGrid grid() const { return {picture.size, settings.tile}; }
};

// Checks the headers and layers of the image. invalid_argument: one is missing or wrong; the message names
// it.
Result<SealedImage> read_sealed_image(FinalPicture picture, const std::string& name);

// Returns the number of samples per pixel of the tile, from the image's layer `spp`. invalid_argument: the
// pixels of the tile have different numbers, or one that this program never renders.
Result<std::uint64_t> tile_samples(const SealedImage& image, TileIndex tile);

// The first value of a tile, in the order of layers, that differs from the value that final_exr() would store
// for the film. If the image lacks a whole layer, it is the first pixel of the tile in this layer.
struct PixelDifference {
  int x = 0, y = 0;
  std::string layer;
};
std::optional<PixelDifference> first_difference(const SealedImage& image, const Film& film, TileIndex tile);

}  // namespace ls

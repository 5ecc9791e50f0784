// Reads a final EXR of this program together with its provenance (scene, settings, build), so that the image
// can be rendered again and compared. The file is untrusted: sizes are limited, and headers and layers must
// have the form that final_exr() writes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/image/exr/final_image.h"
#include "core/image/film/film.h"
#include "core/image/frame/frame.h"
#include "core/job/settings.h"

namespace ls {

struct SealedImage {
  FinalPicture picture;
  Digest scene, numeric_class;
  RenderSettings settings;
  ImageForm form;  // number format and colour space; compression and parts do not matter here
  std::string build;
  // One per tile: Film::tile_digest(), a digest of the results that were added to the tile.
  std::vector<Digest> tiles;

  TileGrid grid() const { return {picture.size, settings.tile, settings.meters > 0}; }
};

// Checks the headers and layers of `picture` and parses its provenance. invalid_argument: a header or layer
// is missing or wrong; the message names it. `name` is the name of the file, for messages.
Result<SealedImage> read_sealed_image(FinalPicture picture, const std::string& name);

// Returns the number of samples per pixel of the tile, from the image's layer `spp`. invalid_argument: the
// pixels of the tile have different numbers of samples, or a number that this program never renders (odd, or
// above kMaxSpp).
Result<std::uint64_t> tile_samples(const SealedImage& image, TileIndex tile);

// The place of a difference: a pixel and a layer. first_difference() compares a tile of the image with the
// values that final_exr() would store for `film`, layer by layer, and returns the first value that differs.
// If the image lacks a layer, it returns the first pixel of the tile in that layer. nullopt: the tile is
// equal.
struct PixelDifference {
  int x = 0, y = 0;
  std::string layer;
};
std::optional<PixelDifference> first_difference(const SealedImage& image, const Film& film, TileIndex tile);

}  // namespace ls

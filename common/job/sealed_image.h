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
  FrameSize size;
  std::vector<float> rgb;          // interleaved, row by row, as stored
  std::vector<float> error;        // standard errors of those, likewise
  std::vector<std::uint32_t> spp;  // samples of each pixel
  bool half = false;               // colours are stored as halves
  Digest scene, numeric_class;
  RenderSettings settings;
  std::string build;
  std::vector<Digest> tiles;  // one per tile, see Film::tile_digest

  TileGrid grid() const { return {size, settings.tile}; }
};

// invalid_argument: what is missing or wrong, by the name of the header or layer.
Result<SealedImage> read_sealed_image(std::span<const std::byte> exr, const std::string& name);

// How many samples the tile's pixels say they have. invalid_argument: they do not agree.
Result<std::uint64_t> tile_samples(const SealedImage& image, TileIndex tile);

// The first pixel of the tile whose colour, or else its standard error, is not that of the film, as
// final_exr() would store it.
struct PixelDifference {
  int x = 0, y = 0;
  std::string what;  // "colour" or "standard error"
};
std::optional<PixelDifference> first_difference(const SealedImage& image, const TilePixels& tile);

}  // namespace ls

// The layers of a film as rectangles of numbers at a mip level, for viewers that request only the visible
// part.
//
// Level 0 is the image. A pixel of level L represents a block of 2^L x 2^L pixels of the image (fewer at the
// right and bottom edges). Pixels without samples are left out. If no pixel of the block has samples, the
// value is NaN, or 0 for identifiers.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"
#include "common/image/film/film.h"

namespace ls {

// How the pixels of a block are combined.
enum class BlockRule {
  mean,              // for values
  error_of_mean,     // for standard errors: the standard error of the mean of the block
  root_mean_square,  // for relative errors
  first              // for identifiers, which have no mean: the first pixel's, row by row
};
std::string_view to_string(BlockRule rule);

struct PixelLayer {
  std::string name;
  std::vector<std::string> channels;
  BlockRule rule = BlockRule::mean;
  bool half = true;        // true if values are half floats; identifiers are floats
  std::optional<Aov> aov;  // nullopt: the layer is computed from the colour
};
// Returns the layers: "rgb", "stderr" (the standard error of each value of rgb), "error" (the relative
// standard error of the pixel: the square root of the mean over channels of stderr^2 / (rgb^2 + 0.01)),
// "spp", and the AOVs by the names of their layers in the final EXR.
std::vector<PixelLayer> pixel_layers(AovSet aovs);
// Returns the layer of this name. invalid_argument: there is no such layer; the message lists the layers.
Result<PixelLayer> pixel_layer(AovSet aovs, std::string_view name);

// Limits of one request: pixels per side of the answer, and pixels of the image that the answer represents.
inline constexpr int kMaxLayerSide = 512;
inline constexpr std::int64_t kMaxLayerPixels = std::int64_t{1} << 20;
inline constexpr int kMaxLayerLevel =
    10;  // at this level one pixel represents kMaxLayerPixels pixels of the image

FrameSize level_size(FrameSize frame, int level);
// Returns the pixels of the image that a rectangle of a mip level represents.
PixelRect rect_in_image(FrameSize frame, int level, const PixelRect& rect);
// Returns invalid_argument if the rectangle is empty, not inside the level or too large. The message contains
// the bounds.
Result<void> check_layer_rect(FrameSize frame, int level, const PixelRect& rect);

// The values of one tile, layer by layer.
class TileLayers {
 public:
  // `aovs`: true if layers of AOVs will be requested
  TileLayers(const Film& film, TileIndex tile, bool aovs);
  const PixelRect& rect() const { return colour_.rect; }
  // Returns the channels of each pixel, row by row; empty if the tile has no samples.
  std::vector<float> values(const PixelLayer& layer) const;

 private:
  TilePixels colour_;
  std::optional<TileAovs> aovs_;
  AovPlanes planes_;
};

// A rectangle of a layer at one mip level, assembled from tiles.
class LayerMosaic {
 public:
  LayerMosaic(PixelLayer layer, FrameSize frame, int level, PixelRect rect);
  // Adds pixels of mip level `level`, which must not be above that of the mosaic. Pixels outside the mosaic
  // are ignored. `values`: the channels of each pixel of `rect`, row by row; if it is empty, nothing is
  // added.
  void add(int level, const PixelRect& rect, std::span<const float> values);
  // Returns the channels of each pixel, row by row, as half floats or floats, little endian. Values above
  // 65504 in magnitude, the largest half, are clamped to it.
  std::vector<std::byte> bytes() const;

 private:
  PixelLayer layer_;
  FrameSize frame_;
  int level_;
  PixelRect rect_;
  std::vector<double> sums_, weights_;
};

// Reads the result of LayerMosaic::bytes().
std::vector<float> layer_floats(const PixelLayer& layer, std::span<const std::byte> bytes);

}  // namespace ls

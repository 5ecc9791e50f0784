// The layers of a film as rectangles of numbers at a mip level, for viewers that request only the visible
// part.
//
// Level 0 is the image. A pixel of level L represents a block of 2^L x 2^L pixels of the image (fewer at the
// right and bottom edges). Its value is computed from those pixels of the block that have samples. If no
// pixel of the block has samples, the value is NaN, or 0 for identifiers.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/image/film/film.h"

namespace ls {

// How the value of a block is computed from the values of its pixels.
enum class BlockRule {
  mean,              // mean of the values; used for most layers
  error_of_mean,     // standard error of the mean of the block; used for standard errors
  root_mean_square,  // root of the mean of the squares; used for relative errors
  // value of the first pixel of the block that has samples, in row order; used for identifiers, which have no
  // mean
  first
};
std::string_view to_string(BlockRule rule);

struct PixelLayer {
  std::string name;
  std::vector<std::string> channels;
  BlockRule rule = BlockRule::mean;
  bool half = true;        // true: values are sent as half floats; false: as floats, which identifiers need
  std::optional<Aov> aov;  // the AOV of this layer; nullopt: the layer is computed from the colour
  std::size_t group = 0;   // index of the light group, for an AOV of AovKind::groups
  // True: the values are half the differences between the two halves of the samples (kHalfDifference in
  // final_image.h). With BlockRule::mean these are the half differences of the blocks' means.
  bool difference = false;
};
// Returns the layers of a film with these AOVs: "rgb", "stderr" (the standard error of each value of rgb),
// "error" (the relative standard error of the pixel: the square root of the mean over channels of stderr^2 /
// (rgb^2 + 0.01)), "spp", and each AOV under the name of its layer in the final EXR. `light_groups` are the
// names of the light groups (LayerNames in final_image.h).
std::vector<PixelLayer> pixel_layers(AovSet aovs, std::span<const std::string> light_groups = {});
// Returns the layer of this name. invalid_argument: there is no such layer; the message lists the layers.
Result<PixelLayer> pixel_layer(AovSet aovs, std::string_view name,
                               std::span<const std::string> light_groups = {});

// Limits of one request: kMaxLayerSide is the largest width and height of the answer, in its pixels.
// kMaxLayerPixels is the largest number of pixels of the image that the answer may represent.
inline constexpr int kMaxLayerSide = 512;
inline constexpr std::int64_t kMaxLayerPixels = std::int64_t{1} << 20;
inline constexpr int kMaxLayerLevel =
    10;  // at this level one pixel represents kMaxLayerPixels pixels of the image: (2^10)^2 = 2^20

FrameSize level_size(FrameSize frame, int level);
// Returns the pixels of the image that a rectangle of a mip level represents.
PixelRect rect_in_image(FrameSize frame, int level, const PixelRect& rect);
// Checks a rectangle of a mip level. Returns invalid_argument if it is empty, not inside the level or too
// large. The message contains the bounds.
Result<void> check_layer_rect(FrameSize frame, int level, const PixelRect& rect);

// The values of all layers in one tile.
class TileLayers {
 public:
  // `aovs` must be true if values() will be called for layers of AOVs
  TileLayers(const Film& film, TileIndex tile, bool aovs);
  const PixelRect& rect() const { return colour_.rect; }
  // Returns the values of one layer: all channels of each pixel, row by row; empty if the tile has no
  // samples.
  std::vector<float> values(const PixelLayer& layer) const;

 private:
  TilePixels colour_;
  std::optional<TileAovs> aovs_;
  AovPlanes planes_;
};

// A rectangle of one layer at one mip level, to which tiles add their values.
class LayerMosaic {
 public:
  LayerMosaic(PixelLayer layer, FrameSize frame, int level, PixelRect rect);
  // Adds the pixels `rect` of mip level `level`, which must be at most the level of the mosaic. Pixels
  // outside the mosaic are ignored. `values` has the channels of each pixel of `rect`, row by row; if it is
  // empty, nothing is added.
  void add(int level, const PixelRect& rect, std::span<const float> values);
  // Returns the channels of each pixel, row by row, as half floats or floats (PixelLayer::half), little
  // endian. In half floats, values above 65504 in magnitude, the largest half, are clamped to 65504.
  std::vector<std::byte> bytes() const;

 private:
  PixelLayer layer_;
  FrameSize frame_;
  int level_;
  PixelRect rect_;
  std::vector<double> sums_, weights_;
};

// Decodes the result of LayerMosaic::bytes() to the channels of each pixel, row by row.
std::vector<float> layer_floats(const PixelLayer& layer, std::span<const std::byte> bytes);

}  // namespace ls

// An environment map: light from infinitely far away, whose radiance in each direction is given by an image.
//
// latlong, Mitsuba 3's convention (its plugin `envmap`). In the map's own space +y is up; u, from the left
// edge of the image, and v, from its top, both in [0, 1], correspond to the direction
//
//   d = (sin(2 pi u) sin(pi v), cos(pi v), -cos(2 pi u) sin(pi v)),
//
// seen from the scene: the top row is +y; on the horizon the left edge is -z, u = 1/4 is +x, the middle +z
// and u = 3/4 is -x. to_world maps d to the world. The centre of texel (x, y) is at u = (x + 1/2) / width,
// where columns wrap around, and at v = y / (height - 1): the first and last rows are the poles themselves.
// Between texels radiance is bilinear in u and v.
//
// Sampling. A cell lies between four neighbouring texels. One 32-bit random number (a word) chooses a row of
// cells, and another a cell of the row. The probabilities are proportional to (mean luminance of the corners)
// * (solid angle), rounded to multiples of 2^-32. Within a cell, the density over azimuth and z, the cosine
// of the polar angle, is proportional to l, the bilinear interpolation of the luminances at the corners. So
// the pdf per steradian, in row j and cell i, is
//
//   p(d) = P(j) P(i | j) / (solid angle) * l(x, t) / (mean of l at the corners),
//
// where P are the rounded probabilities, and x (in azimuth) and t = (z_j - z) / (z_j - z_j+1), both from 0 to
// 1, are the position in the cell. sample() has exactly this pdf. It is nearly proportional to the luminance
// of the map: the map is interpolated in the polar angle instead of z, but within a cell one is almost a
// linear function of the other, except next to the poles.
//
// equal_area, pbrt-v4's convention. A direction's place in the square image is that of equal_area.h, and its
// radiance that of the texel there, unfiltered. A cell is a texel, its solid angle 4 pi / texels, and the
// density within it constant.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "core/assets/data.h"
#include "core/base/error.h"
#include "core/scene/scene.h"
#include "worker/render/math/math.h"
#include "worker/render/texture/texels.h"

namespace ls::render {

// The largest environment map, in pixels: 8192 x 4096. Its texels and its table take 16 bytes per pixel.
inline constexpr std::uint64_t kMaxEnvironmentPixels = std::uint64_t{1} << 25;

class EnvironmentMap {
 public:
  // Makes the map from `image`, with radiances multiplied by `scale`. `name` is for messages. Negative values
  // become 0 and are counted. Fails with invalid_argument if a value is not finite or, scaled, exceeds the
  // largest radiance of a sample; if a latlong image has fewer than 2 x 3 pixels or an equal_area image is
  // not square; or if to_world is not composed of rotation, reflection, translation and uniform scale. Fails
  // with resource_exhausted if the image has more than kMaxEnvironmentPixels.
  static Result<EnvironmentMap> build(std::string_view name, ImageData image, double scale,
                                      const Transform& to_world, SkyMapping mapping = SkyMapping::latlong);

  struct Light {
    C3 radiance;
    float pdf;  // density of sample(), per steradian
  };
  // The light that arrives from `direction`, a finite unit vector that points away from the scene.
  Light at(const V3& direction) const;
  // Samples a direction from the random words x and y. The map must not be black.
  V3 sample(std::uint32_t x, std::uint32_t y) const;

  bool black() const { return used_rows_ == 0; }
  // The luminance integrated over all directions, as the sampling table approximates it: the sum over cells
  // of the solid angle times the mean luminance at the corners (in an equal_area map, times the luminance of
  // the texel).
  double flux() const { return flux_; }
  std::uint64_t clamped() const { return texels_.clamped; }
  std::uint64_t bytes() const;

 private:
  struct Row {       // a row of cells
    double top = 1;  // cosine of the polar angle at its upper edge; latlong only
    // Difference of the cosines at its two edges: the solid angle of a cell, divided by 2 pi / width.
    double height = 0;
    float density = 0;  // probability of choosing this row, divided by the solid angle of one cell
    // First of the random words that choose this row. These words end where the next row's words begin.
    std::uint32_t first = 0;
    std::uint32_t used = 0;  // number of cells up to and including the last one that some word chooses
  };
  struct Corners {
    float l00, l10, l01, l11;  // luminances at the corners: upper left, upper right, lower left, lower right
  };

  void build_table();
  double build_row(std::uint32_t row, std::vector<double>& before);
  double cell_luminance(std::uint32_t column, std::uint32_t row) const;
  bool is_square() const { return mapping_ == SkyMapping::equal_area; }
  Light at_square(const V3& d) const;
  V3 within_cell(std::uint32_t column, std::uint32_t row, float u, float v) const;
  std::uint32_t right_of(std::uint32_t x) const { return x + 1 == texels_.width ? 0 : x + 1; }
  Corners corners(std::uint32_t x, std::uint32_t y) const;
  float cell_share(std::uint32_t row, std::uint32_t cell) const;

  Texels texels_;
  float scale_ = 1;
  SkyMapping mapping_ = SkyMapping::latlong;
  Frame frame_;  // axes of the map in the world: a rotation or a reflection
  std::vector<Row> rows_;
  std::vector<std::uint32_t> first_;  // for each cell, row by row, the first of the words that choose it
  std::uint32_t used_rows_ = 0;
  double flux_ = 0;
};

}  // namespace ls::render

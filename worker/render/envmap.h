// An environment map: light from infinitely far away, by direction, from an image in latitude-longitude form.
//
// Mitsuba 3's convention (its plugin `envmap`). In the map's own space +y is up; u, from the left edge of the
// image, and v, from its top, both in [0, 1], belong to the direction
//
//   d = (sin(2 pi u) sin(pi v), cos(pi v), -cos(2 pi u) sin(pi v)),
//
// seen from the scene: the top row is +y; of the horizon the left edge is -z, u = 1/4 is +x, the middle +z
// and u = 3/4 is -x. to_world turns d into the world. The centre of texel (x, y) is at u = (x + 1/2) / width,
// around which columns repeat, and at v = y / (height - 1): the first and the last row are the poles
// themselves. Between texels radiance is bilinear in u and v.
//
// Sampling. A cell is what lies between four neighbouring texels. A row of cells is chosen by one 32-bit word
// and a cell of it by another, each in proportion to (mean luminance of the corners) x (solid angle), rounded
// to whole words; within the cell the density is bilinear between the luminances at its corners, over the
// azimuth and the cosine z of the polar angle. Per steradian it is, in row j and cell i,
//
//   p(d) = words(j) words(i) 2^-64 / solid angle x l(x, t) / mean of l at the corners,
//
// with t = (z_j - z) / (z_j - z_j+1), which is exactly how samples are distributed. As solid angle is uniform
// in z, p is all but proportional to the luminance of the map: only next to the poles do t and v differ.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "common/assets/data.h"
#include "common/base/error.h"
#include "common/scene/scene.h"
#include "worker/render/math.h"
#include "worker/render/texture/texels.h"

namespace ls::render {

// 8192 x 4096: texels and table take 16 bytes a pixel.
inline constexpr std::uint64_t kMaxEnvironmentPixels = std::uint64_t{1} << 25;

class EnvironmentMap {
 public:
  // `name` is for messages. Negative values become 0, counted. invalid_argument: a value that is not finite
  // or (with the scale) larger than samples may be, fewer than 2 x 3 pixels, a to_world that does not just
  // turn, mirror, move and scale; resource_exhausted: more than kMaxEnvironmentPixels.
  static Result<EnvironmentMap> build(std::string_view name, ImageData image, double scale,
                                      const Transform& to_world);

  struct Light {
    C3 radiance;
    float pdf;  // of sample(), per steradian
  };
  // From this direction: a finite unit vector, pointing away from the scene.
  Light at(const V3& direction) const;
  // A direction, from random words. Not of a black map.
  V3 sample(std::uint32_t x, std::uint32_t y) const;

  bool black() const { return used_rows_ == 0; }
  // Luminance over all directions, as the table has it: within each cell by its corners.
  double flux() const { return flux_; }
  std::uint64_t clamped() const { return texels_.clamped; }
  std::uint64_t bytes() const;

 private:
  struct Row {                // of cells
    double top = 1;           // cosine at its upper edge
    double height = 0;        // difference of cosines
    float density = 0;        // share of the words / solid angle of one of its cells
    std::uint32_t first = 0;  // of the words that choose it; up to the next row's
    std::uint32_t used = 0;   // cells up to the last that has a word
  };
  struct Corners {
    float l00, l10, l01, l11;  // luminances: left and right above, then below
  };

  void build_table();
  double build_row(std::uint32_t row, std::vector<double>& before);
  std::uint32_t right_of(std::uint32_t x) const { return x + 1 == texels_.width ? 0 : x + 1; }
  Corners corners(std::uint32_t x, std::uint32_t y) const;
  float cell_share(std::uint32_t row, std::uint32_t cell) const;

  Texels texels_;
  float scale_ = 1;
  Frame frame_;  // the axes of the map in the world: right-handed or mirrored
  std::vector<Row> rows_;
  std::vector<std::uint32_t> first_;  // words that choose a cell of a row, row by row
  std::uint32_t used_rows_ = 0;
  double flux_ = 0;
};

}  // namespace ls::render

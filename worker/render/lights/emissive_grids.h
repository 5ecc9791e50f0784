// Emissive grids as lights: the directions from a point towards media whose emission varies in space, such as
// fire (Villemin and Hery 2013, "Practical Illumination from Flames", Journal of Computer Graphics Techniques
// 2(2)). A macro cell of an emission grid is chosen in proportion to the light that it gives off, and a point
// in it uniformly. Only the direction of this point is kept. Its density at x, per steradian, is the density
// of points y = x + t w per volume times t^2, integrated along the ray; in a cell it is constant, so the
// integral is a sum of density (t1^3 - t0^3) / 3 over the cells that the ray crosses from t0 to t1.
//
// The light from that direction is the integral of the emission along the ray (Simon, Hanika, Zirr and
// Dachsbacher 2017, "Line Integration for Rendering Heterogeneous Emissive Volumes", Computer Graphics Forum
// 36(4)), of which a second point on the ray is an estimate: a cell on the ray is chosen in proportion to its
// density times its length on the ray, and a point in it uniformly. Unlike the light of the first point, it
// has no singularity where x is close to that point.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "worker/render/math/math.h"
#include "worker/render/math/sampler.h"
#include "worker/render/math/transform.h"
#include "worker/render/media/medium.h"

namespace ls::render {

class EmissiveGrids {
 public:
  struct Point {
    V3 w;                   // direction, of length 1
    float distance;         // of the second point [world units]
    C3 emission{0, 0, 0};   // there, of the medium [radiance per world unit]
    float pdf;              // of the direction [1/sr], positive
    float pdf_of_distance;  // [1/world unit], positive
    std::uint32_t medium;   // index into the media
  };

  EmissiveGrids() = default;
  // The media must outlive this object. Media whose emission does not vary, or whose extent is that of their
  // boundary alone, are left out.
  explicit EmissiveGrids(std::span<const Medium> media);

  bool any() const { return !first_words_.empty(); }
  // True if sample() finds all light that this medium gives off.
  bool has(std::uint32_t medium) const { return medium < found_.size() && found_[medium]; }
  // `numbers` choose the direction, and the next number of `stream` the point on it. Returns nullopt if there
  // is none: if the first point is x, or so far that the densities are not positive numbers.
  std::optional<Point> sample(const V3& x, const Group& numbers, RandomStream& stream) const;
  // Returns the density with which sample() finds the direction w, of length 1, from the point x.
  float pdf(const V3& x, const V3& w) const { return static_cast<float>(sums(x, w).by_angle); }
  std::size_t cell_count() const { return first_words_.size(); }
  std::uint64_t bytes() const;

 private:
  struct Source {
    const Medium* medium;
    std::uint32_t index;               // of the medium
    const Grid* grid;                  // the grid whose macro cells are chosen
    Affine to_world;                   // from the grid's index coordinates
    std::vector<double> densities;     // of points per world volume, by number of the cell
    std::vector<std::uint32_t> cells;  // those that are chosen: numbers in the grid
    std::size_t first = 0;             // index of the first of them in first_words_
  };
  // The density of points integrated along a ray, times t^2 and without this factor
  struct Sums {
    double by_angle = 0, by_length = 0;
  };
  Sums sums(const V3& x, const V3& w) const;

  std::vector<Source> sources_;
  // A cell is chosen if a random word is at least its number here and less than that of the next cell. So
  // probabilities are counted words, and exact.
  std::vector<std::uint32_t> first_words_;
  std::vector<bool> found_;  // by index of the medium
};

}  // namespace ls::render

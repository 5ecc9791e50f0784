// The density of pbrt's medium "cloud": noise that is thinned out with height and clamped to [0, 1]
// (CloudMedium::Density in pbrt-v4's src/pbrt/media.h).
#pragma once

#include <array>
#include <optional>

#include "core/scene/scene.h"
#include "formats/made_files.h"

namespace ls::scene::pbrt {

// Perlin's improved noise (K. Perlin, Improving Noise, SIGGRAPH 2002) as pbrt-v4 has it: a smooth function of
// the point that is 0 wherever all coordinates are whole numbers. It repeats after 256 along each axis.
double noise(const Vec3& p);

// Returns the gradient of noise() as pbrt approximates it: by forward differences with a step of 0.01.
Vec3 noise_slope(const Vec3& p);

struct Cloud {
  double density = 1, wispiness = 1, frequency = 5;
  Vec3 low{{0, 0, 0}}, high{{1, 1, 1}};  // corners of the box that the cloud fills
  bool operator==(const Cloud&) const = default;
};

// Returns the density at a point in the medium's own coordinates. The box has no effect on it.
double density_at(const Cloud& cloud, const Vec3& p);

// The size of a grid whose outermost nodes are on the faces of the cloud's box. sides: number of nodes along
// each axis. per_cell: number of nodes along an axis per cell (lattice cube) of the finest noise in the
// formula.
struct CloudNodes {
  std::array<int, 3> sides{};
  double per_cell = 0;
  std::size_t count() const { return std::size_t(sides[0]) * std::size_t(sides[1]) * std::size_t(sides[2]); }
};
// The value of per_cell that resolves the noise well, and the least value that resolves it at all.
inline constexpr double kWantedPerCell = 4, kLeastPerCell = 2;

// Returns the finest grid with at most kWantedPerCell nodes per cell and at most `most` nodes in total.
// nullopt: even a grid with kLeastPerCell nodes per cell has more than `most` nodes.
std::optional<CloudNodes> nodes_for(const Cloud& cloud, std::size_t most);

MadeGrid cloud_grid(const Cloud& cloud, const CloudNodes& nodes);

}  // namespace ls::scene::pbrt

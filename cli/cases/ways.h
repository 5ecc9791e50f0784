// One question over all code paths that claim it: media as formula or as grid, and the integrators.
#pragma once

#include <string>
#include <vector>

#include "cli/cases/case.h"

namespace ls::cases {

struct Way {
  bool grid = false;
  bool distant = false;  // the integrator volpath_distant_mis
  DistanceSampling distance = DistanceSampling::mis;

  std::string medium_name() const { return grid ? "grid" : "homogeneous"; }
  std::string integrator_name() const {
    if (!distant) return "volpath";
    return distance == DistanceSampling::mis           ? "distant-mis"
           : distance == DistanceSampling::equiangular ? "distant-equiangular"
                                                       : "distant-exponential";
  }
  std::string name() const {
    std::string n(1, '/');
    return n.append(medium_name()).append(1, '/').append(integrator_name());
  }

  void choose(SceneKit& kit) const {
    kit.scene.integrator.name = distant ? "volpath_distant_mis" : "volpath";
    kit.scene.integrator.distance = distance;
  }
  // A medium that is the same everywhere in `bounds`, a box given by the map of the unit cube to it: a
  // formula, or 3 x 4 x 5 voxels of .5 under twice the scale. (Of a grid, channels differ by a constant
  // volume.)
  MediumIndex medium(SceneKit& kit, const Rgb& sigma_t, const Rgb& albedo, double g,
                     const Transform& bounds) const {
    if (!grid) return kit.homogeneous(sigma_t, albedo, g);
    if (sigma_t[0] != sigma_t[1] || sigma_t[1] != sigma_t[2])
      return kit.heterogeneous(kit.constant(sigma_t, bounds), albedo, 1, g);
    return kit.heterogeneous(kit.grid({3, 4, 5}, std::vector<float>(60, .5f), bounds), albedo, 2 * sigma_t[0],
                             g);
  }
};

// Media of both kinds with the default integrator and the other one.
inline std::vector<Way> all_ways() { return {{false, false}, {true, false}, {false, true}, {true, true}}; }
// One of each kind, for what takes long.
inline std::vector<Way> two_ways() { return {{false, false}, {true, true}}; }
inline std::vector<Way> both_media() { return {{false, false}, {true, false}}; }

// The map of the unit cube to the box [lo, hi].
inline Transform box(const Vec3& lo, const Vec3& hi) {
  return translate(lo) * scale(hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]);
}

}  // namespace ls::cases

// Work counters count, per thread, how often each kind of work was done. Tests and benchmarks use them to
// show that a scene pays nothing for features that it does not use. They exist only in builds with
// LIGHTSHAFT_COUNT; in all others LS_COUNT expands to a statement without effect.
#pragma once

#include <cstdint>
#include <iterator>
#include <utility>

namespace ls::render {

struct WorkCounters {
  std::uint64_t density = 0;            // lookups in the voxel grids of media
  std::uint64_t macro_cells = 0;        // macro cells (blocks of voxels with density bounds) entered by rays
  std::uint64_t phase = 0;              // evaluations and samplings of phase functions
  std::uint64_t transmittance = 0;      // evaluations of transmittance in homogeneous media
  std::uint64_t medium_emission = 0;    // ray segments along which emission of a medium was integrated
  std::uint64_t equiangular = 0;        // ray segments on which a distance was sampled equi-angularly
  std::uint64_t boundary_rays = 0;      // segments of shadow rays, each from boundary to boundary
  std::uint64_t null_transmission = 0;  // evaluations of null transmission at surfaces (bsdf.h)
  std::uint64_t texels = 0;             // lookups in image textures
  std::uint64_t instances = 0;          // ray hits transformed from an instance to the world
  std::uint64_t user_geometry = 0;      // ray tests of spheres, disks and cylinders
  std::uint64_t light_tree = 0;         // samplings and pdf evaluations of the light tree
  std::uint64_t environment_map = 0;    // lookups and samplings of environment maps
  std::uint64_t lens = 0;               // samplings of a point on the camera's lens
  std::uint64_t shadow_rays = 0;
};

// The counters and their names, in the order in which they are printed.
inline constexpr std::pair<const char*, std::uint64_t WorkCounters::*> kWorkCounters[] = {
    {"shadow_rays", &WorkCounters::shadow_rays},
    {"density", &WorkCounters::density},
    {"macro_cells", &WorkCounters::macro_cells},
    {"phase", &WorkCounters::phase},
    {"transmittance", &WorkCounters::transmittance},
    {"glow", &WorkCounters::medium_emission},
    {"equiangular", &WorkCounters::equiangular},
    {"boundary_rays", &WorkCounters::boundary_rays},
    {"veils", &WorkCounters::null_transmission},
    {"texels", &WorkCounters::texels},
    {"instances", &WorkCounters::instances},
    {"user_geometry", &WorkCounters::user_geometry},
    {"light_tree", &WorkCounters::light_tree},
    {"environment_map", &WorkCounters::environment_map},
    {"lens", &WorkCounters::lens},
};
static_assert(sizeof(WorkCounters) == std::size(kWorkCounters) * sizeof(std::uint64_t),
              "add the new counter here");

#ifdef LIGHTSHAFT_COUNT
inline WorkCounters& work_counters() {
  static thread_local WorkCounters counters;
  return counters;
}
#define LS_COUNT(what) (++::ls::render::work_counters().what)
#else
#define LS_COUNT(what) static_cast<void>(0)
#endif

}  // namespace ls::render

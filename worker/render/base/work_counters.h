// Work counters: how often each thread did each kind of work. Tests and benchmarks use them to show that a
// scene pays nothing for features that it does not use. They exist only in builds with LIGHTSHAFT_COUNT; in
// all others LS_COUNT expands to a statement without effect.
#pragma once

#include <cstdint>
#include <iterator>
#include <utility>

namespace ls::render {

struct WorkCounters {
  std::uint64_t density = 0;            // grid evaluations
  std::uint64_t macro_cells = 0;        // macro cells visited by trackers
  std::uint64_t phase = 0;              // phase function evaluations and samples
  std::uint64_t transmittance = 0;      // evaluations in homogeneous media
  std::uint64_t medium_emission = 0;    // segments integrated for medium emission
  std::uint64_t equiangular = 0;        // segments sampled equi-angularly
  std::uint64_t boundary_rays = 0;      // shadow-ray segments traced boundary by boundary
  std::uint64_t null_transmission = 0;  // null-transmission evaluations
  std::uint64_t texels = 0;             // image lookups
  std::uint64_t instances = 0;          // hits transformed through an instance
  std::uint64_t user_geometry = 0;      // spheres, disks and cylinders tested by the BVH
  std::uint64_t light_tree = 0;         // light-tree samples and pdf evaluations
  std::uint64_t environment_map = 0;    // environment map lookups and samples
  std::uint64_t lens = 0;               // aperture samples
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

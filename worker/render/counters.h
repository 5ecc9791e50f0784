// Counts of work done, for the tests and the bench that show that a scene pays for nothing it does not use.
// Only in builds with LIGHTSHAFT_COUNT; in all others LS_COUNT is nothing.
#pragma once

#include <cstdint>

namespace ls::render {

struct WorkCounters {
  std::uint64_t density = 0;          // evaluations of a grid
  std::uint64_t macro_cells = 0;      // stepped into by trackers
  std::uint64_t phase = 0;            // phase function evaluated or sampled
  std::uint64_t transmittance = 0;    // of homogeneous media
  std::uint64_t glow = 0;             // segments integrated for a medium's light
  std::uint64_t equiangular = 0;      // segments sampled about a light
  std::uint64_t boundary_rays = 0;    // shadow rays walked through what lets light pass
  std::uint64_t veils = 0;            // shares of light evaluated
  std::uint64_t texels = 0;           // image lookups
  std::uint64_t instances = 0;        // hits taken through an instance's map
  std::uint64_t user_geometry = 0;    // spheres, disks and cylinders tested by the BVH
  std::uint64_t light_tree = 0;       // choices made by the tree, or weighed against it
  std::uint64_t environment_map = 0;  // looked up or sampled
  std::uint64_t lens = 0;             // points on the aperture
  std::uint64_t shadow_rays = 0;
};

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

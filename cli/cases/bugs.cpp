// Three bugs that other renderers have had, each with cases that it turns red
// (docs/measurements/validation.md says how that was seen): a phase function clamped to |g| = .99, 1 - exp of
// a thin depth, and 0 / 0 at null collisions.
#include <fmt/format.h>

#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/checks.h"
#include "cli/cases/stages.h"

namespace ls::cases {
namespace {

// A textbook's sampling and density lose their digits from .999 on, so that others stop at .99: a peak four
// orders too low.
void clamped_g(Table& t) {
  for (const double g : {.9995, -.9995})
    t.mean(fmt::format("bug-g-clamped-to-.99/homogeneous/volpath{}", g > 0 ? "" : "-backward"), "N18 bug",
           "Light scattered straight on at |g| = .9995: clamped to .99 it would be a 400th of this.",
           [=] { return head_on({}, g, .5, g > 0); }, grey(head_on_answer(g, .5)),
           {.slack = 2 * 0x1p-25 / (1 - std::abs(g))});
}

// 1 - expf(-tau) is 0 in float32 below 6e-8, and has half of its digits left at 2e-7.
void one_minus_exp(Table& t) {
  constexpr Way kDistant{false, true}, kDistantGrid{true, true};
  for (const Way& way : {kDistant, kDistantGrid})
    t.mean(
        "bug-one-minus-exp" + way.name(), "N2 bug",
        "The truncated exponential by expm1: 1 - exp in float32 would lose half of this depth's precision.",
        [=] { return lit_cube(way, rgb(2e-7), rgb(1)); }, grey(lit_cube_answer(2e-7, 1)), {.band = 1e-4});
}

// A row of voxels, empty or full, without interpolation, that only absorbs; seen before a white sky, or
// between the sun and a white disk.
constexpr int kVoxels = 16, kFull = 7;
SceneKit row_of_voxels(float density, double sigma, bool by_shadow) {
  std::vector<float> values(kVoxels, 0);
  for (const std::size_t i : {1, 2, 5, 6, 7, 11, 14}) values[i] = density;
  SceneKit kit;
  const VolumeIndex v = kit.grid({kVoxels, 1, 1}, values, Transform{});
  std::get<GridVolume>(kit.scene.volumes[v.value]).filter = VolumeFilter::nearest;
  kit.container(CubeShape{}, translate({.5, .5, .5}) * scale(.5), kit.null(),
                kit.heterogeneous(v, rgb(0), sigma));
  if (by_shadow) {
    kit.shape(DiskShape{}, translate({4, .5, .5}) * rotate_y(-90) * scale(.01), kit.diffuse(.5));
    kit.scene.emitters.push_back(DirectionalEmitter{{1, 0, 0}, rgb(1)});
    kit.scene.integrator.max_depth = kOnce;
    kit.look({3.9, .9, .5}, {4, .5, .5});
  } else {
    kit.environment();
    kit.look({-2, .5, .5}, {0, .5, .5}, 1e-5);
  }
  return kit;
}

// At a tentative collision in a voxel at its cell's bound nothing is null and, where nothing scatters either,
// probabilities that are shares of "scattered or null" are 0 / 0. This renderer's bounds are 4 last places
// above the voxels, so that something is always null; of densities of 2e-32 that difference is 1e-38, which
// is 0 where denormal numbers are (as in every renderer's threads).
void null_collisions(Table& t) {
  for (const bool by_shadow : {false, true})
    for (const bool tiny : {false, true}) {
      const float density = tiny ? 2e-32f : 1.f;
      const double sigma = tiny ? 2e29 : 2, depth = sigma * density * kFull / kVoxels;
      t.mean(fmt::format("bug-null-collision-0-over-0{}/grid/{}", tiny ? "-exactly" : "",
                         by_shadow ? "shadow" : "volpath"),
             "N3 N9 bug",
             "Tentative collisions where the density is its own bound, or nothing: 0 / 0 in others.",
             [=] { return row_of_voxels(density, sigma, by_shadow); },
             grey(std::exp(-depth) * (by_shadow ? .5 / kPi : 1)), {.band = tiny ? 3e-4 : .003});
    }
  // The factor of a null collision in a channel without extinction is 0 to the number of these: where there
  // was none, 0 to the 0th.
  for (const Way& way : {Way{true, false}, Way{true, true}})
    t.mean("bug-null-collision-0-to-the-0th" + way.name(), "N15 N9 bug",
           "A grid without extinction in red: its light passes, whichever channel decides flights.",
           [=] {
             SceneKit kit = unit_cube(way, {0, 1, 4});
             kit.environment();
             return kit;
           },
           {1, std::exp(-1.), std::exp(-4.)});
}

}  // namespace

void add_bugs(Table& t) {
  clamped_g(t);
  one_minus_exp(t);
  null_collisions(t);
}

}  // namespace ls::cases

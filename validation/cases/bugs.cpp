// Cases for three bugs that other renderers have had: a phase function clamped to |g| = 0.99, the
// cancellation in 1 - exp(-tau) at small optical depths tau, and 0 / 0 at null collisions. Each case fails
// for a renderer that has the bug of this case (docs/design/validation.md describes how this is checked).
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

// Near |g| = 1, the textbook formulas for sampling the Henyey-Greenstein phase function and for its density
// lose their digits, from |g| = 0.999 on. So other renderers clamp |g| to 0.99. At |g| = 0.9995 the peak of
// the phase function is then 400 times too low.
void clamped_g(Table& t) {
  for (const double g : {.9995, -.9995})
    t.mean(fmt::format("bug-g-clamped-to-.99/homogeneous/volpath{}", g > 0 ? "" : "-backward"), "N18 bug",
           "Light scattered straight on at |g| = .9995: clamped to .99 it would be a 400th of this.",
           [=] { return head_on({}, g, .5, g > 0); }, grey(head_on_answer(g, .5)),
           {.slack = 2 * 0x1p-25 / (1 - std::abs(g))});
}

// In float32, 1 - expf(-tau) is 0 for tau below 3e-8, and 11 % too small at 2e-7.
void one_minus_exp(Table& t) {
  constexpr Configuration kDistant{false, true}, kDistantGrid{true, true};
  for (const Configuration& configuration : {kDistant, kDistantGrid})
    t.mean(
        "bug-one-minus-exp" + configuration.name(), "N2 bug",
        "The truncated exponential by expm1: 1 - exp in float32 would lose half of this depth's precision.",
        [=] { return lit_cube(configuration, rgb(2e-7), rgb(1)); }, grey(lit_cube_answer(2e-7, 1)),
        {.band = 1e-4});
}

// A row of kVoxels voxels without interpolation, of which kFull have the given density and the others are
// empty. The medium only absorbs. A white environment is seen through the row or, with `by_shadow`, the sun
// shines through it onto a white disk.
constexpr int kVoxels = 16, kFull = 7;
SceneBuilder row_of_voxels(float density, double sigma, bool by_shadow) {
  std::vector<float> values(kVoxels, 0);
  for (const std::size_t i : {1, 2, 5, 6, 7, 11, 14}) values[i] = density;
  SceneBuilder builder;
  const VolumeIndex v = builder.grid({kVoxels, 1, 1}, values, Transform{});
  std::get<GridVolume>(builder.scene.volumes[v.value]).filter = VolumeFilter::nearest;
  builder.container(CubeShape{}, translate({.5, .5, .5}) * scale(.5), builder.null(),
                    builder.heterogeneous(v, rgb(0), sigma));
  if (by_shadow) {
    builder.shape(DiskShape{}, translate({4, .5, .5}) * rotate_y(-90) * scale(.01), builder.diffuse(.5));
    builder.scene.emitters.push_back(DirectionalEmitter{{1, 0, 0}, rgb(1)});
    builder.scene.integrator.max_depth = kOnce;
    builder.look({3.9, .9, .5}, {4, .5, .5});
  } else {
    builder.environment();
    builder.look({-2, .5, .5}, {0, .5, .5}, 1e-5);
  }
  return builder;
}

// If a voxel's density equals the majorant of its macro cell, no collision in the voxel is a null collision.
// If the medium does not scatter either, the probabilities of scattering and of a null collision are both 0,
// and a division by their sum is 0 / 0. This renderer's majorants are 4 ulps above the densities, so the
// probability of a null collision is never exactly 0. But for densities of 2e-32 the 4 ulps are 1e-38, a
// denormal, and every thread of the renderer flushes denormals to 0.
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
  // In a channel without extinction, the weight of a path contains 0 to the power of the number of its null
  // collisions. For a path without null collisions this is 0 to the power of 0, which must be 1.
  for (const Configuration& configuration : {Configuration{true, false}, Configuration{true, true}})
    t.mean("bug-null-collision-0-to-the-0th" + configuration.name(), "N15 N9 bug",
           "A grid without extinction in red: its light passes, whichever channel decides flights.",
           [=] {
             return in_white(unit_cube(configuration, {0, 1, 4}));
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

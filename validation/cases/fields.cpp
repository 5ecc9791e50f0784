// Media with closed forms: grids whose density varies along the ray (atmospheres), the mean path length in a
// ball, and the light of a ball or a lamp in an infinite medium.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

// A unit cube whose density varies along x only, seen along x in front of a white environment. The density is
// interpolated linearly between the centres of the voxels, and is constant in the outer halves of the first
// and last voxel. So its integral over the cube is exactly the mean of the voxels.
SceneBuilder layered(const std::vector<float>& values, double sigma) {
  SceneBuilder builder;
  const BsdfIndex null = builder.null();
  builder.container(
      CubeShape{}, translate({.5, .5, .5}) * scale(.5), null,
      builder.heterogeneous(builder.grid({static_cast<int>(values.size()), 1, 1}, values, Transform{}),
                            rgb(0), sigma));
  builder.environment();
  builder.look({-3, .5, .5}, {.5, .5, .5}, 1e-5);
  return builder;
}

template <class F>
std::vector<float> sampled(F density, int n) {
  std::vector<float> v;
  for (int i = 0; i < n; ++i) v.push_back(static_cast<float>(density((i + .5) / n)));
  return v;
}

// The optical depth of the cube is the mean of the n voxels, a midpoint sum of the density f over [0, 1]. It
// differs from the integral of f by about (f'(1) - f'(0)) / (24 n^2): at most 6e-6 for 256 voxels.
void atmospheres(Table& t) {
  const auto add = [&](const char* name, const char* about, auto density, double depth) {
    t.mean(fmt::format("7.6a-{}/grid/volpath", name), "7.6a", about,
           [=] { return layered(sampled(density, 256), 1); }, grey(std::exp(-depth)), {.slack = 1e-5});
  };
  add(
      "exponential-atmosphere", "Density e^(-z / H): H (1 - e^(-1 / H)).",
      [](double z) { return 3 * std::exp(-z / .3); }, 3 * .3 * -std::expm1(-1 / .3));
  add(
      "linear-ramp", "Density z: half.", [](double z) { return 1.5 * z; }, .75);
  add(
      "gaussian-blob", "Density e^(-(x / s)^2) over all of it: sqrt(pi) s erf(L / s).",
      [](double x) { return 3 * std::exp(-(x - .5) * (x - .5) / .04); },
      3 * std::sqrt(kPi) * .2 * std::erf(.5 / .2));
}

// A ball of radius R = 1 that scatters (coefficient sigma_s) and absorbs a little (sigma_a), in a white sky.
// The mean path length l of light in it is 4 V / S = 4 R / 3, with V its volume and S its surface, however it
// scatters (Blanco and Fournier 2003). A path of length l absorbs the share 1 - e^(-sigma_a l) of the light,
// to first order sigma_a l. So the mean of 1 - L, with L the radiance, is sigma_a 4 R / 3.
//
// The slack has two terms. The second order of 1 - e^(-sigma_a l) makes the answer smaller by the share
// sigma_a <l^2> / (2 <l>), where <> is a mean over paths. The factor <l^2> / (2 <l>) is the mean remaining
// path length from a point inside: 0.75 R without scattering, to which diffusion adds about
// R^2 sigma_s / 5 = 0.4 R. So the share is below 2 sigma_a R. The weight of a path is a product of albedos,
// each rounded by 2^-25; relative to the absorbed share of a collision, sigma_a / (sigma_a + sigma_s) = 5e-4,
// this is an error of 6e-5.
void mean_paths(Table& t) {
  constexpr double kAbsorption = 1e-3, kScattering = 2, kDistance = 1000, kMargin = 1.01;
  for (const Configuration& configuration : all_configurations()) {
    for (const double g : {0., .9}) {
      t.mean(fmt::format("7.6d-mean-path-g{:g}{}", g, configuration.name()), "7.6d",
             "What a sphere absorbs of light from everywhere: its mean path is 4 R / 3, however it scatters.",
             [=] {
               SceneBuilder builder({32, 32});
               configuration.choose(builder);
               const MediumIndex m = configuration.medium(builder, rgb(kScattering + kAbsorption),
                                                          rgb(kScattering / (kScattering + kAbsorption)), g,
                                                          box({-1, -1, -1}, {1, 1, 1}));
               builder.container(SphereShape{}, {}, builder.null(), m);
               builder.environment();
               builder.scene.integrator.rr_depth =
                   1000;  // Russian roulette starts late: it would cause nearly all of the noise
               builder.look({0, -kDistance, 0}, {0, 0, 0}, 2 * std::atan(kMargin / kDistance) * 180 / kPi);
               return builder;
             },
             grey(kPi / (4 * kMargin * kMargin) * kAbsorption * 4 / 3),
             {.band = .01,
              .why_band = "what is missing to 1: a thousandth, of which the closed form leaves .2 % out",
              .slack = 2 * kAbsorption + 6e-5,
              .complement = true,
              .slow = true});
    }
  }
}

// A practically infinite medium of extinction 1, seen in all directions from (r, 0, 0). It ends at a black
// sphere whose radius R is 150, or 40 at albedos up to 0.9. The fluence decays with distance at the rate
// kappa, which is 0.055 at albedo 0.999, so the sphere removes only a share e^(-2 kappa R) of the light.
SceneBuilder endless(double albedo, double r, MediumIndex* medium) {
  SceneBuilder builder({64, 64});
  *medium = builder.homogeneous(rgb(1), rgb(albedo));
  builder.container(SphereShape{}, scale(albedo > .9 ? 150 : 40), builder.diffuse(0), *medium);
  builder.scene.sensor.medium = *medium;
  builder.scene.sensor.projection = Projection::spherical;
  builder.scene.sensor.to_world = translate({r, 0, 0});
  return builder;
}

// The fluence at a distance r from the centre of a ball that emits 1 W; the radius of the ball is r / 2. A
// camera that sees all directions measures the mean radiance, fluence / (4 pi). The source is a ball because
// estimates for a point light have infinite variance: their radiance grows like the inverse of the angle to
// the point. At albedo 0.999 paths have a thousand segments, so the band is wider.
void endless_medium(Table& t) {
  for (const double c : {.3, .5, .8, .9, .99, .999}) {
    for (const double r : {.25, 1., 2., 5.}) {
      const double radius = r / 2;
      t.mean(fmt::format("7.6e-fluence-c{:g}-r{:g}/homogeneous/volpath", c, r), "7.6e",
             "The light of a glowing ball in an endless medium, over all directions, at this many mean free "
             "paths.",
             [=] {
               MediumIndex around;
               SceneBuilder builder = endless(c, r, &around);
               const MediumIndex inside = builder.homogeneous(rgb(1), rgb(c));
               const double volume = 4 * kPi / 3 * radius * radius * radius;
               std::get<HomogeneousMedium>(builder.scene.media[inside.value]).emission =
                   rgb(1 / (4 * kPi * volume));
               builder.container(SphereShape{}, scale(radius), builder.null(), inside).exterior = around;
               return builder;
             },
             grey(endless_fluence(c, r, radius) / (4 * kPi)),
             {.band = c > .99 ? .05 : .02,
              .why_band = c > .99 ? "paths of a thousand segments" : "paths come by the ball by chance alone",
              .slow = c != .9 || r != 1});
    }
  }
}

// A camera does not see a point light directly, so the answer is the fluence minus its direct part
// e^-r / (4 pi r^2). The lower the albedo, the heavier are the tails of the estimates, so only high albedos
// are tested.
void endless_lamp(Table& t) {
  struct Row {
    double c, r;
  };
  for (const auto& [c, r] : {Row{.8, .25}, {.8, 1}, {.9, .25}, {.9, 1}}) {
    const double expected = (endless_fluence(c, r, 0) - std::exp(-r) / (4 * kPi * r * r)) / (4 * kPi);
    t.mean(fmt::format("7.6e-lamp-c{:g}-r{:g}/homogeneous/volpath", c, r), "7.6e",
           "The light of a lamp in an endless medium, over all directions, at this many mean free paths.",
           [c = c, r = r] {
             MediumIndex around;
             SceneBuilder builder = endless(c, r, &around);
             builder.scene.emitters.push_back(PointEmitter{{0, 0, 0}, rgb(1 / (4 * kPi))});
             return builder;
           },
           grey(expected),
           {.band = .02,
            .why_band = "heavy tails: light grows without bound towards the lamp",
            .slow = c != .9 || r != 1});
  }
}

}  // namespace

void add_fields(Table& t) {
  atmospheres(t);
  mean_paths(t);
  endless_medium(t);
  endless_lamp(t);
}

}  // namespace ls::cases

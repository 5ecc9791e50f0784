// Rays through grids whose density is linear, either the same in all channels or with a density for each of
// three channels. Also a ray in a medium that no surface ends.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "validation/fixtures/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

constexpr double kAbove = .5;  // distance of the lamps from the middle of the ray
constexpr Configuration kGrid{true, false}, kGridDistant{true, true},
    kExponential{true, true, DistanceSampling::exponential};

// In each channel the density is level (1 + slope z / 6), with the level and slope of that channel. The grid
// has two voxels with their centres at z = -6 and 6. Since the density is linear, its integral over a
// straight path is the length times the mean of the values at both ends.
struct Slopes {
  std::size_t channels;
  Channels level, slope;

  double at(std::size_t c, double z) const { return level[c] * (1 + slope[c] * z / 6); }
  VolumeIndex volume(SceneBuilder& builder) const {
    std::vector<float> values;
    for (const double z : {-6., 6.})
      for (std::size_t c = 0; c < channels; ++c) values.push_back(static_cast<float>(at(c, z)));
    return builder.grid({1, 1, 2}, values, box({-12, -12, -12}, {12, 12, 12}), static_cast<int>(channels));
  }
};
constexpr Slopes kOne{1, {1, 1, 1}, {1, 1, 1}}, kThree{3, {1, .5, 3}, {1, -1, 0}};

// The ray of passing() in such a grid, and a lamp at distance kAbove from the middle of the ray. With q the
// angle between a direction and the direction from the lamp to the middle, the lamp has the intensity f(q)
// (`intensity`). With a the albedo, s r(t) the extinction at z = t (s is `sigma`, r the density), and d the
// distance of this point from the lamp, the radiance of light that is scattered once is, in each channel,
//   a / (4 pi) int s r(t) e^(-s ((t + 3) (r(-3) + r(t)) + d (r(0) + r(t))) / 2) f / d^2 dt.
void beside_a_lamp(Table& t, const std::string& name, const Configuration& configuration,
                   const Slopes& slopes, double sigma, const Emitter& lamp, double (*intensity)(double),
                   const MeanOptions& options = {}) {
  const Rgb albedo{1, .8, .3};
  SceneBuilder builder = passing(configuration, rgb(sigma), albedo);
  builder.scene.sensor.medium = builder.heterogeneous(slopes.volume(builder), albedo, sigma);
  builder.scene.emitters.push_back(lamp);
  Channels expected;
  for (std::size_t c = 0; c < 3; ++c)
    expected[c] =
        albedo[c] *
        integrate(
            [&](double z) {
              const double d = std::hypot(kAbove, z), r = slopes.at(c, z);
              const double depth = sigma / 2 * ((z + 3) * (slopes.at(c, -3) + r) + d * (slopes.at(c, 0) + r));
              return sigma * r * std::exp(-depth) / (4 * kPi * d * d) * intensity(std::atan2(z, kAbove));
            },
            -3, 3, 20000);
  t.mean(fmt::format("7.6f-{}{}", name, configuration.name()), "7.6f N22",
         "A ray past a lamp in a density that is linear along it: light scattered once, by quadrature.",
         builder, expected, options);
}

void lamps(Table& t) {
  const Emitter point = PointEmitter{{kAbove, 0, 0}, rgb(1)};
  const auto even = [](double) { return 1.; };
  for (const double sigma : {.05, 1.})
    beside_a_lamp(t, fmt::format("lamp-beside-a-slope-of-{:g}", sigma), kGrid, kOne, sigma, point, even);
  // The intensity is 1 up to 30 degrees from the axis and falls linearly with the angle to 0 at 60 degrees.
  beside_a_lamp(t, "spot-beside-a-slope", kGrid, kOne, .7,
                SpotEmitter{look_at({kAbove, 0, 0}, {0, 0, 0}, {0, 1, 0}), rgb(1), 60, 30, {}},
                [](double q) { return std::clamp(2 - std::abs(q) * 6 / kPi, 0., 1.); });
  for (const Configuration& configuration : {kGrid, kGridDistant, kExponential}) {
    const bool by_chance = configuration.distance == DistanceSampling::exponential;
    beside_a_lamp(t, "lamp-beside-three-slopes", configuration, kThree, .6, point, even,
                  {.band = by_chance ? .02 : kBand,
                   .why_band = by_chance ? "paths come near the lamp by chance" : "",
                   .paths = by_chance ? 1u << 20 : 0u});
  }
}

// No surface ends the ray, so equi-angular sampling about the lamp is impossible: only free flights produce
// collisions near the lamp.
void without_end(Table& t) {
  const Rgb sigma{.5, 1, 2}, albedo{1, .8, .5};
  Channels expected;
  for (std::size_t c = 0; c < 3; ++c) expected[c] = passing_answer(kAbove, sigma[c], albedo[c], 60);
  for (const Configuration& configuration :
       {Configuration{false, true}, Configuration{.camera_points = 1}, Configuration{.camera_points = 5}}) {
    SceneBuilder builder = passing(configuration, sigma, albedo);
    builder.scene.shapes.clear();
    builder.scene.emitters.push_back(PointEmitter{{kAbove, 0, 0}, rgb(1 / (4 * kPi))});
    t.mean("7.6f-lamp-beside-a-ray-without-end" + configuration.name(), "7.6f",
           "A ray past a lamp that meets no surface: light scattered once, by quadrature.", builder, expected,
           {.band = .02, .why_band = "flights come near the lamp by chance", .paths = 1u << 20});
  }
}

// One medium with the densities kThree, or two such media in the same place, in front of a white environment.
// The ray crosses the media over about 6 units along z.
void through_slopes(Table& t) {
  for (const int media : {1, 2}) {
    SceneBuilder builder;
    double sigma = 0;
    for (int i = 0; i < media; ++i) {
      const double more = .15 + .05 * i;
      builder.container(CubeShape{}, scale(3 + .5 * i, 3, 3), builder.null(),
                        builder.heterogeneous(kThree.volume(builder), rgb(0), more));
      sigma += more;
    }
    builder.environment();
    // The ray avoids the diagonals of the faces of the cubes, where two triangles meet: in so narrow a view
    // rounding errors there would be visible.
    builder.look({.7, .3, -8}, {.7, .3, 3}, 1e-4, {0, 1, 0});
    Channels expected;
    for (std::size_t c = 0; c < 3; ++c) expected[c] = std::exp(-sigma * 6 * kThree.at(c, 0));
    t.mean(fmt::format("7.6a-through-three-slopes-in-{}/grid/volpath", media), "7.6a",
           "Three channels with a density each, in one medium or in two: exp(-depth) in each.", builder,
           expected);
  }
}

}  // namespace

void add_slopes(Table& t) {
  lamps(t);
  without_end(t);
  through_slopes(t);
}

}  // namespace ls::cases

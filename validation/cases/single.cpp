// Single scattering by every integrator, with all of its settings, compared with closed forms and with
// numerical integration (docs/measurements/stability.md 7.6f).
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

// A tested setting: the default integrator, or volpath_distant_mis with one of its ways of sampling distances
// and one of its MIS heuristics.
struct Setting {
  std::string name;
  Configuration configuration;
  MisHeuristic heuristic = MisHeuristic::power;
};
std::vector<Setting> settings(bool grid) {
  const auto distant = [&](DistanceSampling d) { return Configuration{grid, true, d}; };
  std::vector<Setting> s{{"", {grid, false}},
                         {"", distant(DistanceSampling::exponential)},
                         {"", distant(DistanceSampling::equiangular)},
                         {"-power", distant(DistanceSampling::mis)},
                         {"-balance", distant(DistanceSampling::mis), MisHeuristic::balance}};
  for (Setting& one : s) one.name = one.configuration.name() + one.name;
  return s;
}

void cubes(Table& t) {
  for (const Configuration& configuration : all_configurations()) {
    for (const double y : {-.9, 0., .9})
      t.mean(
          fmt::format("7.6f-cube-at-{:g}{}", y, configuration.name()), "7.6f",
          "A cube in the sun: .0102914924 at -.9, .0253129867 in the middle, .0622599010 at .9.",
          [=] { return lit_cube(configuration, rgb(1), rgb(1), y); }, grey(lit_cube_answer(1, 1, y)));
    const Rgb s{.5, 1, 4}, a{1, .5, .25};
    t.mean("7.6f-cube-chromatic" + configuration.name(), "7.6f",
           "Channels of their own: sigma .5, 1, 4, albedo 1, .5, .25.",
           [=] { return lit_cube(configuration, s, a); },
           {lit_cube_answer(s[0], a[0]), lit_cube_answer(s[1], a[1]), lit_cube_answer(s[2], a[2])});
  }
}

// The scene of passing() with the configuration and the MIS heuristic of the setting.
SceneBuilder passing_lit(const Setting& s, const Rgb& sigma, const Rgb& albedo) {
  SceneBuilder builder = passing(s.configuration, sigma, albedo);
  builder.scene.integrator.heuristic = s.heuristic;
  return builder;
}

// Returns the integral of sigma e^(-sigma (t + 3)) / (4 pi) arriving(t) dt over t from -3 to 3, the
// positions along the ray. This is the radiance of single scattering if arriving(t) is the light that
// reaches the point t, from all directions.
template <class F>
double along(double sigma, F arriving) {
  return integrate([&](double t) { return sigma * std::exp(-sigma * (t + 3)) / (4 * kPi) * arriving(t); }, -3,
                   3, 1200);
}

// The answer for a sphere of radiance 1 and radius r whose centre is at distance h from the ray. The light
// that reaches a point of the ray is integrated over the solid angle of the sphere, numerically over the
// cosine c of the angle to the centre of the sphere.
double sphere_answer(double h, double r, double sigma) {
  return along(sigma, [=](double t) {
    const double d2 = h * h + t * t, d = std::sqrt(d2), cos_max = std::sqrt(1 - r * r / d2);
    // The substitution c = cos_max + (1 - cos_max)(1 - v^2) removes the square root singularity of the
    // integrand at the rim of the sphere.
    return 2 * kPi *
           integrate(
               [=](double v) {
                 const double c = cos_max + (1 - cos_max) * (1 - v * v), s2 = 1 - c * c;
                 const double reach = d * c - std::sqrt(std::max(0., r * r - d2 * s2));
                 return std::exp(-sigma * reach) * 2 * v * (1 - cos_max);
               },
               0, 1, 200);
  });
}
// The answer for a square light of radiance 1 and side 2a that faces the ray at distance h.
double square_answer(double h, double a, double sigma) {
  return along(sigma, [=](double t) {
    return integrate(
        [=](double z) {
          return integrate(
              [=](double y) {
                const double d2 = h * h + y * y + (z - t) * (z - t), d = std::sqrt(d2);
                return h / d / d2 * std::exp(-sigma * d);
              },
              -a, a, 80);
        },
        -a, a, 80);
  });
}
// The answer for a spot light that is at distance h from the ray and points at its middle. The intensity is 1
// up to 30 degrees off its axis and falls linearly with the angle to 0 at 60 degrees.
double spot_answer(double h, double sigma) {
  return along(sigma, [=](double t) {
    const double d2 = h * h + t * t, degrees = std::abs(std::atan2(t, h)) * 180 / kPi;
    const double intensity = degrees < 30 ? 1 : degrees < 60 ? (60 - degrees) / 30 : 0;
    return std::exp(-sigma * std::sqrt(d2)) / d2 * intensity;
  });
}

void lights(Table& t) {
  const double square = square_answer(.3, .5, .7), sphere = sphere_answer(.5, .3, .7),
               spot = spot_answer(.5, .7);
  for (const bool grid : {false, true}) {
    for (const Setting& s : settings(grid)) {
      // With these settings paths come near a light only by chance. A short pilot run would find no such
      // path, or overestimate the light that they carry.
      const bool by_chance =
          s.configuration.distance == DistanceSampling::exponential || (grid && !s.configuration.distant);
      const MeanOptions options{.slow = by_chance, .paths = by_chance ? 1u << 21 : 0u},
          of_square{.slow = by_chance, .paths = by_chance ? 1u << 23 : 0u};
      t.mean(
          "7.6f-square-light" + s.name, "7.6f N26", "A ray past a shining square.",
          [=] {
            return with_lamp(passing_lit(s, rgb(.7), rgb(1)), RectangleShape{},
                             translate({.3, 0, 0}) * rotate_y(-90) * scale(.5));
          },
          grey(square), of_square);
      t.mean(
          "7.6f-sphere-light" + s.name, "7.6f N26", "A ray past a shining sphere.",
          [=] {
            return with_lamp(passing_lit(s, rgb(.7), rgb(1)), SphereShape{},
                             translate({.5, 0, 0}) * scale(.3));
          },
          grey(sphere), options);
      t.mean(
          "7.6f-spot" + s.name, "7.6f", "A ray through a spot's cone.",
          [=] {
            return with(passing_lit(s, rgb(.7), rgb(1)),
                        SpotEmitter{look_at({.5, 0, 0}, {0, 0, 0}, {0, 1, 0}), rgb(1), 60, 30, {}});
          },
          grey(spot), options);
      if (by_chance) continue;
      const Rgb sigma{.5, 1, 2}, albedo{1, .8, .5};
      t.mean("7.6f-lamp-chromatic" + s.name, "7.6f N22", "A ray past a lamp, channels of their own.",
             [=] { return beside_a_watt(passing_lit(s, sigma, albedo), .5); },
             {passing_answer(.5, sigma[0], albedo[0]), passing_answer(.5, sigma[1], albedo[1]),
              passing_answer(.5, sigma[2], albedo[2])});
    }
  }
  t.mean(
      "7.6f-lamp-in-thin-air/homogeneous/volpath", "7.6f",
      "1 W passed at 1 in a medium of sigma .1: .00102117618.",
      [] { return beside_a_watt(passing({}, rgb(.1), rgb(1)), 1); }, grey(.00102117618));
}

}  // namespace

void add_single(Table& t) {
  cubes(t);
  lights(t);
}

}  // namespace ls::cases

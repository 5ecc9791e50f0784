// Light that is scattered once: lamps at any distance from a ray, lamps very far away, enormous lamps, and
// lamps inside or just outside a medium.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

constexpr Configuration kAngles{false, true, DistanceSampling::equiangular},
    kAnglesInGrid{true, true, DistanceSampling::equiangular};

// A ray along z through a very thin medium (extinction sigma = 1e-12), from z = 0 to a plate at z = `length`.
// A lamp of intensity 1 stands at the distance D = `distance` beside the ray's point z = `where`. The answer
// is sigma / (4 pi) times the angle that the ray subtends at the lamp, divided by D. Equi-angular sampling
// estimates it without variance.
SceneBuilder beside(const Configuration& configuration, double length, double where, double distance) {
  SceneBuilder builder;
  configuration.choose(builder);
  const double r = 2 * length + where;
  builder.scene.sensor.medium =
      configuration.medium(builder, rgb(1e-12), rgb(1), 0, box({-r, -r, -r}, {r, r, r}));
  builder.shape(RectangleShape{}, translate({0, 0, length}) * scale(length) * rotate_x(180),
                builder.diffuse(0));
  builder.scene.emitters.push_back(PointEmitter{{distance, 0, where}, rgb(1)});
  builder.scene.integrator.max_depth = kOnce;
  builder.look({0, 0, 0}, {0, 0, 1}, 1e-7, {0, 1, 0});
  builder.scene.sensor.near_clip = 1e-9 * length;
  builder.scene.sensor.far_clip = 1e3 * length;
  return builder;
}
double beside_answer(double length, double where, double distance) {
  // The angle is atan(b) - atan(a). This form of it has no cancellation.
  const double a = -where / distance, b = (length - where) / distance;
  return 1e-12 / (4 * kPi) * std::atan2(b - a, 1 + a * b) / distance;
}

void passing_by(Table& t) {
  struct Pass {
    double length, where, distance;
  };
  // The position of the lamp and the length of the ray are rounded to float32 relative to the size of the
  // world. So D has an absolute error of a few 2^-24 of that size.
  for (const Pass p : {Pass{1, .5, 1e-2}, Pass{1, .5, 1}, Pass{1, .5, 100}, Pass{1, .5, 1e6},
                       Pass{1, -100, .1}, Pass{1, -1e4, 10}, Pass{1e3, 500, 1}}) {
    const double extent = std::max({p.length, std::abs(p.where), 1.});
    const double tolerance = 2e-6 + 4 * extent * 0x1p-24 / p.distance;
    for (const Configuration& configuration : {kAngles, kAnglesInGrid})
      t.exact(fmt::format("N22-lamp-at-{:g}-beside-{:g}-of-{:g}{}", p.distance, p.where, p.length,
                          configuration.name()),
              "N22", "Angles about a lamp chosen evenly: the inverse-square integral without variance.",
              [=](const Bench& b) {
                return every_value(b, beside(configuration, p.length, p.where, p.distance), 16,
                                   grey(beside_answer(p.length, p.where, p.distance)), tolerance);
              });
  }
  for (const Configuration& configuration : all_configurations()) {
    for (const double h : {1., .5, .01, 1e-4}) {
      // The integrator volpath is tested with close lamps in homogeneous media only: in grids it does not
      // sample distances equi-angularly, and too few of its free flights end close to the lamp.
      if (configuration.grid && !configuration.distant && h < .5) continue;
      t.mean(fmt::format("N22-passing-a-lamp-at-{:g}{}", h, configuration.name()), "N22 N23 7.6f",
             "A ray that passes a lamp at this distance, light scattered once.",
             [=] { return beside_a_watt(passing(configuration, rgb(1), rgb(1)), h); },
             grey(passing_answer(h, 1)), {.slack = 4 * 0x1p-24 / h});
    }
  }
}

// Rays that pass through the lamp itself or close by; D is the distance of a ray from the lamp. Over a square
// pixel of half width w about the lamp, the mean of 1 / D is 2 ln(1 + sqrt 2) / w. The mean of 1 / D^2 is
// infinite there, so the estimate has no finite variance, and the band is wide.
void through_a_lamp(Table& t) {
  for (const Configuration& configuration :
       {Configuration{false, false}, Configuration{false, true}, kAngles, kAnglesInGrid}) {
    constexpr double kHalf = .01, kSigma = 1e-3;
    const double mean = 2 * std::log(1 + std::sqrt(2.)) / kHalf;
    // With t the position along the ray, the integral of dt / (D^2 + t^2) over -3..3 is pi / D - 2 / 3 up to
    // terms of order D^2. Light that is scattered at t has travelled a length of about 3 + t + |t| in the
    // medium. The answer takes 3 for this length, since most of the light is scattered close to the lamp.
    const double angles = kPi * mean - 2. / 3;
    t.mean(
        "N23-through-a-lamp" + configuration.name(), "N23",
        "Rays through a lamp and close by: finite, and right in the mean.",
        [=] {
          SceneBuilder builder = passing(configuration, rgb(kSigma), rgb(1));
          builder.scene.emitters.push_back(PointEmitter{{0, 0, 0}, rgb(1)});
          builder.scene.sensor.projection = Projection::orthographic;
          builder.scene.sensor.to_world = look_at({0, 0, -3}, {0, 0, 3}, {0, 1, 0}) * scale(kHalf, kHalf, 1);
          return builder;
        },
        grey(kSigma / (4 * kPi) * std::exp(-3 * kSigma) * angles),
        {.band = .02,
         .why_band = "over a pixel about the lamp the squares of what rays bring have no finite mean",
         .slack = 1e-3,
         .slow = true,
         .frames = 64});
  }
}

void from_afar(Table& t) {
  for (const Configuration& configuration : all_configurations()) {
    for (const double distance : {1e4, 1e6, 1e8})
      t.mean(fmt::format("N24-lamp-at-{:g}{}", distance, configuration.name()), "N24 N22",
             "A lamp this far away is a sun: parallel light of its irradiance.",
             [=] {
               return lit_by(lit_cube(configuration, rgb(1), rgb(1)),
                             PointEmitter{{0, distance, 0}, rgb(distance * distance)});
             },
             grey(lit_cube_answer(1, 1)), {.slack = 4 / distance});
    t.mean("N24-sphere-of-1e2-at-1e3" + configuration.name(), "N24 N26",
           "A shining sphere of radius 100 at 1000, of fluence 1: all but a sun.",
           [=] {
             SceneBuilder builder = lit_cube(configuration, rgb(.01), rgb(1));
             builder.scene.emitters.clear();
             builder.lamp(SphereShape{}, translate({0, 1e3, 0}) * scale(1e2),
                          rgb(1 / (2 * kPi * (1 - std::sqrt(.99)))));
             return builder;
           },
           // The slack: light from the rim of the lamp falls 0.1 rad off the vertical, so paths down through
           // the cube are longer by at most 0.005; with the extinction 0.01 this changes the answer by 5e-5.
           // The number of paths: on grids volpath samples free flights, which rarely scatter in a medium
           // this thin, so a pilot run would tell too little.
           grey(lit_cube_answer(.01, 1)),
           {.slack = 5e-5,
            .slow = configuration.grid && !configuration.distant,
            .paths = configuration.grid && !configuration.distant ? 1u << 22 : 0u});
  }
}

// Lights of radius (or half side) 1e5 at distance 1e7 over a cube of side 2; each gives the cube a fluence of
// 1. The world is so large that float32 coordinates separate the faces of the cube only near the origin.
void enormous(Table& t) {
  constexpr double kSize = 1e5, kFar = 1e7;
  const double cone = 2 * kPi * (1 - std::sqrt(1 - kSize * kSize / kFar / kFar)),
               disk = 2 * kPi * (1 - kFar / std::hypot(kFar, kSize)),
               square = 4 * std::atan(kSize * kSize / (kFar * std::sqrt(kFar * kFar + 2 * kSize * kSize)));
  // The view is a line along z through the middle of the cube; its ends are on the faces z = -1 and z = 1.
  // Light from straight above reaches the line after a path of length 1 in the cube. Light that is tilted
  // along z by a small angle q has a shorter path, of length u < 1, if it reaches the line within q of one
  // end: it has entered through the side of the cube instead of its top. At this end it adds
  // q int_0^1 (e^-u - e^-1) du = q (1 - 2 / e). `lean` is the mean of max(q, 0) over the light.
  const auto leaning = [](double lean) {
    return 1 + lean * (std::exp(1.) - 2) * (1 + std::exp(-2.)) / -std::expm1(-2.);
  };
  constexpr double kRim = kSize / kFar;
  struct Light {
    const char* name;
    Geometry shape;
    double solid_angle, lean;
  };
  for (const Light& light : {Light{"sphere", SphereShape{}, cone, 2 * kRim / (3 * kPi)},
                             Light{"disk", DiskShape{}, disk, 2 * kRim / (3 * kPi)},
                             Light{"square", RectangleShape{}, square, kRim / 4}}) {
    for (const Configuration& configuration : all_configurations())
      t.mean(fmt::format("N24-{}-of-1e5-at-1e7{}", light.name, configuration.name()), "N24 N26",
             "A light of size 1e5 at 1e7, of fluence 1: a sun of half a degree over a cube of size 2.",
             [=] {
               SceneBuilder builder = lit_cube(configuration, rgb(1), rgb(1));
               builder.scene.emitters.clear();
               builder.lamp(light.shape, translate({0, kFar, 0}) * rotate_x(90) * scale(kSize),
                            rgb(1 / light.solid_angle));
               return builder;
             },
             // Light from the rim of the lamp falls 0.01 rad off the vertical (0.014 from the corners of the
             // square), so paths down through the cube are longer by a share of at most 1e-4.
             grey(lit_cube_answer(1, 1) * leaning(light.lean)), {.slack = 1e-4});
  }
}

// The answer for a cube [-1, 1]^3 of extinction sigma and albedo 1, seen along z through its middle, and a
// lamp of 1 W at (0, y, 0), inside or outside the cube. Light is scattered once; outside the cube there is no
// medium.
double cube_answer(double y, double sigma) {
  const double end = std::atan(1 / y);
  return sigma / (16 * kPi * kPi * y) *
         integrate(
             [&](double q) {
               const double z = y * std::tan(q), d = std::hypot(y, z);
               const double inside = y > 1 ? d / y : d;
               return std::exp(-sigma * (1 + z + inside));
             },
             -end, end, 20'000);
}

void across_boundaries(Table& t) {
  for (const Configuration& configuration : all_configurations()) {
    for (const double y : {.5, .999, 1.001, 4.}) {
      if (configuration.grid && !configuration.distant && y < .6) continue;
      t.mean(
          fmt::format("N25-lamp-at-{:g}{}", y, configuration.name()), "N25",
          "A lamp inside a cube of a medium, just below and above its face, and outside.",
          [=] {
            return lit_by(lit_cube(configuration, rgb(1), rgb(1)),
                          PointEmitter{{0, y, 0}, rgb(1 / (4 * kPi))});
          },
          // A shadow ray to a lamp above the cube always leaves through the top of the cube, never through a
          // side, since it approaches the y axis. So cube_answer() needs no case for the sides.
          grey(cube_answer(y, 1)));
    }
  }
}

}  // namespace

void add_lamps(Table& t) {
  passing_by(t);
  through_a_lamp(t);
  from_afar(t);
  enormous(t);
  across_boundaries(t);
}

}  // namespace ls::cases

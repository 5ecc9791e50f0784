// Lamps: rays that pass one at any distance, light from very far, from very small and from inside.
#include <fmt/format.h>

#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/checks.h"
#include "cli/cases/stages.h"

namespace ls::cases {
namespace {

constexpr Way kAngles{false, true, DistanceSampling::equiangular},
    kAnglesInGrid{true, true, DistanceSampling::equiangular};

// A ray along z through next to nothing (sigma 1e-12) from 0 to a plate at `length`, and a lamp of 1 W/sr
// beside z = `where` at distance D: sigma / (4 pi) times the angle that the ray's way takes up, over D.
// Angles chosen evenly give that without variance.
SceneKit beside(const Way& way, double length, double where, double distance) {
  SceneKit kit;
  way.choose(kit);
  const double r = 2 * length + where;
  kit.scene.sensor.medium = way.medium(kit, rgb(1e-12), rgb(1), 0, box({-r, -r, -r}, {r, r, r}));
  kit.shape(RectangleShape{}, translate({0, 0, length}) * scale(length) * rotate_x(180), kit.diffuse(0));
  kit.scene.emitters.push_back(PointEmitter{{distance, 0, where}, rgb(1)});
  kit.scene.integrator.max_depth = kOnce;
  kit.look({0, 0, 0}, {0, 0, 1}, 1e-7, {0, 1, 0});
  kit.scene.sensor.near_clip = 1e-9 * length;
  kit.scene.sensor.far_clip = 1e3 * length;
  return kit;
}
double beside_answer(double length, double where, double distance) {
  // atan(b) - atan(a) without cancellation.
  const double a = -where / distance, b = (length - where) / distance;
  return 1e-12 / (4 * kPi) * std::atan2(b - a, 1 + a * b) / distance;
}

void passing_by(Table& t) {
  struct Pass {
    double length, where, distance;
  };
  // The lamp's place, D and the ray's length come out of float32 in units of the world: D good to 2^-24 of
  // it.
  for (const Pass p : {Pass{1, .5, 1e-2}, Pass{1, .5, 1}, Pass{1, .5, 100}, Pass{1, .5, 1e6},
                       Pass{1, -100, .1}, Pass{1, -1e4, 10}, Pass{1e3, 500, 1}}) {
    const double extent = std::max({p.length, std::abs(p.where), 1.});
    const double tolerance = 2e-6 + 4 * extent * 0x1p-24 / p.distance;
    for (const Way& way : {kAngles, kAnglesInGrid})
      t.exact(
          fmt::format("N22-lamp-at-{:g}-beside-{:g}-of-{:g}{}", p.distance, p.where, p.length, way.name()),
          "N22", "Angles about a lamp chosen evenly: the inverse-square integral without variance.",
          [=](const Bench& b) {
            return every_value(b, beside(way, p.length, p.where, p.distance), 16,
                               grey(beside_answer(p.length, p.where, p.distance)), tolerance);
          });
  }
  for (const Way& way : all_ways()) {
    for (const double h : {1., .5, .01, 1e-4}) {
      // Grids have no angles but in the other integrator: close to the lamp chance finds too little.
      if (way.grid && !way.distant && h < .5) continue;
      t.mean(fmt::format("N22-passing-a-lamp-at-{:g}{}", h, way.name()), "N22 N23 7.6f",
             "A ray that passes a lamp at this distance, light scattered once.",
             [=] {
               SceneKit kit = passing(way, rgb(1), rgb(1));
               kit.scene.emitters.push_back(PointEmitter{{h, 0, 0}, rgb(1 / (4 * kPi))});
               return kit;
             },
             grey(passing_answer(h, 1)), {.slack = 4 * 0x1p-24 / h});
    }
  }
}

// The ray goes through the lamp itself: over a pixel of half width w about it 1 / D averages to 2 ln(1 + sqrt
// 2) / w. Its square has no finite mean there, so that the band is wide.
void through_a_lamp(Table& t) {
  for (const Way& way : {Way{false, false}, Way{false, true}, kAngles, kAnglesInGrid}) {
    constexpr double kHalf = .01, kSigma = 1e-3;
    const double mean = 2 * std::log(1 + std::sqrt(2.)) / kHalf;
    // int dt / (D^2 + t^2) over -3..3 is pi / D - 2 / 3 to D^2; extinction over some 3 + |t|.
    const double angles = kPi * mean - 2. / 3;
    t.mean("N23-through-a-lamp" + way.name(), "N23",
           "Rays through a lamp and close by: finite, and right in the mean.",
           [=] {
             SceneKit kit = passing(way, rgb(kSigma), rgb(1));
             kit.scene.emitters.push_back(PointEmitter{{0, 0, 0}, rgb(1)});
             kit.scene.sensor.projection = Projection::orthographic;
             kit.scene.sensor.to_world = look_at({0, 0, -3}, {0, 0, 3}, {0, 1, 0}) * scale(kHalf, kHalf, 1);
             return kit;
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
  for (const Way& way : all_ways()) {
    for (const double distance : {1e4, 1e6, 1e8})
      t.mean(fmt::format("N24-lamp-at-{:g}{}", distance, way.name()), "N24 N22",
             "A lamp this far away is a sun: parallel light of its irradiance.",
             [=] {
               SceneKit kit = lit_cube(way, rgb(1), rgb(1));
               kit.scene.emitters = {PointEmitter{{0, distance, 0}, rgb(distance * distance)}};
               return kit;
             },
             grey(lit_cube_answer(1, 1)), {.slack = 4 / distance});
    t.mean(
        "N24-sphere-of-1e2-at-1e3" + way.name(), "N24 N26",
        "A shining sphere of radius 100 at 1000, of fluence 1: all but a sun.",
        [=] {
          SceneKit kit = lit_cube(way, rgb(.01), rgb(1));
          kit.scene.emitters.clear();
          const TextureIndex light = kit.texture(rgb(1 / (2 * kPi * (1 - std::sqrt(.99)))));
          kit.shape(SphereShape{}, translate({0, 1e3, 0}) * scale(1e2), kit.diffuse(0)).emitter =
              AreaEmitter{light};
          return kit;
        },
        // Its rim is .1 rad off: the way down is longer by at most .005, times .01.
        // Flights through a grid this thin seldom end in it.
        grey(lit_cube_answer(.01, 1)),
        {.slack = 5e-5, .slow = way.grid && !way.distant, .paths = way.grid && !way.distant ? 1u << 22 : 0u});
  }
}

// Lights of radius (or half side) 1e5 at 1e7, of fluence 1, over a cube of size 2: float32 coordinates of a
// world of that size tell its faces apart only about the cube.
void enormous(Table& t) {
  constexpr double kSize = 1e5, kFar = 1e7;
  const double cone = 2 * kPi * (1 - std::sqrt(1 - kSize * kSize / kFar / kFar)),
               disk = 2 * kPi * (1 - kFar / std::hypot(kFar, kSize)),
               square = 4 * std::atan(kSize * kSize / (kFar * std::sqrt(kFar * kFar + 2 * kSize * kSize)));
  // Rays that lean by q along the view leave the cube by its side where they are within q of it: of their way
  // of 1 a part u is left, int (e^-u - e^-1) du = 1 - 2 / e on average, at both of the view's ends. `lean`:
  // the mean of q where it is positive.
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
    for (const Way& way : all_ways())
      t.mean(fmt::format("N24-{}-of-1e5-at-1e7{}", light.name, way.name()), "N24 N26",
             "A light of size 1e5 at 1e7, of fluence 1: a sun of half a degree over a cube of size 2.",
             [=] {
               SceneKit kit = lit_cube(way, rgb(1), rgb(1));
               kit.scene.emitters.clear();
               kit.shape(light.shape, translate({0, kFar, 0}) * rotate_x(90) * scale(kSize), kit.diffuse(0))
                   .emitter = AreaEmitter{kit.texture(rgb(1 / light.solid_angle))};
               return kit;
             },
             // Its rim is .01 rad off, .014 in the corners: ways down are longer by at most 1e-4.
             grey(lit_cube_answer(1, 1) * leaning(light.lean)), {.slack = 1e-4});
  }
}

// A cube [-1, 1]^3 seen along z through its middle, and a lamp on the y axis, inside it or out: extinction
// counts inside only.
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
  for (const Way& way : all_ways()) {
    for (const double y : {.5, .999, 1.001, 4.}) {
      if (way.grid && !way.distant && y < .6) continue;
      t.mean(
          fmt::format("N25-lamp-at-{:g}{}", y, way.name()), "N25",
          "A lamp inside a cube of a medium, just below and above its face, and outside.",
          [=] {
            SceneKit kit = lit_cube(way, rgb(1), rgb(1));
            kit.scene.emitters = {PointEmitter{{0, y, 0}, rgb(1 / (4 * kPi))}};
            return kit;
          },
          // Above the face a ray to the lamp leaves the cube by its sides nowhere: |z| < 1 is below y.
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

// Scenes of very different scales (extinctions of 1e8 over lengths of 1e-8), at any position, and seen from
// far away.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"
#include "validation/measure/measure.h"

namespace ls::cases {
namespace {

// A scene with many features, all of whose lengths are multiplied by s: a medium in a glass sphere, a floor,
// a disk light, a point light and the sun.
SceneBuilder miniature(const Configuration& configuration, double s) {
  SceneBuilder builder;
  configuration.choose(builder);
  const MediumIndex m = configuration.medium(builder, rgb(2 / s), rgb(.8), .5, box({-s, -s, -s}, {s, s, s}));
  builder.container(SphereShape{}, scale(s), builder.glass(1.3), m);
  builder.shape(RectangleShape{}, translate({0, 0, -1.5 * s}) * scale(4 * s), builder.diffuse(.5));
  builder.lamp(DiskShape{}, translate({0, 0, 3 * s}) * rotate_x(180) * scale(s), rgb(3));
  builder.scene.emitters.push_back(PointEmitter{{2 * s, 1.5 * s, 1 * s}, rgb(s * s)});
  builder.scene.emitters.push_back(DirectionalEmitter{{.5, .25, -1}, rgb(1)});
  builder.look({-5 * s, -2 * s, 2 * s}, {0, 0, 0}, 35);
  builder.scene.sensor.near_clip = .01 * s;
  builder.scene.sensor.far_clip = 100 * s;
  return builder;
}

void of_any_scale(Table& t) {
  for (const Configuration& configuration : all_configurations()) {
    for (const int k : {-40, -13, 20, 60}) {
      // Mitsuba's grid files store the bounding box in float32, which would round differently at each scale.
      // So the files have the unit cube as their box at every scale, and `to_world` scales it.
      t.exact(fmt::format("N04-scaled-by-2^{}{}", k, configuration.name()), "N4 7.7",
              "A scene scaled by a power of two has the same pixels, bit for bit.", [=](const Bench& b) {
                return same_bits(b, miniature(configuration, 1), miniature(configuration, std::ldexp(1., k)),
                                 8);
              });
    }
    for (const double s : {1e-8, 1e-4, 1e-2, 1e2, 1e4, 1e6}) {
      t.mean(
          fmt::format("N04-sigma-{:g}-over-{:g}{}", 1 / s, s, configuration.name()), "N4 7.7",
          "Light scattered once in a cube of this size: lengths times s, extinction over s.",
          [=] {
            return lit_cube(configuration, rgb(1), rgb(1), 0, {0, 0, 0}, s);
          },
          grey(lit_cube_answer(1, 1)));
    }
  }
}

void anywhere(Table& t) {
  for (const Configuration& configuration : all_configurations()) {
    t.mean(
        "N11-moved-by-1e5" + configuration.name(), "N11 7.7",
        "A cube a hundred thousand units from the origin: as at the origin.",
        [=] {
          return lit_cube(configuration, rgb(1), rgb(1), 0, {1e5, -1e5, 1e5});
        },
        grey(lit_cube_answer(1, 1)));
    for (const double distance : {1e3, 1e6}) {
      t.mean(
          fmt::format("N11-seen-from-{:g}{}", distance, configuration.name()), "N11",
          "The cube seen by a camera this far away: the ray's way through it keeps its length.",
          [=] {
            SceneBuilder builder = lit_cube(configuration, rgb(1), rgb(1));
            builder.look({0, 0, -distance}, {0, 0, 0}, 1e-9, {0, 1, 0});
            return builder;
          },
          grey(lit_cube_answer(1, 1)));
    }
    // The cube is a ten-thousandth of the scene in size. Rays are offset from surfaces by 2^-20 of the scene,
    // which is 1e-2 of the cube.
    t.mean(
        "N11-small-in-a-large-scene" + configuration.name(), "N11 N4",
        "A cube in the middle of a scene ten thousand times its size.",
        [=] {
          SceneBuilder builder = lit_cube(configuration, rgb(1), rgb(1));
          for (const double x : {-1e4, 1e4})
            builder.shape(SphereShape{}, translate({x, 0, 0}) * scale(10), builder.diffuse(0));
          return builder;
        },
        grey(lit_cube_answer(1, 1)));
  }
}

// Renders two samples per pixel, one for each of the two independent halves of the samples, with seed 0. They
// use the first point of every sample sequence.
void first_samples(Table& t) {
  for (const Configuration& configuration : all_configurations()) {
    t.exact("N70-first-samples-of-seed-0" + configuration.name(), "N70 N6",
            "Seed 0, the first sample of each half: numbers at their very ends break nothing.",
            [configuration](const Bench& b) -> Figure {
              Bench first = b;
              first.seed = 0;
              const auto p = shoot(miniature(configuration, 1), 2, first);
              if (!p) return {.why = p.error().message};
              Figure f;
              bool any = false;
              for (const float x : p->sums) {
                f.got += std::isfinite(x) && x >= 0 ? 0 : 1;
                any = any || x > 0;
              }
              if (!any) f.why = "the frame is black: nothing was asked";
              f.unhealthy = cli::samples_gone_wrong(p->health);
              return f;
            });
  }
}

}  // namespace

void add_scales(Table& t) {
  of_any_scale(t);
  anywhere(t);
  first_samples(t);
}

}  // namespace ls::cases

// Lengths: extinctions of 1e8 over 1e-8, scenes of any scale, anywhere, and far away.
#include <fmt/format.h>

#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/checks.h"
#include "cli/cases/stages.h"
#include "cli/validate_measure.h"

namespace ls::cases {
namespace {

// A bit of everything, at a scale: a medium in glass, a floor, a lamp and the sun.
SceneKit miniature(const Way& way, double s) {
  SceneKit kit;
  way.choose(kit);
  const MediumIndex m = way.medium(kit, rgb(2 / s), rgb(.8), .5, box({-s, -s, -s}, {s, s, s}));
  kit.container(SphereShape{}, scale(s), kit.glass(1.3), m);
  kit.shape(RectangleShape{}, translate({0, 0, -1.5 * s}) * scale(4 * s), kit.diffuse(.5));
  const TextureIndex light = kit.texture(rgb(3));
  kit.shape(DiskShape{}, translate({0, 0, 3 * s}) * rotate_x(180) * scale(s), kit.diffuse(0)).emitter =
      AreaEmitter{light};
  kit.scene.emitters.push_back(PointEmitter{{2 * s, 1.5 * s, 1 * s}, rgb(s * s)});
  kit.scene.emitters.push_back(DirectionalEmitter{{.5, .25, -1}, rgb(1)});
  kit.look({-5 * s, -2 * s, 2 * s}, {0, 0, 0}, 35);
  kit.scene.sensor.near_clip = .01 * s;
  kit.scene.sensor.far_clip = 100 * s;
  return kit;
}

void of_any_scale(Table& t) {
  for (const Way& way : all_ways()) {
    for (const int k : {-40, -13, 20, 60}) {
      // Grids in files of Mitsuba's are placed by float32 boxes of their own: the unit cube, at every scale.
      t.exact(fmt::format("N04-scaled-by-2^{}{}", k, way.name()), "N4 7.7",
              "A scene scaled by a power of two has the same pixels, bit for bit.", [=](const Bench& b) {
                return same_bits(b, miniature(way, 1), miniature(way, std::ldexp(1., k)), 8);
              });
    }
    for (const double s : {1e-8, 1e-4, 1e-2, 1e2, 1e4, 1e6}) {
      t.mean(
          fmt::format("N04-sigma-{:g}-over-{:g}{}", 1 / s, s, way.name()), "N4 7.7",
          "Light scattered once in a cube of this size: lengths times s, extinction over s.",
          [=] {
            return lit_cube(way, rgb(1), rgb(1), 0, {0, 0, 0}, s);
          },
          grey(lit_cube_answer(1, 1)));
    }
  }
}

void anywhere(Table& t) {
  for (const Way& way : all_ways()) {
    t.mean(
        "N11-moved-by-1e5" + way.name(), "N11 7.7",
        "A cube a hundred thousand units from the origin: as at the origin.",
        [=] {
          return lit_cube(way, rgb(1), rgb(1), 0, {1e5, -1e5, 1e5});
        },
        grey(lit_cube_answer(1, 1)));
    for (const double distance : {1e3, 1e6}) {
      t.mean(
          fmt::format("N11-seen-from-{:g}{}", distance, way.name()), "N11",
          "The cube seen by a camera this far away: the ray's way through it keeps its length.",
          [=] {
            SceneKit kit = lit_cube(way, rgb(1), rgb(1));
            kit.look({0, 0, -distance}, {0, 0, 0}, 1e-9, {0, 1, 0});
            return kit;
          },
          grey(lit_cube_answer(1, 1)));
    }
    // The cube's size is a ten-thousandth of the scene's: offsets of rays are 2^-20 of that, a hundredth of a
    // thousandth of the cube... times ten.
    t.mean(
        "N11-small-in-a-large-scene" + way.name(), "N11 N4",
        "A cube in the middle of a scene ten thousand times its size.",
        [=] {
          SceneKit kit = lit_cube(way, rgb(1), rgb(1));
          for (const double x : {-1e4, 1e4})
            kit.shape(SphereShape{}, translate({x, 0, 0}) * scale(10), kit.diffuse(0));
          return kit;
        },
        grey(lit_cube_answer(1, 1)));
  }
}

// The very first point of every sequence.
void first_samples(Table& t) {
  for (const Way& way : all_ways()) {
    t.exact("N70-first-samples-of-seed-0" + way.name(), "N70 N6",
            "Seed 0, the first sample of each half: numbers at their very ends break nothing.",
            [way](const Bench& b) -> Figure {
              Bench first = b;
              first.seed = 0;
              const auto p = shoot(miniature(way, 1), 2, first);
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

// What stands in one place: faces on each other, media in each other, cameras at a boundary and inside of
// glass, points on lights; and what a lens makes of what it is not focused on.
#include <fmt/format.h>

#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/checks.h"
#include "cli/cases/stages.h"

namespace ls::cases {
namespace {

constexpr double kDepth = 1;
Channels lit(double depth) { return grey(std::exp(-depth) / (2 * kPi)); }

// A box between the sun and a floor, by its lower and upper corner.
void add_box(SceneKit& kit, MediumIndex m, const Vec3& lo, const Vec3& hi) {
  kit.container(CubeShape{}, box(lo, hi) * box({.5, .5, .5}, {1, 1, 1}), kit.null(), m);
}

// The light falls straight down the edge that the boxes share.
void faces_on_each_other(Table& t) {
  for (const Way& way : both_media()) {
    const auto medium = [way](SceneKit& kit, double sigma) {
      return way.medium(kit, rgb(sigma), rgb(0), 0, box({-1, -1, 1}, {1, 1, 2}));
    };
    t.exact("N41-eight-boxes" + way.name(), "N41 7.7",
            "A box of a medium as eight that share their faces; light runs along an edge of four.",
            [=](const Bench& b) {
              SceneKit kit = lit_floor();
              for (const double x : {-1., 0.})
                for (const double y : {-1., 0.})
                  for (const double z : {1., 1.5})
                    add_box(kit, medium(kit, kDepth), {x, y, z}, {x + 1, y + 1, z + .5});
              return every_value(b, kit, 16, lit(kDepth), 4e-6);
            });
    t.exact("N41-one-on-the-other" + way.name(), "N41",
            "Two media one on the other, their common face there twice: each counts on its side.",
            [=](const Bench& b) {
              SceneKit kit = lit_floor();
              add_box(kit, medium(kit, 1), {-1, -1, 1}, {1, 1, 1.25});
              add_box(kit, medium(kit, 3), {-1, -1, 1.25}, {1, 1, 2});
              return every_value(b, kit, 16, lit(.25 + 3 * .75), 4e-6);
            });
    t.exact("N69-two-halves-in-one-place" + way.name(), "N69 N41",
            "Two media of half the density in the same box are one of the whole.", [=](const Bench& b) {
              SceneKit kit = lit_floor();
              for (int i = 0; i < 2; ++i) add_box(kit, medium(kit, kDepth / 2), {-1, -1, 1}, {1, 1, 2});
              return every_value(b, kit, 16, lit(kDepth), 4e-6);
            });
    t.mean(
        "N69-seen-through-two-halves" + way.name(), "N69",
        "The same, seen through: by flights, of which the shorter one counts.",
        [=] {
          SceneKit kit = unit_cube(way, rgb(kDepth / 2));
          kit.container(CubeShape{}, translate({.5, .5, .5}) * scale(.5), kit.null(),
                        way.medium(kit, rgb(kDepth / 2), rgb(0), 0, Transform{}));
          kit.environment();
          return kit;
        },
        grey(std::exp(-kDepth)));
  }
}

// A pane that takes half the light, in the face of a box of a medium: shadow rays meet either, and take both.
void panes_on_faces(Table& t) {
  for (const Way& way : both_media())
    for (const bool first : {false, true})
      t.exact(fmt::format("N41-pane-{}-the-box-it-lies-on{}", first ? "before" : "after", way.name()), "N41",
              "A mask of 1/2 on the face of a medium: light takes both, whichever of them comes first in the "
              "scene.",
              [=](const Bench& b) {
                SceneKit kit = lit_floor();
                const BsdfIndex mask = kit.bsdf(MaskBsdf{kit.texture(rgb(.5)), kit.diffuse(0)});
                const Transform top = translate({0, 0, 2});
                if (first) kit.shape(RectangleShape{}, top, mask);
                add_box(kit, way.medium(kit, rgb(kDepth), rgb(0), 0, box({-1, -1, 1}, {1, 1, 2})),
                        {-1, -1, 1}, {1, 1, 2});
                if (!first) kit.shape(RectangleShape{}, top, mask);
                return every_value(b, kit, 16, grey(.5 * lit(kDepth)[0]), 4e-6);
              });
}

// L + rho L + rho^2 L ...: directions that meet the wall find the light on it, too.
void lights_on_walls(Table& t) {
  for (const bool first : {false, true})
    t.mean(
        fmt::format("N41-light-{}-the-wall-it-lies-on", first ? "before" : "after"), "N41 N27",
        "A room of reflectance 1/2 whose walls are lit by a light without a material, in the same place: 2.",
        [=] {
          SceneKit kit;
          const BsdfIndex wall = kit.diffuse(.5), null = kit.null();
          const TextureIndex radiance = kit.texture(rgb(1));
          for (const bool light : {first, !first}) {
            Shape& s = kit.shape(CubeShape{}, {}, light ? null : wall);
            s.flip_normals = true;
            if (light) s.emitter = AreaEmitter{radiance};
          }
          kit.look({.1, .2, -.3}, {1, .3, .4}, 60);
          return kit;
        },
        grey(2));
}

// Light given off per length, without extinction, seen from both sides of the face and on it.
void cameras_at_a_boundary(Table& t) {
  for (const Way& way : both_media())
    for (const double x : {-1e-2, -1e-5, -1e-7, 1e-7, 1e-5, 1e-2})
      t.exact(fmt::format("N43-camera-at-{:g}{}", x, way.name()), "N43",
              "A camera just outside and just inside of a shining medium: the way that is left of it.",
              [=](const Bench& b) {
                SceneKit kit = unit_cube(way, rgb(0));
                kit.glow(MediumIndex{0}, rgb(1));
                if (x > 0) kit.scene.sensor.medium = MediumIndex{0};
                kit.look({x, .5, .5}, {x + 1, .5, .5});
                kit.scene.sensor.near_clip = 1e-9;
                return every_value(b, kit, 4, grey(1 - std::max(0., x)), 2e-6);
              });
  // In glass of index n radiance is n^2 times that of the air around it, by whatever reflections it came.
  const auto from_inside = [&](const char* name, const char* about, double expected, bool bubble) {
    t.exact(name, "N43 N64", about, [=](const Bench& b) {
      SceneKit kit;
      kit.shape(SphereShape{}, {}, kit.glass(1.5));
      if (bubble)
        kit.shape(SphereShape{}, translate({.2, 0, .1}) * scale(.3), kit.glass(1.5)).flip_normals = true;
      kit.environment();
      kit.look({.2, .05, .1}, {1, .3, .4}, 60);
      return every_value(b, kit, 16, grey(expected), 2e-5);
    });
  };
  from_inside("N43-inside-of-glass", "A camera in a ball of glass in a white sky: n^2.", 2.25, false);
  from_inside("N43-in-a-bubble-in-glass", "A camera in a bubble of air in a ball of glass: 1.", 1, true);
}

// Where shading points lie on the light itself.
void on_lights(Table& t) {
  const auto alone = [&](const char* name, const Geometry& g) {
    t.exact(fmt::format("N27-on-a-shining-{}", name), "N27",
            "A light that reflects half, alone: its own light does not fall on it.", [=](const Bench& b) {
              SceneKit kit;
              kit.shape(g, {}, kit.diffuse(.5)).emitter = AreaEmitter{kit.texture(rgb(1))};
              kit.look({.4, -.3, 6}, {0, 0, 0}, 5, {0, 1, 0});
              return every_value(b, kit, 64, grey(1), 0);
            });
  };
  alone("disk", DiskShape{});
  alone("square", RectangleShape{});
  alone("sphere", SphereShape{});
  alone("cube", CubeShape{});
}

// A small bright disk out of focus: of the lens, the rays from within a radius of rho / |1 - z / f| hit it.
// The circle of confusion 2 R |z - f| / z at the focus, seen from its middle.
void out_of_focus(Table& t) {
  constexpr double kAperture = .1, kFocus = 4, kDisk = .02;
  for (const double z : {2., 3., 8.}) {
    const double circle = 2 * kAperture * std::abs(z - kFocus) / z, disk = 2 * kDisk * kFocus / z;
    t.mean(
        fmt::format("N47-circle-of-confusion-at-{:g}", z), "N47 7.6g",
        "A disk that is not in focus: spread over a circle of 2 R |z - f| / z.",
        [=] {
          SceneKit kit;
          kit.shape(DiskShape{}, translate({0, 0, z}) * rotate_x(180) * scale(kDisk), kit.diffuse(0))
              .emitter = AreaEmitter{kit.texture(rgb(1))};
          kit.look({0, 0, 0}, {0, 0, 1}, 1e-4, {0, 1, 0});
          kit.scene.sensor.aperture_radius = kAperture;
          kit.scene.sensor.focus_distance = kFocus;
          return kit;
        },
        grey(std::pow(disk / circle, 2)));
  }
}

}  // namespace

void add_places(Table& t) {
  faces_on_each_other(t);
  panes_on_faces(t);
  lights_on_walls(t);
  cameras_at_a_boundary(t);
  on_lights(t);
  out_of_focus(t);
}

}  // namespace ls::cases

// Coincident objects: faces in the same place, overlapping media, cameras at a boundary and inside glass, and
// lights that reflect light themselves; and defocus.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

constexpr double kDepth = 1;
Channels lit(double depth) { return grey(std::exp(-depth) / (2 * kPi)); }

// Adds a box, given by its lower and upper corner, between the sun and a floor.
void add_box(SceneBuilder& builder, MediumIndex m, const Vec3& lo, const Vec3& hi) {
  builder.container(CubeShape{}, box(lo, hi) * box({.5, .5, .5}, {1, 1, 1}), builder.null(), m);
}

// The light that is measured falls straight down the line x = y = 0, along an edge that boxes share or across
// the face between them.
void faces_on_each_other(Table& t) {
  for (const Configuration& configuration : both_media()) {
    const auto medium = [configuration](SceneBuilder& builder, double sigma) {
      return configuration.medium(builder, rgb(sigma), rgb(0), 0, box({-1, -1, 1}, {1, 1, 2}));
    };
    t.exact("N41-eight-boxes" + configuration.name(), "N41 7.7",
            "A box of a medium as eight that share their faces; light runs along an edge of four.",
            [=](const Bench& b) {
              SceneBuilder builder = lit_floor();
              for (const double x : {-1., 0.})
                for (const double y : {-1., 0.})
                  for (const double z : {1., 1.5})
                    add_box(builder, medium(builder, kDepth), {x, y, z}, {x + 1, y + 1, z + .5});
              return every_value(b, builder, 16, lit(kDepth), 4e-6);
            });
    t.exact("N41-one-on-the-other" + configuration.name(), "N41",
            "Two media one on the other, their common face there twice: each counts on its side.",
            [=](const Bench& b) {
              SceneBuilder builder = lit_floor();
              add_box(builder, medium(builder, 1), {-1, -1, 1}, {1, 1, 1.25});
              add_box(builder, medium(builder, 3), {-1, -1, 1.25}, {1, 1, 2});
              return every_value(b, builder, 16, lit(.25 + 3 * .75), 4e-6);
            });
    t.exact("N69-two-halves-in-one-place" + configuration.name(), "N69 N41",
            "Two media of half the density in the same box are one of the whole.", [=](const Bench& b) {
              SceneBuilder builder = lit_floor();
              for (int i = 0; i < 2; ++i)
                add_box(builder, medium(builder, kDepth / 2), {-1, -1, 1}, {1, 1, 2});
              return every_value(b, builder, 16, lit(kDepth), 4e-6);
            });
    t.mean(
        "N69-seen-through-two-halves" + configuration.name(), "N69",
        "The same, seen through: by flights, of which the shorter one counts.",
        [=] {
          SceneBuilder builder = unit_cube(configuration, rgb(kDepth / 2));
          builder.container(CubeShape{}, translate({.5, .5, .5}) * scale(.5), builder.null(),
                            configuration.medium(builder, rgb(kDepth / 2), rgb(0), 0, Transform{}));
          builder.environment();
          return builder;
        },
        grey(std::exp(-kDepth)));
  }
}

// A pane that absorbs half the light, in the same place as the face of a box with a medium. A shadow ray may
// hit either surface first, and must be attenuated by both pane and medium.
void panes_on_faces(Table& t) {
  for (const Configuration& configuration : both_media())
    for (const bool first : {false, true})
      t.exact(
          fmt::format("N41-pane-{}-the-box-it-lies-on{}", first ? "before" : "after", configuration.name()),
          "N41",
          "A mask of 1/2 on the face of a medium: light takes both, whichever of them comes first in the "
          "scene.",
          [=](const Bench& b) {
            SceneBuilder builder = lit_floor();
            const BsdfIndex mask = builder.bsdf(MaskBsdf{builder.texture(rgb(.5)), builder.diffuse(0)});
            const Transform top = translate({0, 0, 2});
            if (first) builder.shape(RectangleShape{}, top, mask);
            add_box(builder,
                    configuration.medium(builder, rgb(kDepth), rgb(0), 0, box({-1, -1, 1}, {1, 1, 2})),
                    {-1, -1, 1}, {1, 1, 2});
            if (!first) builder.shape(RectangleShape{}, top, mask);
            return every_value(b, builder, 16, grey(.5 * lit(kDepth)[0]), 4e-6);
          });
}

// The walls emit L = 1 and reflect rho = 1/2, so the radiance is L + rho L + rho^2 L ... = 2. The emitting
// shape and the reflecting one coincide, so sampled directions that hit the wall must also find the light.
void lights_on_walls(Table& t) {
  for (const bool first : {false, true})
    t.mean(
        fmt::format("N41-light-{}-the-wall-it-lies-on", first ? "before" : "after"), "N41 N27",
        "A room of reflectance 1/2 whose walls are lit by a light without a material, in the same place: 2.",
        [=] {
          SceneBuilder builder;
          const BsdfIndex wall = builder.diffuse(.5), null = builder.null();
          const TextureIndex radiance = builder.texture(rgb(1));
          for (const bool light : {first, !first}) {
            Shape& s = builder.shape(CubeShape{}, {}, light ? null : wall);
            s.flip_normals = true;
            if (light) s.emitter = AreaEmitter{radiance};
          }
          builder.look({.1, .2, -.3}, {1, .3, .4}, 60);
          return builder;
        },
        grey(2));
}

// A medium that emits per length but has no extinction, seen from both sides of its face and from the face
// itself.
void cameras_at_a_boundary(Table& t) {
  for (const Configuration& configuration : both_media())
    for (const double x : {-1e-2, -1e-5, -1e-7, 1e-7, 1e-5, 1e-2})
      t.exact(fmt::format("N43-camera-at-{:g}{}", x, configuration.name()), "N43",
              "A camera just outside and just inside of a shining medium: the way that is left of it.",
              [=](const Bench& b) {
                SceneBuilder builder = unit_cube(configuration, rgb(0));
                builder.set_emission(MediumIndex{0}, rgb(1));
                if (x > 0) builder.scene.sensor.medium = MediumIndex{0};
                builder.look({x, .5, .5}, {x + 1, .5, .5});
                builder.scene.sensor.near_clip = 1e-9;
                return every_value(b, builder, 4, grey(1 - std::max(0., x)), 2e-6);
              });
  // In uniform light, the radiance inside glass of index n is n^2 times that in the air outside, however
  // often the light was reflected inside.
  const auto from_inside = [&](const char* name, const char* about, double expected, bool bubble) {
    t.exact(name, "N43 N64", about, [=](const Bench& b) {
      SceneBuilder builder;
      builder.shape(SphereShape{}, {}, builder.glass(1.5));
      if (bubble)
        builder.shape(SphereShape{}, translate({.2, 0, .1}) * scale(.3), builder.glass(1.5)).flip_normals =
            true;
      builder.environment();
      builder.look({.2, .05, .1}, {1, .3, .4}, 60);
      return every_value(b, builder, 16, grey(expected), 2e-5);
    });
  };
  from_inside("N43-inside-of-glass", "A camera in a ball of glass in a white sky: n^2.", 2.25, false);
  from_inside("N43-in-a-bubble-in-glass", "A camera in a bubble of air in a ball of glass: 1.", 1, true);
}

// Lights that also reflect: the shaded points are on the light itself.
void on_lights(Table& t) {
  const auto alone = [&](const char* name, const Geometry& g) {
    t.exact(fmt::format("N27-on-a-shining-{}", name), "N27",
            "A light that reflects half, alone: its own light does not fall on it.", [=](const Bench& b) {
              SceneBuilder builder;
              builder.shape(g, {}, builder.diffuse(.5)).emitter = AreaEmitter{builder.texture(rgb(1))};
              builder.look({.4, -.3, 6}, {0, 0, 0}, 5, {0, 1, 0});
              return every_value(b, builder, 64, grey(1), 0);
            });
  };
  alone("disk", DiskShape{});
  alone("square", RectangleShape{});
  alone("sphere", SphereShape{});
  alone("cube", CubeShape{});
}

// A small bright disk of radius rho at distance z, out of focus; the focus distance is f, the lens radius R.
// In the middle of its circle of confusion, only rays from the part of the lens within rho / |1 - z / f| of
// its centre hit the disk. The circle's diameter, seen at the focus distance, is 2 R |z - f| / z.
void out_of_focus(Table& t) {
  constexpr double kAperture = .1, kFocus = 4, kDisk = .02;
  for (const double z : {2., 3., 8.}) {
    const double circle = 2 * kAperture * std::abs(z - kFocus) / z, disk = 2 * kDisk * kFocus / z;
    t.mean(
        fmt::format("N47-circle-of-confusion-at-{:g}", z), "N47 7.6g",
        "A disk that is not in focus: spread over a circle of 2 R |z - f| / z.",
        [=] {
          SceneBuilder builder;
          builder.lamp(DiskShape{}, translate({0, 0, z}) * rotate_x(180) * scale(kDisk));
          builder.look({0, 0, 0}, {0, 0, 1}, 1e-4, {0, 1, 0});
          builder.scene.sensor.aperture_radius = kAperture;
          builder.scene.sensor.focus_distance = kFocus;
          return builder;
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

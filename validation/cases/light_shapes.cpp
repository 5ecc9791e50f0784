// Lamps of tiny and of huge solid angle, of zero area, of zero power, and of powers forty orders of magnitude
// apart.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

void tiny(Table& t) {
  for (const double ratio : {1e-1, 1e-3, 1e-5}) {
    const auto add = [&](const char* name, const char* about, const Geometry& lamp, const Transform& facing,
                         double irradiance) {
      t.mean(fmt::format("N26-{}-{:g}", name, ratio), "N26 7.6g", about,
             with_lamp(floor_point(), lamp, translate({0, 0, 1000}) * facing * scale(1000 * ratio)),
             reflected(irradiance), {.slack = 1e-6});
    };
    const Transform down = rotate_x(180);
    add("sphere-r/d", "A shining sphere: pi r^2 / d^2.", SphereShape{}, {}, kPi * ratio * ratio);
    add("disk-r/d", "A shining disk: pi sin^2 of its half angle.", DiskShape{}, down,
        kPi * ratio * ratio / (1 + ratio * ratio));
    add("square-a/d", "A shining square: Lambert's formula at its corners.", RectangleShape{}, down,
        below_a_square(ratio));
  }
}

void huge(Table& t) {
  t.mean(
      "N27-inside-a-shining-sphere", "N27", "A disk inside a shining sphere: irradiance pi.",
      [] {
        SceneBuilder builder;
        builder.shape(DiskShape{}, scale(.1), builder.diffuse(.5));
        builder.lamp(SphereShape{}, {}).flip_normals = true;
        builder.scene.integrator.max_depth = kOnce;
        builder.look({-.2, .1, .1}, {0, 0, 0}, 1e-3);
        return builder;
      },
      reflected(kPi));
  for (const double height : {1e-3, .1, 1.}) {
    // The light is a square of half side 1, at `height` above the floor.
    t.mean(fmt::format("N27-square-at-{:g}", height), "N27 7.6g",
           "A floor this close below a shining square: up to pi, where the square is all it sees.",
           [=] {
             SceneBuilder builder = floor_point(1);
             builder.lamp(RectangleShape{}, translate({0, 0, height}) * rotate_x(180));
             builder.look({-.9, .1, height / 2}, {0, 0, 0}, 1e-4);
             builder.scene.sensor.near_clip = 1e-9;
             return builder;
           },
           reflected(below_a_square(1 / height)), {.slack = 1e-5});
  }
  // A point of the floor near the foot of an emitting wall that is 20 wide and 10 high. With b half the
  // width, h the height, c the distance of the point from the wall and r^2 = c^2 + h^2, the irradiance is
  // atan(b / c) - (c / r) atan(b / r).
  constexpr double kFar = 1e-2, kSide = 10, kR = 10.000005;
  t.mean("N27-at-the-foot-of-a-wall", "N27 7.6g", "A floor up to the very edge of a shining wall.",
         [] {
           SceneBuilder builder;
           builder.shape(RectangleShape{}, translate({1, 0, 0}), builder.diffuse(.5));
           builder.lamp(RectangleShape{}, rotate_y(90) * scale(kSide));
           builder.scene.integrator.max_depth = kOnce;
           builder.look({1, 0, 2}, {kFar, 0, 0}, 1e-4);
           return builder;
         },
         reflected(std::atan(kSide / kFar) - kFar / kR * std::atan(kSide / kR)), {.slack = 1e-5});
}

// Makes an OBJ file of triangles, which are given by their corners.
AssetIndex obj(SceneBuilder& builder, const std::vector<std::array<Vec3, 3>>& triangles) {
  std::string text;
  for (const auto& triangle : triangles)
    for (const Vec3& p : triangle) text += fmt::format("v {} {} {}\n", p[0], p[1], p[2]);
  for (std::size_t i = 0; i < triangles.size(); ++i)
    text += fmt::format("f {} {} {}\n", 3 * i + 1, 3 * i + 2, 3 * i + 3);
  return builder.asset("lamp.obj", text);
}

void of_nothing(Table& t) {
  // The lamp is a square of half side 0.8 at height 1.25, made of two triangles, with three degenerate ones
  // among them.
  const auto lamp = [](bool degenerate, bool proper) {
    SceneBuilder builder = floor_point();
    std::vector<std::array<Vec3, 3>> triangles;
    const Vec3 a{-.8, -.8, 1.25}, b{.8, -.8, 1.25}, c{.8, .8, 1.25}, d{-.8, .8, 1.25};
    if (degenerate) triangles.push_back({a, a, b});
    if (proper) triangles.push_back({a, c, b});
    if (degenerate) {
      triangles.push_back({a, b, {0, -.8, 1.25}});
      triangles.push_back({c, c, c});
    }
    if (proper) triangles.push_back({a, d, c});
    MeshShape mesh;
    mesh.file = obj(builder, triangles);
    builder.lamp(mesh, {});
    return builder;
  };
  t.mean(
      "N28-triangles-without-area-among-others", "N28 N40",
      "They are left out, and the light is what it was.", [=] { return lamp(true, true); },
      reflected(below_a_square(.8 / 1.25)));
  t.exact("N28-no-area-at-all", "N28", "A light of triangles without area: black, and nothing goes wrong.",
          [=](const Bench& b) { return every_value(b, lamp(true, false), 16, grey(0), 0); });
  t.exact("N29-light-of-no-power", "N29", "A black light is left out: the same bits as without it.",
          [](const Bench& b) {
            const SceneBuilder without = with(floor_point(), PointEmitter{{.5, 0, 1}, rgb(3)});
            const SceneBuilder dark = with(without, PointEmitter{{0, .5, 1}, rgb(0)});
            return same_bits(b, with(dark, DirectionalEmitter{{0, 0, -1}, rgb(0)}), without, 16);
          });
  t.exact("N29-only-black-lights", "N29", "Lights of no power alone: black.", [](const Bench& b) {
    SceneBuilder builder = floor_point();
    builder.scene.emitters.push_back(PointEmitter{{0, .5, 1}, rgb(0)});
    builder.lamp(SphereShape{}, translate({0, 0, 2}) * scale(.5), rgb(0));
    return every_value(b, builder, 16, grey(0), 0);
  });
}

void orders_apart(Table& t) {
  // Four or 1000 lamps with intensities from 1e-20 to 1e20. Only the brightest few contribute to the sum
  // noticeably.
  for (const bool tree : {false, true}) {
    const int count = tree ? 1000 : 4;
    double irradiance = 0;
    SceneBuilder builder = floor_point();
    for (int i = 0; i < count; ++i) {
      const double power = std::pow(10., -20 + 40. * i / (count - 1)), a = 2.4 * i;
      const Vec3 p{std::cos(a) * .9, std::sin(a) * .9, 1 + .001 * i};
      const double d2 = .81 + p[2] * p[2];
      irradiance += power * p[2] / std::pow(d2, 1.5);
      builder.scene.emitters.push_back(PointEmitter{p, rgb(power)});
    }
    t.mean(fmt::format("N30-{}-lamps-of-1e-20-to-1e20", count), "N30 N31",
           "Lamps of powers forty orders apart: the brightest make up the sum, and none is lost.", builder,
           reflected(irradiance));
  }
  // A point light (a delta light) reflected by a mirror (a delta lobe): no sampling strategy can find this
  // path, so the answer is black. No strategy may divide by a pdf of 0.
  t.exact("N32-lamp-in-a-mirror", "N32", "A point light in a mirror is not seen, and nothing goes wrong.",
          [](const Bench& b) {
            SceneBuilder builder;
            builder.shape(RectangleShape{}, scale(3), builder.mirror());
            builder.scene.emitters.push_back(PointEmitter{{.5, 0, 1}, rgb(3)});
            builder.look({-2, 1, .6}, {0, 0, 0}, 1e-3);
            return every_value(b, builder, 16, grey(0), 0);
          });
  for (const double s : {1e-15, 1e15}) {
    t.same(
        fmt::format("N32-lengths-of-{:g}", s), "N32",
        "Densities a length of 1e15 or 1e-15 apart: strategies are weighed in a world of unit size.",
        [=] {
          return lit_by(lit_cube({false, true}, rgb(1), rgb(1), 0, {0, 0, 0}, s),
                        PointEmitter{{0, 4 * s, 0}, rgb(s * s)});
        },
        [] {
          return lit_by(lit_cube({false, true}, rgb(1), rgb(1)), PointEmitter{{0, 4, 0}, rgb(1)});
        });
  }
}

}  // namespace

void add_light_shapes(Table& t) {
  tiny(t);
  huge(t);
  of_nothing(t);
  orders_apart(t);
}

}  // namespace ls::cases

// Small scenes under one light of each kind, and comparisons of their pictures, for tests of what rays meet
// and of what lights are linked to.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <variant>

#include "tests/support/significance.h"
#include "tests/unit/render/integrator/aov_picture.h"

namespace ls::render {

inline constexpr const char* kIntegrators[] = {"volpath", "path", "volpath_distant_mis", "whitted"};
inline constexpr std::uint64_t kMany = 64;
using test::operator*;

// The same samples, up to rounding: another shape moves the origin of the world's coordinates.
inline void expect_same_samples(const test::SceneBuilder& a, const test::SceneBuilder& b,
                                const std::string& where) {
  const test::Estimate x = test::estimate(a, 4), y = test::estimate(b, 4);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(x.mean[c], y.mean[c], 0x1p-16 * y.mean[c]) << where;
  EXPECT_GT(y.mean[1], 0) << where;
}
// The rounding of float32 sums is far below 2^-16 of the mean.
inline void expect_same_mean(const test::SceneBuilder& a, const test::SceneBuilder& b,
                             const std::string& where, std::uint64_t samples = kMany) {
  const test::Estimate x = test::estimate(a, samples, 1), y = test::estimate(b, samples, 2);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(
        x.mean[c], y.mean[c],
        test::kStandardErrors * std::hypot(x.standard_error[c], y.standard_error[c]) + 0x1p-16 * y.mean[c])
        << where << ", channel " << c;
}
inline void expect_darker(const test::SceneBuilder& a, const test::SceneBuilder& b,
                          const std::string& where) {
  const test::Estimate x = test::estimate(a, kMany, 1), y = test::estimate(b, kMany, 2);
  EXPECT_LT(x.mean[1],
            y.mean[1] - test::kStandardErrors * std::hypot(x.standard_error[1], y.standard_error[1]))
      << where;
}

// Each function adds a light above the floor.
using AddLight = void (*)(test::SceneBuilder&);
struct NamedLight {
  const char* name;
  bool delta;  // without extent: scattered rays do not find it
  AddLight add;
};
inline constexpr NamedLight kLights[] = {
    {"point", true,
     [](test::SceneBuilder& b) {
       b.scene.emitters.emplace_back(PointEmitter{{.3, .2, 3}, {9, 8, 7}});
     }},
    {"spot", true,
     [](test::SceneBuilder& b) {
       b.scene.emitters.emplace_back(
           SpotEmitter{test::translate({0, 0, 4}) * test::rotate_x(180), {9, 8, 7}, 60, 50, {}, {}});
     }},
    {"directional", true,
     [](test::SceneBuilder& b) {
       b.scene.emitters.emplace_back(DirectionalEmitter{{.1, .2, -1}, {2, 2, 3}});
     }},
    {"sun", false,
     [](test::SceneBuilder& b) {
       b.scene.emitters.emplace_back(DirectionalEmitter{{.1, .2, -1}, {2, 2, 3}, 20});
     }},
    {"constant", false, [](test::SceneBuilder& b) { b.environment(); }},
    {"rectangle", false,
     [](test::SceneBuilder& b) {
       b.lamp(RectangleShape{}, test::translate({0, 0, 3}) * test::rotate_x(180), {5, 4, 3}).visible_camera =
           false;
     }},
    {"ball", false,
     [](test::SceneBuilder& b) {
       b.lamp(SphereShape{}, test::translate({0, 0, 3}) * test::scale(.5), {9, 8, 7}).visible_camera = false;
     }},
};

// A floor of side 4 that the camera sees from above. Paths end after direct light.
inline test::SceneBuilder floor_under(const NamedLight& light, const char* integrator = "volpath") {
  test::SceneBuilder builder({6, 6});
  builder.shape(RectangleShape{}, test::scale(2), builder.diffuse(.5));
  light.add(builder);
  builder.look({0, 0, 9}, {0, 0, 0}, 20, {0, 1, 0});
  builder.scene.integrator.name = integrator;
  builder.scene.integrator.max_depth = 2;
  return builder;
}
// A black ball between the floor and the light, which the camera does not see.
inline Shape& ball(test::SceneBuilder& builder) {
  Shape& s = builder.shape(SphereShape{}, test::translate({.2, 0, 1}) * test::scale(.6), builder.diffuse(0));
  s.visible_camera = false;
  return s;
}

inline BsdfIndex metal(test::SceneBuilder& builder, double alpha) {
  RoughConductorBsdf b;
  b.alpha_u = b.alpha_v = builder.texture({alpha, alpha, alpha});
  b.specular_reflectance = builder.texture({1, 1, 1});
  return builder.bsdf(b);
}

// A cube of fog of side 2 around the origin, alone with the light.
inline test::SceneBuilder fog_under(const NamedLight& light, const char* integrator, bool grid,
                                    bool chromatic = false) {
  test::SceneBuilder builder({6, 6});
  light.add(builder);
  const Rgb albedo{.9, .8, .7};
  const MediumIndex fog =
      grid ? builder.heterogeneous(builder.grid({2, 2, 2}, {1, 2, 3, 1, .5f, 1, 2, 0},
                                                test::translate({-1, -1, -1}) * test::scale(2)),
                                   albedo)
           : builder.homogeneous(chromatic ? Rgb{.4, .8, 1.6} : Rgb{.8, .8, .8}, albedo, .3);
  builder.container(CubeShape{}, {}, builder.null(), fog);
  builder.look({0, -9, .5}, {0, 0, 0}, 20);
  builder.scene.integrator.name = integrator;
  builder.scene.integrator.max_depth = 2;
  builder.scene.film.transparent = true;  // so that the sky is seen in the fog alone
  return builder;
}

inline void hide_light(test::SceneBuilder& builder, std::size_t shapes, bool reflection, bool volume) {
  for (std::size_t i = shapes; i < builder.scene.shapes.size(); ++i) {
    builder.scene.shapes[i].visible_reflection = reflection;
    builder.scene.shapes[i].visible_volume = volume;
  }
  for (Emitter& e : builder.scene.emitters)
    std::visit(
        [&](auto& l) {
          l.visible_reflection = reflection;
          l.visible_volume = volume;
        },
        e);
}

// A floor and fog above it, without the light.
inline test::SceneBuilder foggy_floor(const char* integrator) {
  test::SceneBuilder builder({6, 6});
  builder.shape(RectangleShape{}, test::translate({0, 0, -1.5}) * test::scale(2), builder.diffuse(.5));
  builder.container(CubeShape{}, test::translate({.5, 0, 0}), builder.null(),
                    builder.homogeneous({.5, .5, .5}, {.9, .8, .7}));
  builder.look({0, -9, 3}, {0, 0, -.5}, 20);
  builder.scene.integrator.name = integrator;
  return builder;
}

}  // namespace ls::render

// The projector: values of Mitsuba 3, and the image on a wall.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/scene_builder.h"
#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;

struct OracleRow {
  FovAxis axis;
  V3d p;
  double value[3];
};
// emitter.sample_direction() of Mitsuba 3.9.1 (scalar_rgb) at these points, for the projector below.
constexpr double kFov = 40, kScale = 3;
const OracleRow kOracle[] = {
    {FovAxis::x, {1.3, 2.1, 0}, {0.7532101, 0.376605, 0.09415126}},
    {FovAxis::x, {1.9, 2.3, 0.5}, {0.9099139, 0.4549569, 0.1137392}},
    {FovAxis::x, {1, 1.5, 1}, {3.012798, 0.6025596, 0.3012798}},
    {FovAxis::x, {0.4, 2.4, 2}, {1.161528, 0.580764, 0.290382}},
    {FovAxis::x, {2.2, 1.2, -1}, {1.287708, 0.2575416, 0.1287708}},
    {FovAxis::x, {3.5, 3.5, -3}, {0.4351928, 0.2175964, 0.03626607}},
    {FovAxis::x, {1, 2, 7}, {0, 0, 0}},
    {FovAxis::x, {1.1, 3.7, 0}, {0, 0, 0}},
    {FovAxis::y, {1.3, 2.1, 0}, {0.7532101, 0.376605, 0.09415126}},
    {FovAxis::y, {1.9, 2.3, 0.5}, {0.9099139, 0.4549569, 0.1137392}},
    {FovAxis::y, {1, 1.5, 1}, {3.012798, 0.6025596, 0.3012798}},
    {FovAxis::y, {0.4, 2.4, 2}, {1.161528, 0.580764, 0.290382}},
    {FovAxis::y, {2.2, 1.2, -1}, {1.287708, 0.2575416, 0.1287708}},
    {FovAxis::y, {3.5, 3.5, -3}, {0.4351928, 0.2175964, 0.03626607}},
    {FovAxis::y, {1, 2, 7}, {0, 0, 0}},
    {FovAxis::y, {1.1, 3.7, 0}, {0.8036595, 0.4018297, 0.1004574}},
    {FovAxis::diagonal, {1.3, 2.1, 0}, {0.7532101, 0.376605, 0.09415126}},
    {FovAxis::diagonal, {1.9, 2.3, 0.5}, {0.9099139, 0.4549569, 0.1137392}},
    {FovAxis::diagonal, {1, 1.5, 1}, {3.012798, 0.6025596, 0.3012798}},
    {FovAxis::diagonal, {0.4, 2.4, 2}, {0, 0, 0}},
    {FovAxis::diagonal, {2.2, 1.2, -1}, {1.287708, 0.2575416, 0.1287708}},
    {FovAxis::diagonal, {3.5, 3.5, -3}, {0.4351928, 0.2175964, 0.03626607}},
    {FovAxis::diagonal, {1, 2, 7}, {0, 0, 0}},
    {FovAxis::diagonal, {1.1, 3.7, 0}, {0, 0, 0}},
};

// An image of 3 x 2 texels with the values (1 + x + 3 y, (x + 1) / 2, (y + 1) / 4).
test::SkyImage slide() {
  test::SkyImage s(3, 2);
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 3; ++x) s.set(x, y, {1. + x + 3 * y, .5 * (x + 1), .25 * (y + 1)});
  return s;
}
SceneBuilder projecting(const test::SkyImage& s, const ProjectorEmitter& how, double size = 1) {
  SceneBuilder builder;
  BitmapTexture t;
  t.file = test::add_image(builder, s);
  t.filter = TextureFilter::nearest;
  ProjectorEmitter e = how;
  e.irradiance = SceneBuilder::push<TextureTag>(builder.scene.textures, Texture(t));
  builder.scene.emitters.push_back(e);
  builder.shape(RectangleShape{}, test::scale(size), builder.diffuse(.5));
  return builder;
}
C3 arriving_through(const LightBench& b, const V3d& p) {
  const auto s = b.world->lights.sample(b.world->lights.choose(numbers(.5f, .5f, .5f)), b.at(p));
  return s ? s->radiance / s->pdf : C3(0);
}

TEST(Projector, MatchesMitsuba) {
  // The size of the scene, and so of the world's unit of length
  for (const double size : {.01, 1., 300.})
    for (const OracleRow& row : kOracle) {
      ProjectorEmitter e;
      e.to_world = test::look_at({1, 2, 5}, {1.5, 2, 0}, {0, 1, 0});
      e.fov = kFov;
      e.fov_axis = row.axis;
      e.scale = kScale;
      const LightBench b(projecting(slide(), e, size));
      const C3 got = arriving_through(b, row.p);
      // Both sides compute in float32. Its errors, 1e-7, are far smaller than the distances of these points
      // to the edges of texels.
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(got[c], row.value[c], 3e-6 * row.value[c]) << row.p.x;
    }
}

TEST(Projector, ProjectsItsImageOntoAPlane) {
  ProjectorEmitter e;
  e.to_world = test::look_at({0, 0, 0}, {0, 0, 1}, {0, 1, 0});
  e.fov = 90;
  test::SkyImage grey(1, 1, .25f);
  const LightBench b(projecting(grey, e));
  for (const double distance : {.5, 1., 8.})
    for (const double x : {-.9, 0., .6})
      for (const double y : {-.3, .95}) {
        const auto at = b.irradiance(V3d(x, y, 1) * distance, {0, 0, -1}, 2);
        EXPECT_NEAR(at.mean, M_PI / 4 / (distance * distance), 1e-6 * M_PI / 4 / (distance * distance));
      }
  EXPECT_EQ(arriving_through(b, {1.01, 0, 1}), C3(0));
  EXPECT_EQ(arriving_through(b, {0, 0, -1}), C3(0)) << "behind it";
  EXPECT_EQ(arriving_through(b, {0, 0, 0}), C3(0)) << "in it";
}

TEST(Projector, AsIntensityIsUniformInAllDirections) {
  ProjectorEmitter e;
  e.to_world = test::look_at({0, 0, 0}, {0, 0, 1}, {0, 1, 0});
  e.fov = 90;
  e.scale = 3;
  e.as_intensity = true;
  test::SkyImage grey(1, 1, .25f);
  const LightBench b(projecting(grey, e));
  for (const double distance : {.5, 1., 8.})
    for (const double x : {-.9, 0., .6}) {
      const V3d at = V3d(x, .3, 1) * distance;
      const double want = .75 / at.dot(at);  // in float32, with the squared distance
      EXPECT_NEAR(arriving_through(b, at).x, want, 3e-6 * want);
    }
}

// The light tree chooses by this intensity. If it were the intensity along the axis, a wide projector would
// be chosen too seldom where its corners shine.
TEST(Projector, LightTreeUsesItsMeanIntensity) {
  for (const bool even : {false, true}) {
    ProjectorEmitter e;
    e.fov = 120;
    e.as_intensity = even;
    const SceneBuilder builder = projecting(slide(), e);
    const LightBench b(builder);
    const LightWorld lit{b.world->geometry, b.world->textures};
    const ProjectorLight light = make_light(std::get<ProjectorEmitter>(builder.scene.emitters.front()), lit);

    // A multiple of the numbers of texels in both directions
    constexpr int kSteps = 300;
    double intensity = 0, directions = 0;
    for (int i = 0; i < kSteps; ++i)
      for (int j = 0; j < kSteps; ++j) {
        const float x = light.tan_x * (2 * (i + .5f) / kSteps - 1),
                    y = light.tan_y * (2 * (j + .5f) / kSteps - 1);
        const V3 w = normalize(light.axis + light.axis_u * x + light.axis_v * y);
        const double z = dot(w, light.axis);
        intensity += luminance(light.towards(lit, w)) * z * z * z;
        directions += z * z * z;
      }
    const double mean = intensity / directions;

    // The midpoint rule over squares has an error of (width of a step)^2, which is 1e-4.
    EXPECT_NEAR(light.bounds(lit).intensity, mean, 1e-4 * mean) << even;
  }
}

TEST(Projector, IsUpright) {
  ProjectorEmitter e;
  e.to_world = test::look_at({0, 0, 0}, {0, 0, 1}, {0, 1, 0});  // its left is +x
  e.fov = 90;
  test::SkyImage corner(2, 2);
  corner.set(0, 0, {1, 1, 1});
  const LightBench b(projecting(corner, e));
  EXPECT_GT(arriving_through(b, {.5, .5, 1}).x, 0) << "the upper left corner";
  EXPECT_EQ(arriving_through(b, {-.5, .5, 1}), C3(0));
  EXPECT_EQ(arriving_through(b, {.5, -.5, 1}), C3(0));
}

TEST(Projector, BlackImageIsLeftOut) {
  const LightBench b(projecting(test::SkyImage(2, 2), ProjectorEmitter{}));
  EXPECT_FALSE(b.world->lights.can_sample());
  EXPECT_EQ(b.world->lights.left_out(), 1u);
}

}  // namespace
}  // namespace ls::render

// Closed bodies of few triangles with vertex normals: at the rim these normals point away from the viewer.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/render_check.h"

namespace ls::render {
namespace {

using test::SceneBuilder;

// A ball of 8 x 6 corners with the normals of a sphere, as an OBJ file.
MeshShape coarse_ball(SceneBuilder& builder) {
  constexpr int kAround = 8, kDown = 5;
  std::string text;
  for (int j = 0; j <= kDown; ++j)
    for (int i = 0; i < kAround; ++i) {
      const double a = std::numbers::pi * j / kDown, b = 2 * std::numbers::pi * i / kAround;
      const std::string p =
          fmt::format("{} {} {}\n", std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
      text += "v " + p + "vn " + p;
    }
  const auto face = [&](int a, int b, int c) {
    text += fmt::format("f {0}//{0} {1}//{1} {2}//{2}\n", a + 1, b + 1, c + 1);
  };
  for (int j = 0; j < kDown; ++j)
    for (int i = 0; i < kAround; ++i) {
      const int a = j * kAround + i, b = j * kAround + (i + 1) % kAround;
      if (j > 0) face(a, a + kAround, b);
      if (j < kDown - 1) face(b, a + kAround, b + kAround);
    }
  MeshShape mesh;
  mesh.file = builder.asset("ball.obj", text);
  return mesh;
}

SceneBuilder ball(bool lamp_inside) {
  SceneBuilder builder({32, 32});
  const BsdfIndex white = builder.diffuse(.8);
  builder.shape(coarse_ball(builder), {}, builder.bsdf(TwoSidedBsdf{white, white}));
  if (lamp_inside)
    builder.scene.emitters.push_back(PointEmitter{{0, 0, 0}, {10, 10, 10}});
  else
    builder.environment();
  builder.look({0, .3, -4}, {0, 0, 0}, 40, {0, 1, 0});
  return builder;
}

TEST(Rims, ClosedBodyLeaksNoLight) {
  const auto seen = test::estimate(ball(true), 256);
  EXPECT_EQ(seen.mean[0], 0);
  EXPECT_EQ(seen.mean[1], 0);
}

// Under a sky of radiance 1 no pixel of the ball is brighter than the sky, and none is black: where the
// interpolated normal faces away from the viewer, the geometric normal is used.
TEST(Rims, AreNotBlack) {
  const SceneBuilder builder = ball(false);
  const auto world = test::world_of(builder);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      double sum = 0;
      for (std::uint64_t n = 0; n < 64; ++n) sum += render_sample(*world, x, y, n).rgb[0];
      EXPECT_GT(sum / 64, .3) << x << ", " << y;
      EXPECT_LT(sum / 64, 1.0001) << x << ", " << y;
    }
}

}  // namespace
}  // namespace ls::render

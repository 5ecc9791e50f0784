// Connections to light vertices bring the same image as paths without them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/coloured_phase.h"
#include "tests/support/render_check.h"
#include "tests/support/significance.h"
#include "tests/support/sunny_room.h"

namespace ls::test {
namespace {

struct Means {
  std::array<double, 3> mean{}, variance{};  // of the mean
};
// All pixels of an image share its light vertices, so its pixels tell too little of the error of its mean.
// Images of different seeds are independent.
Means means_of(const SceneBuilder& builder, std::uint64_t spp, int seeds, std::uint64_t first) {
  Means all;
  std::array<double, 3> squares{};
  for (int i = 0; i < seeds; ++i) {
    const Estimate e = estimate(builder, spp, first + static_cast<std::uint64_t>(i));
    for (std::size_t c = 0; c < 3; ++c) {
      all.mean[c] += e.mean[c] / seeds;
      squares[c] += e.mean[c] * e.mean[c] / seeds;
    }
  }
  for (std::size_t c = 0; c < 3; ++c)
    all.variance[c] = (squares[c] - all.mean[c] * all.mean[c]) / (seeds - 1);
  return all;
}

// A disk of radius R and reflectance a in the sun, and a small plate at the height h above its middle that
// faces it: the light that the disk sends to the plate has the irradiance a E cos(sun) R^2 / (R^2 + h^2), the
// form factor of a disk seen from a point on its axis. The plate's shadow falls beside the disk.
TEST(Connections, TransportLightReflectedByASunlitDisk) {
  constexpr int kSeeds = 24;
  constexpr double kRadius = 1, kHeight = .8, kDisk = .8, kPlate = .5, kSun = 5;
  Tests tests("property/lit_disk");
  SceneBuilder b;
  b.scene.integrator.max_depth = 3;
  b.scene.integrator.light_vertices = 1;
  b.shape(DiskShape{}, rotate_x(-90), b.diffuse(kDisk));
  b.shape(RectangleShape{}, translate({0, kHeight, 0}) * rotate_x(90) * scale(.01), b.diffuse(kPlate));
  const Vec3 down = unit({2, -1, 0});
  b.scene.emitters.push_back(DirectionalEmitter{{down[0], down[1], down[2]}, {kSun, kSun, kSun}});
  b.look({0, .3, .1}, {0, kHeight, 0}, 1e-3, {0, 0, 1});
  ASSERT_THAT(estimate(b, 2).variant, testing::HasSubstr("connected"));
  const double expected =
      kPlate / kPi * kDisk * kSun * -down[1] * kRadius * kRadius / (kRadius * kRadius + kHeight * kHeight);
  const Means m = means_of(b, 64, kSeeds, 40);
  const double error = std::sqrt(m.variance[0]);
  const double tolerance = cli::student_quantile(tests.level(), kSeeds - 1) * error;
  EXPECT_LT(std::abs(m.mean[0] - expected), tolerance) << m.mean[0] << " instead of " << expected;
  EXPECT_LT(tolerance, kBiasSeen * expected) << "the test has no power";
  tests.close();
}

// Light on surfaces whose shading normals are tilted by 45 degrees, seen from both of their sides.
SceneBuilder tilted(int light_vertices) {
  SceneBuilder b = SunnyRoom{.light_vertices = light_vertices}.builder();
  const BsdfIndex white = b.diffuse(.7);
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n"
      "-1 -0.4 -0.5 0.7 0.7 0\n0 -0.4 -0.5 0.7 0.7 0\n0 -0.4 0.5 0.7 0.7 0\n-1 -0.4 0.5 0.7 0.7 0\n"
      "4 0 3 2 1\n";
  MeshShape mesh;
  mesh.file = b.asset("tilted.ply", ply);
  mesh.format = MeshFormat::ply;
  b.shape(mesh, {}, b.bsdf(TwoSidedBsdf{white, white}));
  return b;
}

// Directions near the lamp are sampled too, which changes the densities of all subpaths.
SceneBuilder with_lamp(int light_vertices) {
  SceneBuilder b = SunnyRoom{.fog = .3, .light_vertices = light_vertices}.builder();
  b.scene.emitters.push_back(PointEmitter{{0, .5, 0}, {.1, .1, .1}});
  return b;
}

// The integrator `path`, which counts surfaces passed where there is a maximum depth.
SceneBuilder by_path(bool sheet, int light_vertices) {
  SceneBuilder b =
      SunnyRoom{.glossy = sheet, .light_vertices = light_vertices, .max_depth = sheet ? -1 : 5}.builder();
  b.scene.integrator.name = "path";
  return b;
}

TEST(Connections, GiveTheSameImageAsPathsAlone) {
  constexpr int kSeeds = 64;
  Tests tests("property/connections");
  const double level = tests.level(9 * 3);
  const auto room = [](SunnyRoom r) {
    return [r](int light_vertices) mutable {
      r.light_vertices = light_vertices;
      return r.builder();
    };
  };
  struct Rival {
    const char* name;
    std::function<SceneBuilder(int light_vertices)> scene;
    std::uint64_t spp = 32;
  };
  for (const Rival& rival :
       {Rival{"diffuse", room({})}, Rival{"glossy", room({.glossy = true})},
        Rival{"fog", room({.fog = .6}), 16},
        Rival{"fog that scatters colours apart",
              [](int n) { return with_coloured_phase(SunnyRoom{.fog = .6, .light_vertices = n}.builder()); },
              16},
        Rival{"fog and a lamp", with_lamp, 16}, Rival{"tilted normals", tilted, 64},
        Rival{"grid", room({.glossy = true, .fog = .4, .grid = true})},
        Rival{"path", [](int n) { return by_path(false, n); }},
        Rival{"path and a sheet", [](int n) { return by_path(true, n); }}}) {
    const SceneBuilder on = rival.scene(1), off = rival.scene(-1);
    ASSERT_THAT(estimate(on, 2).variant, testing::HasSubstr("connected"));
    ASSERT_THAT(estimate(off, 2).variant, testing::Not(testing::HasSubstr("connected")));
    const Means a = means_of(on, rival.spp, kSeeds, 100), b = means_of(off, 8 * rival.spp, kSeeds, 900);
    for (std::size_t c = 0; c < 3; ++c) {
      const double error = std::sqrt(a.variance[c] + b.variance[c]);
      // Student's test with the freedom of one of the two alone: that of both together is larger
      EXPECT_LT(std::abs(a.mean[c] - b.mean[c]), cli::student_quantile(level, kSeeds - 1) * error)
          << rival.name << ", channel " << c << ": " << a.mean[c] << " and " << b.mean[c];
      std::printf("%s: %g and %g, +- %.2g %%\n", rival.name, a.mean[c], b.mean[c], 100 * error / b.mean[c]);
      EXPECT_LT(error, .01 * b.mean[c]) << rival.name << ": the test has no power";
    }
  }
  tests.close();
}

}  // namespace
}  // namespace ls::test

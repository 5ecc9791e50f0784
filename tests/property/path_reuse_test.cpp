// Paths that serve several pixels bring the same image as paths that serve one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>

#include "tests/support/lamp_room.h"
#include "tests/support/seed_means.h"
#include "tests/support/significance.h"

namespace ls::test {
namespace {

// A point light on the way to which stands a glass ball, and a mirror ball: paths begin with delta lobes.
SceneBuilder mirrors(int path_reuse) {
  SceneBuilder b = LampRoom{.path_reuse = path_reuse}.builder();
  b.scene.emitters.push_back(PointEmitter{{-.5, .8, .5}, {.5, .6, .7}});
  b.shape(SphereShape{{.2, -.7, -.2}, .3}, {}, b.glass(1.5));
  b.shape(SphereShape{{-.2, -.3, -.6}, .3}, {}, b.mirror());
  return b;
}

TEST(PathReuse, GivesTheSameImageAsPathsAlone) {
  constexpr int kSeeds = 64;
  Tests tests("property/path_reuse");
  struct Rival {
    const char* name;
    std::function<SceneBuilder(int path_reuse)> scene;
  };
  const auto room = [](LampRoom r) {
    return [r](int path_reuse) mutable {
      r.path_reuse = path_reuse;
      return r.builder();
    };
  };
  const Rival rivals[] = {{"diffuse", room({})},
                          {"glossy", room({.glossy = true})},
                          {"fog", room({.fog = .8})},
                          {"glossy in fog", room({.glossy = true, .fog = .4})},
                          {"chromatic fog", room({.fog = 1, .chromatic = true})},
                          {"mirrors", mirrors}};
  const double level = tests.level(std::size(rivals) * 3);
  for (const Rival& rival : rivals) {
    const SceneBuilder on = rival.scene(7), off = rival.scene(0);
    ASSERT_THAT(estimate(on, 2).variant, testing::HasSubstr("shared")) << rival.name;
    ASSERT_THAT(estimate(off, 2).variant, testing::Not(testing::HasSubstr("shared")));
    const Means a = means_of(on, 32, kSeeds, 100), b = means_of(off, 64, kSeeds, 900);
    for (std::size_t c = 0; c < 3; ++c) {
      const double error = std::sqrt(a.variance[c] + b.variance[c]);
      // Student's test with the freedom of one of the two alone: that of both together is larger
      EXPECT_LT(std::abs(a.mean[c] - b.mean[c]), cli::student_quantile(level, kSeeds - 1) * error)
          << rival.name << ", channel " << c << ": " << a.mean[c] << " and " << b.mean[c];
      std::printf("%s: %g and %g, +- %.2g %%\n", rival.name, a.mean[c], b.mean[c], 100 * error / b.mean[c]);
      EXPECT_LT(error, .005 * b.mean[c]) << rival.name << ": the test has no power";
    }
  }
  tests.close();
}

}  // namespace
}  // namespace ls::test

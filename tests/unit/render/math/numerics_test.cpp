// Frames stay orthonormal, and directions stay unit vectors.
#include <gtest/gtest.h>

#include <cmath>

#include "worker/render/math/random.h"
#include "worker/render/media/phase.h"

namespace ls::render {
namespace {

TEST(Frame, IsOrthonormalForEveryNormal) {
  for (const V3& n : {V3(0, 0, -1), V3(0, 0, 1), V3(1e-20f, 0, -1), V3(1e-4f, -1e-4f, -1), V3(1, 0, -0.f),
                      V3(0, 1, 0.f), V3(-.6f, .8f, -1e-30f)}) {
    const V3 unit = normalize(n);
    const Frame f(unit);
    for (const V3& v : {f.s, f.t, f.n}) EXPECT_NEAR(dot(v, v), 1, 4e-7);
    EXPECT_NEAR(dot(f.s, f.t), 0, 2e-7);
    EXPECT_NEAR(dot(f.s, f.n), 0, 2e-7);
    EXPECT_NEAR(dot(f.t, f.n), 0, 2e-7);
    EXPECT_NEAR(dot(cross(f.s, f.t), f.n), 1, 4e-7);
  }
}

TEST(Directions, KeepTheirLengthOverAHundredThousandScatterings) {
  for (const float g : {0.f, .9f, -.9999f, .9999f}) {
    const HenyeyGreenstein phase{g};
    RandomStream stream(7);
    V3 w(0, 0, -1);
    for (int i = 0; i < 100'000; ++i) {
      const float u = stream.uniform(), v = stream.uniform();
      w = phase.sample(w, {u, v}).w;
      ASSERT_NEAR(std::sqrt(double{w.x} * w.x + double{w.y} * w.y + double{w.z} * w.z), 1, 1e-6) << i;
    }
  }
}

}  // namespace
}  // namespace ls::render

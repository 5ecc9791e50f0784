// Small lamps in the middle of a large world: their own coordinates are small, those of the points that they
// light are large.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::operator*;
using test::scale;
using test::translate;

// A lamp of half size `size` near the centre of a ball of radius 1 that encloses it.
SceneBuilder lamp_in_a_ball(const ls::Geometry& g, double size) {
  SceneBuilder builder;
  builder.lamp(g, translate({1e-4, -2e-4, 3e-5}) * test::rotate_x(33) * scale(size));
  builder.shape(SphereShape{}, {}, builder.diffuse(.5)).flip_normals = true;
  return builder;
}

V3 direction_of(RandomStream& r) {
  const float z = 2 * r.uniform() - 1;
  const V2 c = unit_circle(r.uniform());
  const float sine = std::sqrt(1 - z * z);
  return {sine * c.x, sine * c.y, z};
}

TEST(SmallLamp, IsNotHiddenByItself) {
  const ls::Geometry kinds[] = {RectangleShape{}, DiskShape{}, CubeShape{}, SphereShape{},
                                CylinderShape{{0, 0, -1}, {0, 0, 1}, .5}};
  for (const ls::Geometry& kind : kinds)
    for (const double size : {.2, .02, .001}) {
      const LightBench b(lamp_in_a_ball(kind, size));
      RandomStream r(3);
      int sampled = 0, hidden = 0;
      for (int i = 0; i < 20000; ++i) {
        const V3 x = direction_of(r) * (.9f * static_cast<float>(b.world->geometry.scale));
        const auto s =
            b.world->lights.sample(b.world->lights.choose(numbers(0, r.uniform(), r.uniform())), x);
        if (!s) continue;
        ++sampled;
        const V3 f = s->target - x;  // shadow rays are aimed at the target
        const float distance = std::sqrt(dot(f, f));
        hidden += b.world->accel.occluded(x, f / distance, distance) ? 1 : 0;
      }
      // Half of the points see only the back of a flat lamp
      EXPECT_GT(sampled, 5000) << kind.index() << ' ' << size;
      EXPECT_EQ(hidden, 0) << kind.index() << ' ' << size << " of " << sampled;
    }
}

}  // namespace
}  // namespace ls::render

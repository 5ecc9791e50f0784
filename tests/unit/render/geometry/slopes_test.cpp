// dp/du and dp/dv of hits on all kinds of shapes, as bump maps need them: they must match the distances
// between neighbouring hits.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/scene_builder.h"
#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::operator*;
using test::translate;

SceneBuilder bumpy(const ls::Geometry& g, bool flip) {
  SceneBuilder builder;
  BitmapTexture t;
  t.file = test::add_image(builder, test::SkyImage(4, 4, 1));
  const TextureIndex heights = SceneBuilder::push<TextureTag>(builder.scene.textures, Texture(t));
  const BsdfIndex grey = builder.diffuse(.5);
  const BsdfIndex bump = builder.bsdf(BumpMapBsdf{heights, 1, grey});
  // The size is far from 1, so that the world's scale matters.
  Shape& s = builder.shape(
      g, translate({300, 20, -40}) * test::rotate_x(35) * test::rotate_y(50) * test::scale(70), bump);
  s.flip_normals = flip;
  return builder;
}

TEST(Slopes, MatchTheDistanceOfNeighbours) {
  const ls::Geometry kinds[] = {RectangleShape{}, DiskShape{}, SphereShape{}, CubeShape{}};
  for (const ls::Geometry& g : kinds)
    for (const bool flip : {false, true}) {
      const LightBench b(bumpy(g, flip));
      RandomStream r(4);
      int met = 0;
      for (int i = 0; i < 4000; ++i) {
        const auto random = [&] { return V3(2 * r.uniform() - 1, 2 * r.uniform() - 1, 2 * r.uniform() - 1); };
        const V3 o = normalize(random()) * 4, d = normalize(random() * .4f - o),
                 e = normalize(d + random() * 1e-3f);
        const auto first = b.world->accel.nearest(o, d, kInfinity),
                   second = b.world->accel.nearest(o, e, kInfinity);
        SurfaceHit p, q;
        if (!first || !second || !b.world->geometry.complete(*first, o, d, p) ||
            !b.world->geometry.complete(*second, o, e, q) || dot(p.ng, q.ng) < .99f)
          continue;
        const V2 moved = q.uv - p.uv;
        if (std::abs(moved.x) > .01f || std::abs(moved.y) > .01f) continue;  // across the seam, or at a pole
        if (std::abs(dot(d, p.ng)) < .2f) continue;
        ++met;
        const auto scale = static_cast<float>(b.world->geometry.scale);
        const V3 predicted =
            (p.shading.to_world(p.du) * moved.x + p.shading.to_world(p.dv) * moved.y) * scale;
        const V3 apart = q.p - p.p;
        // The chord is at most 4e-3 / .2 of the ball's radius and deviates from the tangent by half of that.
        // An azimuth of at most 2 pi / 100 about a pole or centre adds half of itself. Together these are at
        // most 4 % of the chord.
        ASSERT_LT((predicted - apart).length(), .06f * apart.length() + 2e-6f)
            << g.index() << " at " << p.uv.x << " " << p.uv.y;
      }
      EXPECT_GT(met, 500) << g.index();
    }
}

// A slope is a ratio of lengths, in units of the scene: du and dv do not depend on the world's scale.
TEST(Slopes, AreInSceneUnits) {
  const LightBench b(bumpy(RectangleShape{}, false));
  SurfaceHit hit;
  const V3 o = V3(b.at({300, 20, -40}));
  bool met = false;
  for (const V3& d : {V3(1, 0, 0), V3(0, 1, 0), V3(0, 0, 1)}) {
    const auto primitive = b.world->accel.nearest(o - d * 3, d, kInfinity);
    if (!primitive || !b.world->geometry.complete(*primitive, o - d * 3, d, hit)) continue;
    met = true;
    EXPECT_NEAR(hit.du.length(), 140, 1e-3) << "2 x 70 over u from 0 to 1";
    EXPECT_NEAR(hit.dv.length(), 140, 1e-3);
  }
  EXPECT_TRUE(met);
}

}  // namespace
}  // namespace ls::render

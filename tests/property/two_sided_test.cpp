// A lamp that shines on both sides brings the same image as two lamps back to back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/property/quarters.h"
#include "tests/support/significance.h"
#include "worker/render/world/world.h"

namespace ls::test {
namespace {

// Half the distance of the two lamps. The lamps are .4 wide and seen from .3 or more, so light differs by
// less than 4 kHalfGap / .3 = 1e-3 of itself, a tenth of the errors below.
constexpr double kHalfGap = 1e-4;

// Where the lamps are along x. The room is from -2 to 2.
constexpr double kAt = .8;

struct LitRoom {
  const char* name;
  bool round = false;   // a cylinder, open at its ends, instead of squares
  bool closed = false;  // a box around the middle, which is seen from inside
  double fog = .5;
  int lamps = 1;
  std::function<void(SceneBuilder&)> change = [](SceneBuilder&) {};
  const char* variant = "";
  std::uint64_t spp = 64;
};

// A room of fog with lamps in its middle that light two unequal halves.
SceneBuilder lit_room(const LitRoom& rival, bool back_to_back) {
  SceneBuilder b(FrameSize{kSide, kSide});
  b.scene.integrator.max_depth = 4;
  b.scene.integrator.path_reuse = -1;
  b.scene.integrator.local_lights = -1;
  b.look({-1.2, .5, .9}, {.8, -.1, -.1}, 75, {0, 1, 0});
  const BsdfIndex left = b.diffuse(.7), right = b.bsdf(DiffuseBsdf{b.texture({.2, .4, .6})}),
                  there = b.bsdf(TwoSidedBsdf{left, right}), back = b.bsdf(TwoSidedBsdf{right, left});
  b.shape(CubeShape{}, scale(2, 1, 1), left).flip_normals = true;
  b.shape(RectangleShape{}, translate({1.99, 0, 0}) * rotate_y(-90), right);
  const auto lamp = [&](const ls::Geometry& g, const Transform& t, const Rgb& radiance, bool flip) {
    Shape& s = b.shape(g, t, flip ? back : there);
    s.flip_normals = flip;
    s.emitter = AreaEmitter{b.texture(radiance)};
    s.emitter->two_sided = !back_to_back;
  };
  for (int i = 0; i < rival.lamps; ++i) {
    const Rgb radiance{3. + .1 * i, 4, 5};
    const double size = .2 / std::sqrt(rival.lamps),
                 z = rival.lamps == 1 ? 0 : -.8 + 1.6 * i / (rival.lamps - 1);
    // With an offset, moved to the side of its own normal; without, in the middle.
    const auto put = [&](double out, bool flip) {
      if (rival.round)
        lamp(CylinderShape{{kAt, -.3, z}, {kAt, .3, z}, size + (flip ? -out : out)}, {}, radiance, flip);
      else if (rival.closed)
        lamp(CubeShape{}, translate({0, 0, z}) * scale(.9 + (flip ? -out : out)), radiance, flip);
      else
        lamp(RectangleShape{}, translate({kAt + (flip ? -out : out), 0, z}) * rotate_y(90) * scale(size),
             radiance, flip);
    };
    if (!back_to_back) {
      put(0, false);
    } else {
      put(kHalfGap, false);
      put(kHalfGap, true);
    }
  }
  if (rival.fog > 0) {
    const MediumIndex air = b.homogeneous({rival.fog, rival.fog, rival.fog}, {.9, .8, .7}, .4);
    b.container(CubeShape{}, scale(1.97, .97, .97), b.null(), air);
    b.scene.sensor.medium = air;
  }
  rival.change(b);
  return b;
}

TEST(TwoSidedLights, GiveTheSameImageAsTwoLampsBackToBack) {
  constexpr int kSeeds = 24;
  Tests tests("property/two_sided");
  const auto inside = [](SceneBuilder& b) { b.look({-.7, .3, .5}, {.4, -.2, -.3}, 75, {0, 1, 0}); };
  const auto by_path = [](SceneBuilder& b) { b.scene.integrator.name = "path"; };
  const auto shared = [](SceneBuilder& b) { b.scene.integrator.path_reuse = 8; };
  const auto local = [](SceneBuilder& b) {
    b.scene.integrator.local_lights = 1;
    b.scene.emitters.push_back(PointEmitter{{1.5, .5, .5}, {.1, .1, .1}});
  };
  const auto sun = [](SceneBuilder& b) {  // through the ceiling, which is taken away
    b.scene.shapes.erase(b.scene.shapes.begin());
    b.scene.emitters.push_back(DirectionalEmitter{{.3, -1, .2}, {1, 1, 1}});
    b.scene.integrator.light_vertices = 1;
  };
  const LitRoom rivals[] = {
      {"a square in fog"},
      {"a square, by `path`", false, false, 0, 1, by_path},
      {"a tube in fog", true},
      {"a box, from inside", false, true, .5, 1, inside},
      {"shared paths", false, false, .5, 1, shared, "shared"},
      {"chosen by place", false, false, .5, 2, local},
      {"chosen by a tree, by `path`", false, false, 0, 40, by_path},
      {"a sun, connected", false, false, .3, 1, sun, "connected"},
  };
  const double level = tests.level(std::size(rivals) * kQuarters);
  for (const LitRoom& rival : rivals) {
    const SceneBuilder one = lit_room(rival, false), two = lit_room(rival, true);
    ASSERT_THAT(estimate(one, 2).variant, testing::HasSubstr(rival.variant)) << rival.name;
    expect_same_quarters(rival.name, level, quarters_of(one, rival.spp, kSeeds, 100),
                         quarters_of(two, rival.spp, kSeeds, 900), kSeeds);
  }
  tests.close();
}

}  // namespace
}  // namespace ls::test

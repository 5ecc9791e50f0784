// Nested and intersecting media. Media that only emit show, without noise, how far a ray travelled in each.
// The expected light is computed from the geometry, point by point.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/base/digest.h"
#include "tests/support/render_check.h"
#include "worker/render/world/overlap.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

MediumIndex glowing(SceneBuilder& builder, double emission, int priority = 0) {
  HomogeneousMedium m;
  m.sigma_t = {0, 0, 0};
  m.phase = builder.phase(0);
  m.emission = {emission, emission, emission};
  m.priority = priority;
  return SceneBuilder::push<MediumTag>(builder.scene.media, m);
}
void look_along_x(SceneBuilder& builder, const Vec3& from) {
  builder.look(from, {from[0] + 1, from[1], from[2]}, 1e-4);
}
double seen(const SceneBuilder& builder) { return render_sample(*test::world_of(builder), 0, 0, 0).rgb[0]; }

// A cube or ball, and the index of the medium in it.
struct Body {
  bool ball = false;
  V3d center{0, 0, 0};
  double size = 1;
  int medium = 0;
  bool holds(const V3d& p) const {
    const V3d q = p - center;
    if (ball) return q.length() < size;
    return std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z)}) < size;
  }
  // Adds the two t at which the line p + t (1, 0, 0) meets the body.
  void ends(const V3d& p, std::vector<double>& at) const {
    const V3d q = p - center;
    const double half = ball ? std::sqrt(std::max(0., size * size - q.y * q.y - q.z * q.z)) : size;
    at.push_back(-q.x - half);
    at.push_back(-q.x + half);
  }
};
struct Glow {
  double emission;
  int priority;
};

// The light that a ray along +x collects. Between two successive boundaries the media are those that contain
// the point halfway between them.
double expected_along_x(const std::vector<Body>& bodies, const std::vector<Glow>& media, const V3d& from) {
  std::vector<double> at{0};
  for (const Body& b : bodies) b.ends(from, at);
  std::erase_if(at, [](double t) { return t < 0; });
  std::sort(at.begin(), at.end());
  double light = 0;
  for (std::size_t i = 0; i + 1 < at.size(); ++i) {
    const V3d middle = from + V3d((at[i] + at[i + 1]) / 2, 0, 0);
    int highest = -1000;
    double emission = 0;
    for (const Body& b : bodies) {
      const Glow& m = media[static_cast<std::size_t>(b.medium)];
      if (!b.holds(middle) || m.priority < highest) continue;
      emission = (m.priority > highest ? 0 : emission) + m.emission;
      highest = m.priority;
    }
    light += emission * (at[i + 1] - at[i]);
  }
  return light;
}

SceneBuilder scene_of(const std::vector<Body>& bodies, const std::vector<Glow>& media) {
  SceneBuilder builder({1, 1});
  std::vector<MediumIndex> indices;
  for (const Glow& m : media) indices.push_back(glowing(builder, m.emission, m.priority));
  const BsdfIndex null = builder.null();
  for (const Body& b : bodies) {
    const ls::Geometry shape = b.ball ? ls::Geometry{SphereShape{}} : ls::Geometry{CubeShape{}};
    builder.container(shape, translate({b.center.x, b.center.y, b.center.z}) * test::scale(b.size), null,
                      indices[static_cast<std::size_t>(b.medium)]);
  }
  return builder;
}

// The error for each boundary and unit of emission: positions in a world of size 10 are accurate to 2^-20 of
// it.
constexpr double kPerBoundary = 1e-4;

TEST(Overlaps, AddUpOrYieldByPriorityInRandomScenes) {
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> u(-2, 2), size(.3, 2);
  const std::vector<Glow> media{{1, 0}, {3, 0}, {10, 1}, {30, -1}, {.1, 1}};
  for (int scene = 0; scene < 60; ++scene) {
    std::vector<Body> bodies(2 + rng() % 10);
    for (Body& b : bodies) {
      b.ball = rng() % 2 == 0;
      b.center = {u(rng), u(rng), u(rng)};
      b.size = size(rng);
      b.medium = static_cast<int>(rng() % media.size());
    }
    SceneBuilder builder = scene_of(bodies, media);
    const V3d from(-8, u(rng) / 2, u(rng) / 2);
    look_along_x(builder, {from.x, from.y, from.z});
    const double expected = expected_along_x(bodies, media, from);
    EXPECT_NEAR(seen(builder), expected, kPerBoundary * 30 * static_cast<double>(bodies.size())) << scene;
  }
}

// Cubes on a lattice, so that most of their faces coincide.
TEST(Overlaps, AreRightWithManyCoincidentFaces) {
  std::mt19937 rng(8);
  const std::vector<Glow> media{{1, 0}, {3, 0}, {10, 1}, {30, -1}, {.1, 1}};
  for (int scene = 0; scene < 60; ++scene) {
    std::vector<Body> bodies(2 + rng() % 14);
    const auto whole = [&] { return static_cast<double>(rng() % 5) - 2; };
    for (Body& b : bodies) {
      b.center = {whole(), whole(), whole()};
      b.size = 1 + static_cast<double>(rng() % 2);
      b.medium = static_cast<int>(rng() % media.size());
    }
    SceneBuilder builder = scene_of(bodies, media);
    const V3d from(-8, .37, -.21);
    look_along_x(builder, {from.x, from.y, from.z});
    const double expected = expected_along_x(bodies, media, from);
    EXPECT_NEAR(seen(builder), expected, kPerBoundary * 30 * static_cast<double>(bodies.size())) << scene;
  }
}

// The camera is inside several media. The sensor names one of them; the others must be found.
TEST(Overlaps, WorkAroundTheCamera) {
  std::mt19937 rng(9);
  std::uniform_real_distribution<double> u(-.5, .5), size(.8, 2);
  const std::vector<Glow> media{{1, 0}, {3, 0}, {10, 1}, {30, -1}};
  for (int scene = 0; scene < 40; ++scene) {
    std::vector<Body> bodies(3);
    for (Body& b : bodies) {
      b.ball = rng() % 2 == 0;
      b.center = {u(rng), u(rng), u(rng)};
      b.size = size(rng);
      b.medium = static_cast<int>(rng() % media.size());
    }
    const V3d from(.01, .02, .03);
    const auto around =
        std::find_if(bodies.begin(), bodies.end(), [&](const Body& b) { return b.holds(from); });
    if (around == bodies.end()) continue;
    SceneBuilder builder = scene_of(bodies, media);
    look_along_x(builder, {from.x, from.y, from.z});
    builder.scene.sensor.medium = MediumIndex{static_cast<std::uint32_t>(around->medium)};
    EXPECT_NEAR(seen(builder), expected_along_x(bodies, media, from), .01) << scene;
  }
}

// A camera on one side of a boundary gets the same light as on the other, up to the distance between the two
// places.
TEST(Overlaps, AreTheSameFromBothSidesOfABoundary) {
  const std::vector<Glow> media{{1, 0}, {3, 0}};
  const std::vector<Body> bodies{{false, {0, 0, 0}, 2, 0}, {true, {0, 0, 0}, 1, 1}};
  for (const double boundary : {-2., -1., 1.}) {
    double side[2];
    for (const int inside : {0, 1}) {
      SceneBuilder builder = scene_of(bodies, media);
      const V3d from(boundary + (inside ? 1e-4 : -1e-4), 0, 0);
      look_along_x(builder, {from.x, from.y, from.z});
      for (std::uint32_t i = 0; i < 2; ++i)
        if (bodies[i].holds(from)) builder.scene.sensor.medium = MediumIndex{i};
      side[inside] = seen(builder);
    }
    EXPECT_NEAR(side[0], side[1], 4 * 2e-4 + 1e-3) << boundary;
    EXPECT_GT(side[0], 1) << boundary;
  }
}

// A boundary that names an exterior medium replaces this medium inside, and restores it where the ray leaves.
TEST(Overlaps, ReplaceTheNamedExterior) {
  SceneBuilder builder({1, 1});
  const MediumIndex fog = glowing(builder, 1), amber = glowing(builder, 10);
  const BsdfIndex null = builder.null();
  builder.container(CubeShape{}, test::scale(3), null, fog);
  builder.container(SphereShape{}, {}, null, amber).exterior = fog;
  look_along_x(builder, {-8, 0, 0});
  EXPECT_NEAR(seen(builder), 4 * 1 + 2 * 10, 1e-3);
}

// The exterior that a ball names is not the medium around it. This must not replace the medium around it: the
// medium at a point depends neither on the path to the point nor on whether a medium without effect is left
// out.
TEST(Overlaps, DoNotReplaceTheCamerasMediumByAMissingExterior) {
  for (const bool named : {false, true}) {
    SceneBuilder builder({1, 1});
    const MediumIndex fog = glowing(builder, 1), amber = glowing(builder, 10), nothing = glowing(builder, 0);
    Shape& ball = builder.container(SphereShape{}, {}, builder.null(), amber);
    if (named) ball.exterior = nothing;
    builder.shape(CubeShape{}, translate({5, 0, 0}), builder.diffuse(0));
    look_along_x(builder, {-8, 0, 0});
    builder.scene.sensor.medium = fog;
    EXPECT_NEAR(seen(builder), 12 * 1 + 2 * 10, 1e-3) << named;
  }
}

// Neither surfaces nor media are visible beyond far_clip.
TEST(Overlaps, MediaEndAtTheFarClip) {
  for (const bool two : {false, true}) {
    SceneBuilder builder({1, 1});
    const MediumIndex fog = glowing(builder, 1), amber = glowing(builder, 10);
    if (two) builder.container(CubeShape{}, test::scale(50), builder.null(), amber);
    look_along_x(builder, {0, 0, 0});
    builder.scene.sensor.medium = fog;
    builder.scene.sensor.far_clip = 5;
    EXPECT_NEAR(seen(builder), 5 * (two ? 11 : 1), 1e-3) << two;
  }
}

// An empty medium of higher priority is a hole.
TEST(Overlaps, CanBeHollowedOut) {
  SceneBuilder builder({1, 1});
  const MediumIndex fog = glowing(builder, 1), hole = glowing(builder, 0, 5);
  const BsdfIndex null = builder.null();
  builder.container(CubeShape{}, test::scale(3), null, fog);
  builder.container(SphereShape{}, {}, null, hole);
  look_along_x(builder, {-8, 0, 0});
  EXPECT_NEAR(seen(builder), 4, 1e-3);
}

// Six rectangles around a place enclose it: a path may leave through another one than the one through which
// it entered.
TEST(Overlaps, EndAtTheWallsOfThinSheets) {
  SceneBuilder builder({1, 1});
  const MediumIndex fog = glowing(builder, 1), amber = glowing(builder, 10);
  const BsdfIndex null = builder.null();
  for (const double turn : {0., 90., 180., 270.})
    builder.container(RectangleShape{}, test::rotate_y(turn) * translate({0, 0, 1}), null, fog);
  for (const double turn : {90., -90.})
    builder.container(RectangleShape{}, test::rotate_x(turn) * translate({0, 0, 1}), null, fog);
  builder.container(SphereShape{}, test::scale(.5), null, amber);
  look_along_x(builder, {-8, 0, 0});
  EXPECT_NEAR(seen(builder), 2 * 1 + 1 * 10, 1e-3);
}

TEST(Overlaps, RejectSamplesInTooManyMedia) {
  SceneBuilder builder({1, 1});
  const MediumIndex fog = glowing(builder, 1);
  const BsdfIndex null = builder.null();
  for (int i = 0; i <= MediaState::kCapacity; ++i) {
    const auto world = test::world_of([&] {
      builder.container(SphereShape{}, test::scale(1 + .05 * i), null, fog);
      look_along_x(builder, {-8, 0, 0});
      return builder;
    }());
    EXPECT_EQ(render_sample(*world, 0, 0, 0).finite, i < MediaState::kCapacity) << i;
  }
}

// Without overlaps the state of media gives the same bits as following the last boundary
SceneBuilder nested_by_the_book() {
  SceneBuilder builder({8, 8});
  const MediumIndex fog = builder.homogeneous({.3, .4, .5}, {.9, .8, .7}, .3),
                    amber = builder.homogeneous({2, 1, .5}, {.5, .6, .7}),
                    outside = builder.homogeneous({.05, .05, .05}, {.9, .9, .9});
  builder.container(CubeShape{}, test::scale(3), builder.null(), fog).exterior = outside;
  builder.container(SphereShape{}, translate({1, 0, 0}), builder.glass(1.5), amber).exterior = fog;
  builder.container(CubeShape{}, translate({-1.5, .2, 0}) * test::scale(.7), builder.null(), amber).exterior =
      fog;
  const TextureIndex light = builder.texture({5, 5, 5});
  builder.shape(SphereShape{}, translate({0, 2, 5}) * test::scale(.5), builder.diffuse(0)).emitter =
      AreaEmitter{light};
  builder.environment(.2);
  builder.look({0, -9, 1}, {0, 0, 0}, 45);
  builder.scene.sensor.medium = outside;
  return builder;
}

TEST(Overlaps, SeparateMediaKeepAllBits) {
  const SceneBuilder builder = nested_by_the_book();
  const auto world = test::world_of(builder);
  ASSERT_TRUE(world->overlaps);  // their bounding boxes overlap
  const auto with = render_tile_as(*world, "everything", {0, 0, 8, 8}, {0, 64});
  const_cast<World&>(*world).overlaps = false;
  const auto without = render_tile_as(*world, "everything", {0, 0, 8, 8}, {0, 64});
  EXPECT_EQ(with.sums, without.sums);
  EXPECT_GT(with.sums[0], 0);
  EXPECT_EQ(with.health.nonfinite, 0u);
}

TEST(Overlaps, AreUsedOnlyByScenesWithOverlaps) {
  const auto needs = [](const Vec3& second, bool named) {
    SceneBuilder builder({1, 1});
    const MediumIndex fog = builder.homogeneous({1, 1, 1}, {0, 0, 0});
    const BsdfIndex null = builder.null();
    builder.container(CubeShape{}, {}, null, fog);
    builder.container(CubeShape{}, translate(second), null, fog);
    if (named) builder.scene.sensor.medium = builder.homogeneous({1, 1, 1}, {0, 0, 0});
    look_along_x(builder, {-8, 0, 0});
    return test::world_of(builder)->need.overlaps;
  };
  EXPECT_FALSE(needs({2.01, 0, 0}, false));
  EXPECT_TRUE(needs({2, 0, 0}, false));    // they touch
  EXPECT_TRUE(needs({1, 0, 0}, false));    // they intersect
  EXPECT_TRUE(needs({2.01, 0, 0}, true));  // they are in the medium of the camera
}

// Mirrored bodies
MeshShape cube_file(SceneBuilder& builder, bool normals) {
  std::string text;
  for (const char* v : {"-1 -1 -1", "1 -1 -1", "1 1 -1", "-1 1 -1", "-1 -1 1", "1 -1 1", "1 1 1", "-1 1 1"})
    text += std::string("v ") + v + "\n" + (normals ? std::string("vn ") + v + "\n" : "");
  for (const auto& f : std::vector<std::array<int, 4>>{
           {1, 4, 3, 2}, {5, 6, 7, 8}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 4, 8, 7}, {4, 1, 5, 8}}) {
    text += "f";
    for (const int i : f)
      text += " " + std::to_string(i) + (normals ? "//" + std::to_string(i) : std::string());
    text += "\n";
  }
  MeshShape mesh;
  mesh.file = builder.asset("cube.obj", text);
  mesh.face_normals = !normals;
  return mesh;
}

TEST(MirroredBodies, KeepTheirMediumInside) {
  for (const int kind : {0, 1, 2, 3})
    for (const bool mirrored : {false, true})
      for (const bool flipped : {false, true}) {
        SceneBuilder builder({1, 1});
        const MediumIndex fog = glowing(builder, 1);
        const ls::Geometry g = kind == 0   ? ls::Geometry{SphereShape{}}
                               : kind == 1 ? ls::Geometry{CubeShape{}}
                                           : ls::Geometry{cube_file(builder, kind == 3)};
        builder.container(g, test::scale(1, mirrored ? -1 : 1, 1), builder.null(), fog).flip_normals =
            flipped;
        look_along_x(builder, {-3, .1, .2});
        // A body with flip_normals that is not mirrored has its medium outside: the ray enters it behind the
        // body, without end.
        const double through = kind == 0 ? 2 * std::sqrt(1 - .05) : 2;
        const double light = seen(builder);
        if (flipped && !mirrored)
          EXPECT_FALSE(std::abs(light - through) < .1) << kind;
        else
          EXPECT_NEAR(light, through, 1e-3) << kind << ' ' << mirrored << ' ' << flipped;
      }
}

TEST(MirroredBodies, KeepTheirMediumInsideAsInstances) {
  SceneBuilder builder({1, 1});
  const MediumIndex fog = glowing(builder, 1);
  const auto group = SceneBuilder::push<GroupTag>(builder.scene.groups, ShapeGroup{});
  builder.container(SphereShape{}, {}, builder.null(), fog).group = group;
  builder.scene.instances.push_back({group, translate({0, 0, 0}) * test::scale(1, -1, 1)});
  builder.scene.instances.push_back({group, translate({4, 0, 0}) * test::scale(-2, -1, -1)});
  look_along_x(builder, {-3, 0, 0});
  EXPECT_NEAR(seen(builder), 2 + 4, 1e-3);
}

}  // namespace
}  // namespace ls::render

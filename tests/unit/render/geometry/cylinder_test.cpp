// Cylinders: intersections with rays, the data of hits, and their light.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/chi_square.h"
#include "tests/unit/render/hits.h"
#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;
constexpr double kEndless = std::numeric_limits<double>::infinity();

Cylinder tube(double radius, double length, const V3d& p0 = V3d(0)) {
  Cylinder c;
  c.p0 = p0;
  c.u = {1, 0, 0};
  c.v = {0, 1, 0};
  c.axis = {0, 0, 1};
  c.radius = radius;
  c.length = length;
  return c;
}

TEST(CylinderIntersection, IsExactForDistantThinAndGrazingRays) {
  EXPECT_NEAR(intersect(tube(1, 2), {-1e6, 0, 1}, {1, 0, 0}, 0, kEndless), 1e6 - 1, 1e-9);
  EXPECT_NEAR(intersect(tube(1e-6, 2), {-1, 0, 1}, {1, 0, 0}, 0, kEndless), 1 - 1e-6, 1e-15);
  // At a distance of 1 - 1e-12 from the axis half the chord is sqrt(2e-12).
  EXPECT_NEAR(intersect(tube(1, 2), {-5, 1 - 1e-12, 1}, {1, 0, 0}, 0, kEndless), 5 - std::sqrt(2e-12), 1e-9);
  EXPECT_EQ(intersect(tube(1, 2), {-5, 1 + 1e-12, 1}, {1, 0, 0}, 0, kEndless), kEndless);
  EXPECT_EQ(intersect(tube(1, 2), {5, 0, 1}, {1, 0, 0}, 0, kEndless), kEndless) << "behind";
  EXPECT_EQ(intersect(tube(1, 2), {-5, 0, 1}, {1, 0, 0}, 0, 4), kEndless) << "beyond t_max";
}

TEST(CylinderIntersection, SeesTheFarWallThroughTheOpenEnd) {
  const Cylinder c = tube(1, 2);
  // The ray falls at 45 degrees, passes above the near wall and meets the far wall at z = 1.
  EXPECT_NEAR(intersect(c, {-2, 0, 4}, {1, 0, -1}, 0, kEndless), 3, 1e-12);
  EXPECT_EQ(intersect(c, {-2, 0, 6}, {1, 0, -1}, 0, kEndless), kEndless) << "over both";
  EXPECT_EQ(intersect(c, {0, 0, -1}, {0, 0, 1}, 0, kEndless), kEndless) << "along the axis";
  EXPECT_NEAR(intersect(c, {0, 0, 1}, {0, 2, 0}, 0, kEndless), .5, 1e-15) << "from inside";
}

// Values of Mitsuba 3.9.1 (scalar_rgb, ray_intersect): shading normal, uv, direction of dp/du.
struct Seen {
  CylinderShape shape;
  Transform to_world;
  V3d from, to;
  V3 normal;
  V2 uv;
  V3 along_u;
};
CylinderShape between(const Vec3& p0, const Vec3& p1, double radius) { return {p0, p1, radius}; }
const Seen kSeen[] = {
    {{}, {}, {5, .6, .5}, {0, 0, .5}, {.992877f, .119145f, 0}, {.0190077f, .5f}, {-.119145f, .992877f, 0}},
    {{},
     {},
     {.1, .2, .3},
     {5, 1, .4},
     {.941373f, .337367f, 0},
     {.0547681f, .317171f},
     {-.337367f, .941373f, 0}},
    {between({1, 2, 3}, {2, 4, 4}, .5),
     {},
     {9, 1, 7},
     {1.5, 3, 3.5},
     {.789613f, -.540262f, .29091f},
     {.874589f, .572728f},
     {.458088f, .203595f, -.865277f}},
    {between({1, 2, -3}, {2, 4, -7}, .5),
     {},
     {9, 1, 7},
     {1.5, 3, -5},
     {.917339f, .21344f, .336055f},
     {.952881f, .398957f},
     {.332972f, -.874052f, -.353783f}},
    {{},
     test::scale(-1, 1, 1),
     {5, .6, .5},
     {0, 0, .5},
     {.992877f, .119145f, 0},
     {.480992f, .5f},
     {.119145f, -.992877f, 0}},
    {{},
     test::scale(1, 1, 5),
     {5, .6, 2.5},
     {0, 0, 2.5},
     {.992877f, .119145f, 0},
     {.0190077f, .5f},
     {-.119145f, .992877f, 0}},
};

TEST(Cylinders, NormalsUvAndTangentsAreMitsubas) {
  for (const Seen& s : kSeen) {
    SceneBuilder builder;
    builder.shape(s.shape, s.to_world, brushed(builder));
    const auto world = test::world_of(builder);
    const SurfaceHit h = hit_towards(*world, s.from, s.to);
    // Mitsuba's values are printed with 6 digits.
    EXPECT_LT((h.shading.n - s.normal).length(), 2e-5f) << h.shading.n << s.normal;
    EXPECT_LT((h.uv - s.uv).length(), 2e-5f) << h.uv << s.uv;
    EXPECT_LT((h.shading.s - s.along_u).length(), 2e-5f) << h.shading.s << s.along_u;
    // The point is on the surface: its distance from the axis is the radius.
    const Cylinder& c = world->geometry.cylinders.at(0);
    const V3d q = V3d(h.p) - c.p0;
    EXPECT_NEAR((q - c.axis * q.dot(c.axis)).length(), c.radius, 2e-7);
  }
}

TEST(Cylinders, FlippedNormalsPointInwards) {
  for (const bool mirrored : {false, true}) {
    SceneBuilder builder;
    builder.shape(CylinderShape{}, test::scale(1, mirrored ? -1 : 1, 1), builder.diffuse(.5)).flip_normals =
        true;
    EXPECT_LT(hit_towards(*test::world_of(builder), {5, .1, .5}, {0, 0, .5}).ng.x, -.9f);
  }
}

// A path that bounces inside a cylinder closed by two disks must never get out.
TEST(Cylinders, ClosedByDisksLoseNoRay) {
  for (const double s : {1e-4, 1., 12345.6}) {
    const Transform t = test::rotate_x(33) * test::rotate_y(21) * test::scale(s);
    SceneBuilder builder;
    const BsdfIndex grey = builder.diffuse(.5);
    // The disks are wider than the cylinder by a thousandth, so there is no gap at the edge.
    builder.shape(between({0, 0, -1}, {0, 0, 1}, 1), t, grey);
    for (const double z : {-.999, .999})
      builder.shape(DiskShape{}, t * translate({0, 0, z}) * test::scale(1.001), grey);
    const auto w = test::world_of(builder);
    std::mt19937 rng(3);
    std::normal_distribution<double> normal;
    std::uint64_t lost = 0;
    V3 o(0), ng(0);
    float reach = 0;
    for (int i = 0; i < 50000; ++i) {
      const double x = normal(rng), y = normal(rng), z = normal(rng);
      V3 d(V3d(x, y, z).normalized());
      if (dot(d, ng) * dot(ng, o) > 0) d = -d;
      const V3 from = ng == V3(0) ? o : offset_point(o, ng, reach, d);
      const auto primitive = w->accel.nearest(from, d, kInfinity);
      SurfaceHit hit;
      if (!primitive || !w->geometry.complete(*primitive, from, d, hit)) {
        ++lost;
        o = ng = V3(0);
        continue;
      }
      o = hit.p;
      ng = hit.ng;
      reach = hit.reach;
    }
    EXPECT_EQ(lost, 0u) << s;
  }
}

// The configuration factor from a plane element to a cylinder of length L at the distance H, both in radii.
// The cylinder is parallel to the element, whose normal passes through one end of it (Leuenberger and Person
// 1956; Howell's catalogue B-31).
double configuration_factor(double length, double distance) {
  const double l = length, h = distance, x = (1 + h) * (1 + h) + l * l, y = (1 - h) * (1 - h) + l * l;
  return std::atan(l / std::sqrt(h * h - 1)) / (M_PI * h) +
         l / M_PI *
             ((x - 2 * h) / (h * std::sqrt(x * y)) * std::atan(std::sqrt(x * (h - 1) / (y * (h + 1)))) -
              std::atan(std::sqrt((h - 1) / (h + 1))) / h);
}

TEST(CylinderLights, GiveTheIrradianceOfTheirConfigurationFactor) {
  for (const double h : {1.5, 3., 40.}) {
    for (const double length : {.5, 4.}) {
      const LightBench bench(area(between({0, 0, 0}, {0, 0, length}, 1), {}));
      expect_close(bench.irradiance({h, 0, 0}, {-1, 0, 0}, 512), M_PI * configuration_factor(length, h));
    }
  }
}

TEST(CylinderLights, EmitInwardsIfFlipped) {
  // From the middle of the axis, a tube of half length L covers the polar angles theta from `edge` to pi -
  // edge. The irradiance of a plane that contains the axis is the integral of sin^2 theta over these angles,
  // times the integral of the cosine of the azimuth over half a turn, which is 2.
  const double half = 2, edge = std::atan(1 / half);
  const double expected = (M_PI - 2 * edge) / 2 + std::sin(2 * edge) / 2;
  const LightBench bench(area(between({0, 0, -half}, {0, 0, half}, 1), {}, true));
  expect_close(bench.irradiance({0, 0, 0}, {1, 0, 0}, 512), 2 * expected);
  const LightBench outwards(area(between({0, 0, -half}, {0, 0, half}, 1), {}));
  EXPECT_EQ(outwards.irradiance({0, 0, 0}, {1, 0, 0}).mean, 0);
}

TEST(CylinderLights, AreSampledUniformlyByArea) {
  // Sampled points are counted in 16 x 16 cells of uv.
  const LightBench b(area(between({0, 0, 0}, {0, 0, 2}, .7), {}));
  RandomStream r(17);
  constexpr int kSamples = 1 << 18;
  std::vector<double> counts(256, 0), expected(256, kSamples / 256.);
  for (int i = 0; i < kSamples; ++i) {
    const float u = r.uniform(), v = r.uniform();
    const auto p = b.world->lights.pivot(b.world->lights.choose(numbers(0, u, v))).p;
    const Cylinder& c = b.world->geometry.cylinders[0];
    const V3d q = V3d(p) - c.p0;
    double angle = std::atan2(q.dot(c.v), q.dot(c.u)) / (2 * M_PI);
    if (angle < 0) angle += 1;
    const int x = std::clamp(static_cast<int>(angle * 16), 0, 15),
              z = std::clamp(static_cast<int>(q.dot(c.axis) / c.length * 16), 0, 15);
    ++counts[static_cast<std::size_t>(16 * z + x)];
  }
  test::ChiSquareTally tally("render/cylinder");
  tally.expect("area", expected, counts);
  tally.close();
}

// Null walls around an absorbing medium: the transmittance follows Beer's law.
TEST(Cylinders, HoldMedia) {
  SceneBuilder builder;
  const MediumIndex fog = builder.homogeneous({.5, 1, 2}, {0, 0, 0});
  const BsdfIndex null = builder.null();
  builder.container(between({0, 0, -1}, {0, 0, 1}, .75), {}, null, fog);
  builder.environment();
  builder.look({0, -5, 0}, {0, 0, 0});
  const auto e = test::estimate(builder, 64);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(e.mean[c], std::exp(-1.5 * std::get<HomogeneousMedium>(builder.scene.media[0]).sigma_t[c]),
                5 * e.standard_error[c] + 1e-5);
}

}  // namespace
}  // namespace ls::render

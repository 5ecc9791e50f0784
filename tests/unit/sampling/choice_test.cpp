// Discrete choices: which light, by table and by tree, and which part of a mesh.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/chi_square.h"
#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

constexpr int kSamples = 100000;

// `lights` small disks in a hall, each with a face to the middle, of strengths from 1 to 100, and some lights
// without a place.
SceneBuilder hall(int lights) {
  SceneBuilder builder;
  const BsdfIndex black = builder.diffuse(0);
  RandomStream r(17);
  for (int i = 0; i < lights; ++i) {
    const double phi = 2 * M_PI * r.uniform(), height = 2. * r.uniform() - 1,
                 power = std::pow(10, 2. * r.uniform());
    const Vec3 at{3 * std::cos(phi), 3 * std::sin(phi), height};
    builder.shape(DiskShape{}, test::look_at(at, {0, 0, 0}, {0, 0, 1}) * test::scale(.02), black).emitter =
        AreaEmitter{builder.texture({power, power, power})};
  }
  builder.scene.emitters.push_back(PointEmitter{{0, 0, 2}, {.01, .01, .01}});
  builder.scene.emitters.push_back(DirectionalEmitter{{0, .2, -1}, {.01, .01, .01}});
  return builder;
}

// The probability that a hit on each light claims: its density by area, divided by the point's own.
std::vector<double> claimed(const LightBench& b, const V3& x, const V3& n) {
  const Geometry& g = b.world->geometry;
  std::vector<double> p(b.world->lights.count(), 0);
  for (std::size_t i = 0; i < g.disks.size(); ++i) {
    const Disk& d = g.disks[i];
    const V3 way = normalize(V3(d.center) - x);
    SurfaceHit hit;
    EXPECT_TRUE(g.complete({PrimitiveId::Kind::disk, static_cast<std::uint32_t>(i)}, x, way, hit));
    const double area = M_PI * d.u.cross(d.v).length(), cosine = std::abs(dot(hit.ng, way));
    p[g.surfaces[d.surface].light] =
        b.world->lights.pdf(hit, x, way, {x, n}) * area * cosine / dot(hit.p - x, hit.p - x);
  }
  return p;
}

TEST(LightChoice, ProbabilityMatchesThatOfAHit) {
  test::ChiSquareTally tally("sampling/choice");
  for (const int lights : {5, 300}) {
    const LightBench b(hall(lights));
    EXPECT_EQ(b.world->lights.has_tree(), lights == 300);
    for (const V3d& place : {V3d(0, 0, 0), V3d(2.5, .3, -.5)})
      for (const V3& n : {V3(0), V3(0, 0, 1), normalize(V3(1, -.5f, .2f))}) {
        const V3 x = b.at(place);
        std::vector<double> p = claimed(b, x, n), got(p.size() + 1, 0);
        double sum = 0;
        for (const double q : p) sum += q;
        ASSERT_LT(sum, 1);
        p.push_back(1 - sum);  // the two that have no surface
        RandomStream r(3);
        for (int i = 0; i < kSamples; ++i) {
          const std::uint32_t word = r.bits(), u = r.bits(), v = r.bits();
          const LightChoice c = b.world->lights.choose({word, u, v}, {x, n});
          // Lights without a surface are all but the disks.
          ++got[p[c.light] > 0 ? c.light : p.size() - 1];
        }
        for (double& q : p) q *= kSamples;
        tally.expect(fmt::format("{} lights at {} {} {}, normal {} {} {}", lights, place.x, place.y, place.z,
                                 n.x, n.y, n.z),
                     p, got);
      }
  }
  // Triangles of a mesh by area: a cube squeezed flat, six faces of two triangles.
  const LightBench b(area(CubeShape{}, test::scale(1, 2, .3)));
  const Geometry& g = b.world->geometry;
  std::vector<double> p, got(g.triangle_count(), 0);
  double total = 0;
  for (std::uint32_t i = 0; i < g.triangle_count(); ++i) {
    const V3d e1 = V3d(g.vertex(i, 1)) - V3d(g.vertex(i, 0)), e2 = V3d(g.vertex(i, 2)) - V3d(g.vertex(i, 0));
    p.push_back(e1.cross(e2).length());
    total += p.back();
  }
  for (double& q : p) q *= kSamples / total;
  RandomStream r(5);
  for (int i = 0; i < kSamples; ++i) {
    const std::uint32_t u = r.bits(), v = r.bits();
    const LightChoice c = b.world->lights.choose({0, u, v});
    std::uint32_t best = 0;
    double nearest = 1e30;
    for (std::uint32_t k = 0; k < g.triangle_count(); ++k) {
      const V3d a(g.vertex(k, 0)), e1 = V3d(g.vertex(k, 1)) - a, e2 = V3d(g.vertex(k, 2)) - a,
                                   n = e1.cross(e2);
      const V3d q = V3d(b.world->lights.pivot(c).p) - a;
      const double n2 = n.dot(n), s = q.cross(e2).dot(n) / n2, t = e1.cross(q).dot(n) / n2;
      const double outside = std::max({0., -s, -t, s + t - 1}),
                   off = std::abs(q.dot(n)) / std::sqrt(n2) + outside;
      if (off < nearest) nearest = off, best = k;
    }
    ++got[best];
  }
  tally.expect("triangles of a mesh", p, got);
  tally.close();
}

}  // namespace
}  // namespace ls::render

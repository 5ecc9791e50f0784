// Lights: the directions that they are sampled in against the density that a ray claims which finds them.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/chi_square.h"
#include "tests/support/jacobian.h"
#include "tests/support/sphere_cells.h"
#include "tests/unit/render/light_bench.h"
#include "worker/render/math/transform.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

constexpr int kLightSamples = 100000;

struct Case {
  std::string name;
  SceneBuilder builder;
  V3d from;      // in the scene
  V3d towards;   // the cells' axis
  double reach;  // of the cells: 1 - cos
  // Points of the light, in the scene, spread evenly over its area for (u, v) in the unit square: of lights
  // whose density has no bound, seen from there (it grows as 1 / cos towards a rim), or changes fast.
  std::function<V3d(double, double)> surface = {};
  double area = 0;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  const auto add = [&](std::string name, SceneBuilder builder, V3d from, V3d to, double reach) {
    all.push_back({std::move(name), std::move(builder), from, to - from, reach, {}, 0});
  };
  add("rectangle", area(RectangleShape{}, translate({0, 0, 2}) * test::rotate_x(160)), {.3, .2, -1},
      {0, 0, 2}, .2);
  add("near rectangle", area(RectangleShape{}, test::rotate_x(180)), {.9, .2, -.1}, {.9, .2, 0}, 1);
  add("slanted parallelogram", area(RectangleShape{}, {{1, .7, 0, 0, 0, 1, 0, .3, 0, 0, -1, 2, 0, 0, 0, 1}}),
      {0, 0, 0}, {0, .3, 2}, .3);
  add("disk", area(DiskShape{}, translate({0, 0, 2}) * test::rotate_x(160)), {.3, .2, -1}, {0, 0, 2}, .1);
  add("ellipse", area(DiskShape{}, translate({0, 0, 1}) * test::rotate_x(180) * test::scale(1, .3, 1)),
      {0, 0, 0}, {0, 0, 1}, .4);
  add("sphere", area(SphereShape{}, translate({0, 0, 3})), {.3, .2, -1}, {0, 0, 3}, .05);
  add("sphere at hand", area(SphereShape{}, {}), {0, 0, -1.001}, {0, 0, 0}, 1);
  add("distant sphere", area(SphereShape{}, translate({0, 0, 500})), {.3, .2, -1}, {0, 0, 500}, 3e-6);
  add("inside of a sphere", area(SphereShape{}, {}, true), {.3, .2, -.4}, {0, 0, 0}, 2);
  add("inside of a sphere, at its wall", area(SphereShape{}, {}, true), {0, 0, -.9999}, {0, 0, 0}, 2);
  add("cylinder", area(CylinderShape{}, translate({0, 0, 3}) * test::rotate_x(70)), {.3, .2, -1},
      {0, -.5, 3.2}, .15);
  add("inside of a cylinder", area(CylinderShape{}, {}, true), {.3, .2, .4}, {.3, .2, 1}, 2);
  add("cube", area(CubeShape{}, translate({0, 0, 3}) * test::rotate_x(30)), {.3, .2, -1}, {0, 0, 3}, .2);
  add("inside of a cube", area(CubeShape{}, {}, true), {.3, .2, -.4}, {0, 0, 0}, 2);
  const auto by_surface = [&](std::string_view name, double light_area,
                              std::function<V3d(double, double)> f) {
    for (Case& c : all)
      if (c.name == name) c.surface = std::move(f), c.area = light_area;
  };
  const auto place = [](const Transform& t) { return Affine(t); };
  const Affine tilted = place(translate({0, 0, 2}) * test::rotate_x(160)), flat = place(test::rotate_x(180)),
               tube = place(translate({0, 0, 3}) * test::rotate_x(70));
  by_surface("rectangle", 4, [=](double u, double v) { return tilted.point({2 * u - 1, 2 * v - 1, 0}); });
  by_surface("near rectangle", 4, [=](double u, double v) { return flat.point({2 * u - 1, 2 * v - 1, 0}); });
  by_surface("cylinder", 2 * M_PI, [=](double u, double v) {
    return tube.point({std::cos(2 * M_PI * u), std::sin(2 * M_PI * u), v});
  });
  for (const double angle : {.3, 5., 60., 89.}) {
    SceneBuilder builder;
    builder.shape(RectangleShape{}, translate({0, 0, -5}), builder.diffuse(.5));
    DirectionalEmitter sun{{.3, .2, -1}, {1, 1, 1}};
    sun.angular_radius = angle;
    builder.scene.emitters.push_back(sun);
    add(fmt::format("sun of {} degrees", angle), builder, {0, 0, 0}, {-.3, -.2, 1},
        1.2 * (1 - std::cos(angle * M_PI / 180)));
  }
  return all;
}

// Per steradian, of the scene's one light in this direction; by a ray that finds it.
double density(const LightBench& b, const V3& x, const V3& d) {
  const World& w = *b.world;
  SurfaceHit hit;
  const auto id = w.accel.nearest(x, d, kInfinity);
  if (id && w.geometry.complete(*id, x, d, hit) && w.geometry.surfaces[hit.surface].light != kNone)
    return is_black(w.lights.emitted(hit, -d)) ? 0 : double{w.lights.pdf(hit, x, d)};
  // With a density of 1 of its own a ray that leaves is weighted by 1 / (1 + p), which tells p.
  const C3 alone = w.lights.environment(x, d, kInfinity, {}), shared = w.lights.environment(x, d, 1, {});
  return alone.x > 0 ? double{alone.x} / double{shared.x} - 1 : 0;
}

// The same masses as SphereCells::masses(), by an even grid of points of the light.
std::vector<double> masses_by_surface(const LightBench& b, const Case& c, const test::SphereCells& cells) {
  constexpr int kGrid = 700;
  const V3 x = b.at(c.from);
  std::vector<double> p(cells.size(), 0);
  double all = 0;
  const double scale = b.world->geometry.scale, piece = c.area * scale * scale / kGrid / kGrid;
  for (int i = 0; i < kGrid; ++i)
    for (int j = 0; j < kGrid; ++j) {
      const double golden = .6180339887498949 * (j + .5);
      const V3 y = b.at(c.surface((i + golden - std::floor(golden)) / kGrid, (j + .5) / kGrid)), f = y - x;
      const V3 d = normalize(f);
      SurfaceHit hit;
      const auto id = b.world->accel.nearest(x, d, kInfinity);
      if (!id || !b.world->geometry.complete(*id, x, d, hit) || (hit.p - y).length() > 1e-3f * f.length())
        continue;
      const double mass = density(b, x, d) * std::abs(dot(hit.ng, d)) / dot(f, f) * piece;
      p[cells.of(d)] += mass;
      all += mass;
    }
  EXPECT_LE(all, 1 + 3e-3) << c.name;
  p.back() += std::max(0., 1 - all);
  return p;
}

TEST(LightSampling, FollowsTheDensityOfWhatRaysFind) {
  test::ChiSquareTally tally("sampling/lights");
  for (const Case& c : cases()) {
    const LightBench b(c.builder);
    const V3 x = b.at(c.from);
    const test::SphereCells cells(V3(c.towards), c.reach, 12, 24);
    const auto p = c.surface ? masses_by_surface(b, c, cells)
                             : cells.masses([&](const V3& d) { return density(b, x, d); }, 16);
    // Of the cells' points about 3 per mille lie in cells that an edge of the light cuts.
    EXPECT_LE(cells.total(), 1 + 3e-3) << c.name;
    std::vector<double> got(cells.size(), 0);
    RandomStream r(31);
    for (int i = 0; i < kLightSamples; ++i) {
      const float l = r.uniform(), u = r.uniform(), v = r.uniform();
      const auto s = b.world->lights.sample(b.world->lights.choose(numbers(l, u, v)), x);
      ++got[s ? cells.of(s->direction) : cells.size() - 1];
    }
    tally.expect(c.name, test::counts(p, kLightSamples), got);
  }
  tally.close();
}

TEST(LightSampling, SamplingJacobianIsOneOverTheDensity) {
  for (const Case& c : cases()) {
    const LightBench b(c.builder);
    const V3 x = b.at(c.from);
    if (c.name == "distant sphere" || c.name.starts_with("sun of 0.3"))
      continue;  // smaller than float32's steps
    // Meshes choose a face by the first number: a kink at each of their ends.
    if (c.name.find("cube") != c.name.npos) continue;
    test::expect_jacobian(c.name, [&](const V2& u) -> std::optional<test::Mapped> {
      const auto s = b.world->lights.sample(b.world->lights.choose(numbers(.5f, u.x, u.y)), x);
      if (!s) return std::nullopt;
      return test::Mapped{V3d(s->direction), double{s->pdf}};
    });
  }
}

}  // namespace
}  // namespace ls::render

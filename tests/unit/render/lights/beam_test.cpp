// Area lights whose radiance depends on the angle to their normal.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::operator*;
using test::translate;

struct Beam {
  double cutoff, beam, falloff;
};
constexpr Beam kBeams[] = {{90, 90, 1}, {90, 67.5, 1}, {60, 0, 2}, {40, 20, .5}, {30, 30, 1}, {5, 4, 8}};

SceneBuilder shining(const ls::Geometry& g, const Transform& t, const Beam& b) {
  SceneBuilder builder = area(g, t);
  AreaEmitter& e = *builder.scene.shapes[0].emitter;
  e.cutoff_angle = b.cutoff;
  e.beam_width = b.beam;
  e.falloff = b.falloff;
  return builder;
}
double cosine(double degrees) { return std::cos(degrees * M_PI / 180); }
// The share of the full radiance that leaves at this angle, by the formula of the documentation.
double share(const Beam& b, double degrees) {
  if (degrees <= b.beam) return 1;
  if (degrees >= b.cutoff) return 0;
  return std::pow((cosine(degrees) - cosine(b.cutoff)) / (cosine(b.beam) - cosine(b.cutoff)), b.falloff);
}
// The flux per unit radiance and area, 2 pi times the integral of share cos sin over the angle, in closed
// form.
double flux(const Beam& b) {
  const double cc = b.cutoff < 90 ? cosine(b.cutoff) : 0, cb = b.beam < 90 ? cosine(b.beam) : 0, w = cb - cc;
  return 2 * M_PI * ((1 - cb * cb) / 2 + w * (cc / (b.falloff + 1) + w / (b.falloff + 2)));
}

// Far away from the light, on a ray at the angle a, the irradiance is L A cos a share(a) / d^2.
TEST(AreaBeam, HasItsRadianceAtEveryAngle) {
  for (const Beam& beam : kBeams) {
    const LightBench b(shining(RectangleShape{}, test::scale(.5), beam));
    for (const double degrees : {0., 3., 4.5, 10., 19., 25., 29., 35., 50., 59., 61., 75., 89.}) {
      const double a = degrees * M_PI / 180, d = 1000;
      const V3 towards(std::sin(a), 0, std::cos(a));
      const auto e = b.irradiance(V3d(towards) * d, -towards, 32);
      // From that distance the light is 1 / 1000 rad wide. Over this width the share changes by at most
      // falloff / transition of itself (the narrowest transition is .01 rad), evenly on both sides.
      const double expected = cosine(degrees) * share(beam, degrees) / (d * d);
      EXPECT_NEAR(e.mean, expected, 5 * e.se + 1e-3 * std::pow(d, -2)) << beam.cutoff << " at " << degrees;
    }
  }
}

// The flux through a sphere around the light is compared with the closed form of the integral over angles.
TEST(AreaBeam, SendsTheFluxOfTheClosedForm) {
  for (const Beam& beam : kBeams) {
    const LightBench b(shining(RectangleShape{}, test::scale(.5), beam));
    constexpr int kSteps = 400;
    const double d = 1000, step = beam.cutoff * M_PI / 180 / kSteps;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double a = (i + .5) * step;
      const V3 towards(std::sin(a), 0, std::cos(a));
      sum += b.irradiance(V3d(towards) * d, -towards, 4).mean * d * d * 2 * M_PI * std::sin(a) * step;
    }
    // The error of the midpoint rule is quadratic in the step of 1/400. From there the light is 1/1000 rad
    // wide, which blurs the edge of the narrowest beam (of .09 rad) evenly over 1 % of its angle.
    EXPECT_NEAR(sum, flux(beam), 5e-3 * flux(beam)) << beam.cutoff;
  }
}

TEST(AreaBeam, HitHasTheRadianceAndDensityOfItsSample) {
  const Transform up = translate({0, 0, 3}) * test::rotate_x(170);
  const ls::Geometry kinds[] = {RectangleShape{}, DiskShape{}, CubeShape{}, SphereShape{}};
  for (const ls::Geometry& g : kinds)
    for (const Beam& beam : {kBeams[1], kBeams[3], kBeams[4]}) {
      const LightBench b(shining(g, up, beam));
      const V3 x = b.at({.3, .2, -1});
      const int hits =
          for_hits_of_samples(b, x, 4000, [&](const LightSample& s, const SurfaceHit& hit, float cosine) {
            // Cosines are accurate to 2^-20 of the world's size over a length of 1/100 of it, relative to the
            // width of the transition.
            ASSERT_NEAR(b.world->lights.emitted(hit, -s.direction).x, s.radiance.x, 2e-3) << g.index();
            ASSERT_NEAR(b.world->lights.pdf(hit, x, s.direction) / s.pdf, 1, 1e-4 / cosine) << g.index();
          });
      EXPECT_GT(hits, 100) << g.index() << " " << beam.cutoff;
    }
}

// The estimate combines light samples, by MIS, with directions that the floor samples and that hit the light.
TEST(AreaBeam, HitsAndSamplesGiveTheSameIrradiance) {
  for (const Beam& beam : {kBeams[1], kBeams[3]}) {
    SceneBuilder builder = shining(RectangleShape{}, translate({0, 0, 1}) * test::rotate_x(180), beam);
    const BsdfIndex floor = builder.diffuse(.5);
    builder.shape(RectangleShape{}, test::scale(3), floor);
    builder.look({1.8, 0, .9}, {.9, 0, 0});
    const auto direct = LightBench(builder).irradiance({.9, 0, 0}, {0, 0, 1}, 512);
    const auto e = test::estimate(builder, 512);
    EXPECT_NEAR(e.mean[0], direct.mean * .5 / M_PI, 5 * (e.standard_error[0] + direct.se * .5 / M_PI) + 1e-5);
    EXPECT_LT(e.standard_error[0], .01 * e.mean[0]);
  }
}

TEST(AreaBeam, WithoutAnglesHasTheSameBitsAsAnAreaLight) {
  const LightBench plain(area(RectangleShape{}, {})), wide(shining(RectangleShape{}, {}, {90, 90, 7}));
  RandomStream r(2);
  for (int i = 0; i < 100; ++i) {
    const LightNumbers n = numbers(0, r.uniform(), r.uniform());
    const V3 x(r.uniform(), r.uniform(), 2 * r.uniform());
    const auto a = plain.world->lights.sample(plain.world->lights.choose(n), x),
               b = wide.world->lights.sample(wide.world->lights.choose(n), x);
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) continue;
    EXPECT_EQ(a->radiance, b->radiance);
    EXPECT_EQ(a->pdf, b->pdf);
  }
}

}  // namespace
}  // namespace ls::render

// Tests equi-angular sampling on segments on which the textbook difference of arctangents cancels.
#include "worker/render/integrator/equiangular.h"

#include <gtest/gtest.h>

#include <cmath>

#include "worker/render/math/random.h"

namespace ls::render {
namespace {

// A segment whose ends have the offsets a and b from the foot of the perpendicular from a pivot at distance
// D. The foot is at the origin, so that a, b and D are exact in float32.
struct TestSegment {
  float a, b, distance;
  EquiAngular make() const { return {V3(a, 0, 0), V3(1, 0, 0), b - a, V3(0, distance, 0)}; }
  double length() const { return double{b - a}; }
  double angle() const {  // in double, without a difference that cancels
    const double d = distance;
    return std::atan2(d * (double{b} - a), d * d + double{a} * b);
  }
};
const TestSegment kSegments[] = {{-3, 3, .5f},         {-3, 3, 1e-5f},  {100, 101, .01f},
                                 {1e6f, 1.0001e6f, 1}, {-1e6f, 1, .1f}, {-2, -1, .3f},
                                 {-101, -100, .01f},   {0, 1, 1},       {0, 4, 1e-3f},
                                 {-.5f, .25f, 1e4f},   {-1, 1, 1e7f},   {5, 5.0001f, 2}};

TEST(EquiAngular, DensityIsUniformInAngle) {
  for (const TestSegment& s : kSegments) {
    const EquiAngular e = s.make();
    for (int i = 0; i <= 16; ++i) {
      const float t = (s.b - s.a) * static_cast<float>(i) / 16;
      const double x = double{s.a} + t;
      // The foot is computed from a point at distance |a|, so its position has an error of 2^-24 |a|. Pivots
      // closer to the segment than 1e-7 of its ends are treated as if they were at that distance.
      const double d = std::max<double>(s.distance, 1e-7 * std::max(std::abs(s.a), std::abs(s.b)));
      const double angle = std::atan2(d * (double{s.b} - s.a), d * d + double{s.a} * s.b);
      const double near = std::sqrt(d * d + x * x), place = 0x1p-23 * (std::abs(s.a) + t);
      EXPECT_NEAR(e.pdf(t) / (d / angle / (near * near)), 1, 2e-6 + 4 * place / near)
          << s.a << " " << s.b << " " << s.distance << " t " << t;
    }
  }
}

TEST(EquiAngular, EstimatesTheInverseSquareIntegralWithoutVariance) {
  for (const TestSegment& s : kSegments) {
    const double d = std::max<double>(s.distance, 1e-7 * std::max(std::abs(s.a), std::abs(s.b)));
    const double integral = std::atan2(d * (double{s.b} - s.a), d * d + double{s.a} * s.b) / d;
    RandomStream r(3);
    for (int i = 0; i < 1000; ++i) {
      const auto sample = s.make().sample(r.uniform());
      const V3d p(sample.p);
      const double value = 1 / (d * d + p.x * p.x) / sample.pdf;
      // Errors are relative, since positions are measured from the foot at the origin. Up to (b - a) / D =
      // 1e-6 the sampling is uniform, as the density is flat there.
      ASSERT_NEAR(value / integral, 1, 4e-6) << s.a << " " << s.b << " " << s.distance << " at " << p.x;
    }
  }
}

TEST(EquiAngular, SamplesLieOnTheSegmentAndFollowTheAngle) {
  for (const TestSegment& s : kSegments) {
    const EquiAngular e = s.make();
    float last = -1;
    for (int i = 0; i < 1000; ++i) {
      const float xi = static_cast<float>(i) / 1000;
      const auto sample = e.sample(xi);
      ASSERT_GE(sample.t, 0.f);
      ASSERT_LE(sample.t, (s.b - s.a) * (1 + 0x1p-22f));
      ASSERT_GE(sample.t, last) << "order";
      last = sample.t;
      // The share of the angle up to the sample must be xi; it is computed in double.
      const double d = std::max<double>(s.distance, 1e-7 * std::max(std::abs(s.a), std::abs(s.b)));
      const double x = sample.p.x, below = std::atan2(d * (x - s.a), d * d + x * s.a);
      const double all = std::atan2(d * (double{s.b} - s.a), d * d + double{s.a} * s.b);
      // Rounding x once, by 2^-24 |x|, changes the angle by this times d / (d^2 + x^2).
      const double turn = 0x1p-22 * std::abs(x) * d / (d * d + x * x) / all;
      ASSERT_NEAR(below / all, xi, 4e-6 + turn) << s.a << " " << s.b << " " << s.distance;
    }
  }
}

TEST(EquiAngular, SampleAndDensityFunctionAgree) {
  RandomStream r(9);
  for (const TestSegment& s : kSegments) {
    for (int i = 0; i < 200; ++i) {
      const auto sample = s.make().sample(r.uniform());
      const double x = sample.p.x, near = std::hypot(x, double{s.distance}) + 1e-7 * std::abs(s.a);
      const double place = 0x1p-23 * (std::abs(s.a) + std::abs(s.b));  // t is rounded coarsely
      ASSERT_NEAR(s.make().pdf(sample.t) / sample.pdf, 1,
                  2e-6 + 4 * place / near + 4 * place * place / near / near);
    }
  }
}

// A light at distance D from the segment shines into a cone. The sampled part must be the part of the segment
// inside the cone, by angle. At the edge of the cone the two may differ by the rounding error that keep_lit()
// allows for.
TEST(EquiAngular, SamplesTheLitPartOfTheSegment) {
  RandomStream r(11);
  int lit_segments = 0, dark_segments = 0;
  for (const TestSegment& s : kSegments) {
    const double size = std::max(std::abs(s.a), std::abs(s.b));
    if (s.distance < 2e-5 * size || s.distance > 1e3 * size) continue;  // not limited, or sampled uniformly
    const double edge = 4e-6 + 2e-6 * size / s.distance;
    for (int k = 0; k < 200; ++k) {
      const float z = 2 * r.uniform() - 1, w = std::sqrt(1 - z * z), turn = 6.2831853f * r.uniform();
      const V3 axis(w * std::cos(turn), w * std::sin(turn), z);
      const float reach = .05f + .94f * r.uniform();
      const EquiAngular e(V3(s.a, 0, 0), V3(1, 0, 0), s.b - s.a, Pivot(V3(0, s.distance, 0), axis, reach));
      const auto beyond = [&](double x) {  // > 0 for points x inside the cone
        return (axis.x * x - double{axis.y} * s.distance) / std::hypot(x, double{s.distance}) - reach;
      };
      // Steps of equal angle
      const double lo = std::atan2(double{s.a}, double{s.distance});
      const double hi = std::atan2(double{s.b}, double{s.distance});
      constexpr int kSteps = 2000;
      double integral = 0, lit = 0;
      for (int i = 0; i < kSteps; ++i) {
        const double angle = lo + (hi - lo) * (i + .5) / kSteps, x = s.distance * std::tan(angle);
        const double pdf = e.pdf(static_cast<float>(x - s.a)), cosine = std::cos(angle);
        integral += pdf * s.distance / (cosine * cosine) * (hi - lo) / kSteps;
        lit += beyond(x) > 0;
        if (beyond(x) > edge) ASSERT_GT(pdf, 0) << s.a << " " << s.b << " " << s.distance;
        if (beyond(x) < -edge) ASSERT_EQ(pdf, 0) << s.a << " " << s.b << " " << s.distance;
      }
      const auto sample = e.sample(r.uniform());
      if (lit == 0) {
        ++dark_segments;
        continue;
      }
      if (lit < 200) continue;
      ++lit_segments;
      // The integral has an error of one step at each end of the lit part, and one from rounding t if the
      // segment is far from the light
      EXPECT_NEAR(integral, 1, 3 / lit + 1e-6 * size / s.distance);
      ASSERT_GT(sample.pdf, 0);
      EXPECT_GT(beyond(double{sample.p.x}), -edge);
    }
  }
  EXPECT_GT(lit_segments, 100);
  EXPECT_GT(dark_segments, 100);
}

}  // namespace
}  // namespace ls::render

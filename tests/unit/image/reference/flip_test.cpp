#include "core/image/reference/flip.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace ls {
namespace {

struct Picture {
  FrameSize size{40, 24};
  std::vector<float> rgb = std::vector<float>(std::size_t{3} * 40 * 24);
  FlipImage view() const { return {size, rgb}; }
};

Picture flat(float r, float g, float b) {
  Picture p;
  for (std::size_t i = 0; i < p.rgb.size(); i += 3) p.rgb[i] = r, p.rgb[i + 1] = g, p.rgb[i + 2] = b;
  return p;
}

// Returns waves in all three channels, raised to `power` and scaled. If `other`, the image is also brightened
// by a pattern of 11 steps.
Picture waves(double power, double scale, bool other) {
  Picture p;
  for (int y = 0; y < p.size.height; ++y)
    for (int x = 0; x < p.size.width; ++x) {
      const double v[3] = {.5 + .4 * std::sin(x / 9.), .4 + .3 * std::cos(y / 7.),
                           .3 + .2 * std::sin((x + y) / 5.)};
      const double more = other ? 1 + .25 * ((x * 7 + y * 13) % 11 / 11.) : 1;
      for (int c = 0; c < 3; ++c)
        p.rgb[static_cast<std::size_t>(3 * (y * p.size.width + x) + c)] =
            static_cast<float>(std::pow(v[c] * more, power) * scale);
    }
  return p;
}

double ldr(const Picture& r, const Picture& t) { return mean_of(ldr_flip(r.view(), t.view())); }
double hdr(const Picture& r, const Picture& t) { return mean_of(hdr_flip(r.view(), t.view())); }

TEST(Flip, EqualImagesHaveZero) {
  EXPECT_EQ(ldr(waves(1, 1, false), waves(1, 1, false)), 0);
  EXPECT_EQ(hdr(waves(3, 20, false), waves(3, 20, false)), 0);
}

TEST(Flip, IsSymmetricAtAFixedExposure) {
  const Picture a = waves(1, 1, false), b = waves(1, 1, true);
  // The results differ only by rounding, since both images are below 1.
  EXPECT_NEAR(ldr(a, b), ldr(b, a), 1e-6);
}

// Flat images have no features, so the error is that of the colours alone. Black has L* = 0, white 100, and
// both have no hue, so HyAB = 100 and 100^.7 = 25.119. The largest difference is between Hunt-adjusted green
// (87.73, -75.61, 72.98) and blue (32.30, 25.58, -34.84): (55.43 + sqrt(101.19^2 + 107.82^2))^.7 = 41.28. The
// range above .4 of it, 16.51, is compressed to the width .05: .95 + (25.119 - 16.51) / (41.28 - 16.51) * .05
// = .96738.
TEST(Flip, BlackAndWhiteHaveTheHandComputedValue) {
  const auto error = ldr_flip(flat(0, 0, 0).view(), flat(1, 1, 1).view());
  // Computed by hand to five digits.
  for (const float e : error) EXPECT_NEAR(e, .96738, 2e-5);
}

// Greys of Y = .2 and .3 have L* = 116 cbrt(Y) - 16 = 51.837 and 61.654. The difference 9.817^.7 = 4.948 is
// below the bend at 16.51, so the error is .95 / 16.51 * 4.948 = .2847.
TEST(Flip, TwoGreysHaveTheHandComputedValue) {
  EXPECT_NEAR(ldr(flat(.2F, .2F, .2F), flat(.3F, .3F, .3F)), .2847, 1e-4);
}

// The expected values are those of flip-evaluator 1.7, the authors' own program, for the same float images.
// It also computes in single precision, but rounds differently, and its white point for HDR differs in the
// fifth digit.
TEST(Flip, MatchesTheAuthorsProgram) {
  Picture r = waves(1, 1, false), t = waves(1, 1, true);
  EXPECT_NEAR(ldr(r, t), .2094682, 1e-5);
  EXPECT_NEAR(hdr(r, t), .1187420, 2e-5);
  EXPECT_NEAR(hdr(waves(3, 20, false), waves(3, 20, true)), .2896204, 2e-5);
}

TEST(Flip, ExposuresDependOnlyOnTheReference) {
  const FlipExposures e = flip_exposures(waves(3, 20, false).rgb);
  EXPECT_NEAR(e.first, -1.93050, 2e-4);
  EXPECT_NEAR(e.last, -.47669, 2e-4);
  EXPECT_EQ(e.count, 2);
  EXPECT_EQ(e.at(0), e.first);
  EXPECT_FLOAT_EQ(e.at(e.count - 1), e.last);
}

// Fine noise is less visible from a distance.
TEST(Flip, FineNoiseCountsLessFromFarAway) {
  const Picture grey = flat(.4F, .4F, .4F);
  Picture noisy = grey;
  for (std::size_t i = 0; i < noisy.rgb.size(); ++i) noisy.rgb[i] += i / 3 % 2 ? .05F : -.05F;
  const double near_by = mean_of(ldr_flip(grey.view(), noisy.view(), 20)),
               far_away = mean_of(ldr_flip(grey.view(), noisy.view(), 120));
  EXPECT_GT(near_by, 1.5 * far_away);
}

TEST(Flip, StaysBetweenZeroAndOneForAllPixels) {
  Picture wild = waves(3, 1e6, true);
  wild.rgb[0] = std::nanf("");
  wild.rgb[7] = -5;
  wild.rgb[100] = INFINITY;
  wild.rgb[200] = 3e38F;
  for (const auto& errors :
       {hdr_flip(waves(1, 1, false).view(), wild.view()), hdr_flip(wild.view(), flat(0, 0, 0).view()),
        ldr_flip(wild.view(), flat(1, 0, 1).view())})
    for (const float e : errors) {
      EXPECT_GE(e, 0);
      EXPECT_LE(e, 1);
    }
  EXPECT_EQ(hdr(flat(0, 0, 0), flat(0, 0, 0)), 0);  // the reference has no positive value, and so no median
}

}  // namespace
}  // namespace ls

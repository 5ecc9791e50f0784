// Tests medium emission against closed forms and quadrature.
#include "worker/render/media/emission.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/unit/render/grids.h"
#include "worker/render/math/blackbody.h"

namespace ls::render {
namespace {

constexpr C3 kEmission{1, 2.5f, .25f};

Medium homogeneous(const C3& sigma) {
  Medium m;
  m.sigma_t = sigma;
  m.emission_kind = EmissionKind::per_length;
  m.emission = kEmission;
  return m;
}
Medium of_grid(const Grid& density, const C3& sigma, EmissionKind emission_kind,
               const C3& emission = kEmission) {
  Medium m;
  m.grid = true;
  m.density = &density;
  m.sigma_t = sigma;
  m.emission_kind = emission_kind;
  m.emission = emission;
  return m;
}
void emit(Medium& m, const Grid& g) { m.emitter = {&g, &g, &g}; }

TEST(MediumEmission, WithoutExtinctionItIsEmissionTimesLength) {
  const C3 light = emission_of_length(homogeneous(C3(0)), 3.5f);

  for (int c = 0; c < 3; ++c) EXPECT_EQ(light[c], kEmission[c] * 3.5f);
}

// In the thin limit the emission is e L (1 - tau/2 + tau^2/6 - ...). In float32 1 - e^-tau would be 0 there.
TEST(MediumEmission, ThinMediaHaveFullPrecision) {
  for (const double tau : {1e-30, 1e-12, 1e-9, 1e-6, 1e-3}) {
    const C3 light = emission_of_length(homogeneous(C3(static_cast<float>(tau / 2))), 2);
    const double expected = 2 * (1 - tau / 2 + tau * tau / 6);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(light[c] / (kEmission[c] * expected), 1, 0x1p-22) << tau;
  }
}

TEST(MediumEmission, OpaqueInfiniteMediumShowsEmissionOverExtinction) {
  for (const float s : {1e-3f, 1.f, 1e20f}) {
    const C3 light = emission_of_length(homogeneous(C3(s)), kInfinity);
    for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(light[c], kEmission[c] / s);
  }
  EXPECT_FLOAT_EQ(emission_of_length(homogeneous(C3(1e20f)), 5).x, kEmission.x / 1e20f);
  Medium half = homogeneous(C3(0));
  half.emission = C3(1, 0, 0);
  const C3 light = emission_of_length(half, kInfinity);
  EXPECT_TRUE(std::isinf(light.x));  // the sample will be rejected and counted
  EXPECT_EQ(light.y, 0);
}

// In each channel, every random number gives the closed form.
TEST(MediumEmission, ConstantGridEmitsLikeAHomogeneousMedium) {
  const Grid one = voxel_grid({3, 3, 3}, std::vector<float>(27, 1), kTrilinear, Wrap::clamp);
  for (const C3& sigma : {C3(0), C3(.3f), C3(0, 1, 16), C3(1e-9f, 1e3f, 1e9f)}) {
    // In the grid's cells of 4 voxels, some of these extinctions are tracked and some integrated exactly.
    const Medium m = of_grid(one, sigma, EmissionKind::per_length);
    const C3 expected = emission_of_length(homogeneous(sigma), 3);
    for (int i = 0; i < 50; ++i) {
      // The ray passes the grid from face to face: [-1/2, 5/2].
      const C3 light = emission_of_grid(m, {-.5f, 1, 1}, {1, 0, 0}, 3, RandomStream(mix64(i)));
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(light[c] / expected[c], 1, 1e-5) << sigma << " " << c;
    }
  }
}

TEST(MediumEmission, EmissionPerLengthExtendsBeyondTheDensity) {
  const Grid one = voxel_grid({3, 3, 3}, std::vector<float>(27, 1), kTrilinear, Wrap::clamp);
  const Medium m = of_grid(one, C3(.5f), EmissionKind::per_length);

  const C3 light = emission_of_grid(m, {-2.5f, 1, 1}, {1, 0, 0}, 10, RandomStream(1));

  // The ray's length is 2 in front of the grid, 3 inside and 5 behind.
  const double through = std::exp(-1.5), within = (1 - through) / .5;
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(light[c] / (kEmission[c] * (2 + within + 5 * through)), 1, 1e-5);
}

// Nothing is absorbed, so the result is the integral of the emission grid, without noise.
TEST(MediumEmission, GridWithoutExtinctionEmitsItsIntegral) {
  const Grid none = unit_grid({2, 2, 2}, std::vector<float>(8, 0));
  const Grid fire = unit_grid({9, 9, 9}, random_values({9, 9, 9}, 3, true));
  Medium m = of_grid(none, C3(1), EmissionKind::per_length);
  emit(m, fire);
  const V3 o(-1, .3f, 1.1f), d = normalize(V3(9, 7.1f, 6.2f));
  const double expected = exact_integral(fire, V3d(o), V3d(d), 0, 30);
  ASSERT_GT(expected, .5);

  for (int i = 0; i < 20; ++i) {
    const C3 light = emission_of_grid(m, o, d, 30, RandomStream(mix64(i)));
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(light[c] / (kEmission[c] * expected), 1, 1e-5);
  }
}

struct Mean {
  double mean[3], error[3];
};
Mean mean_of(const Medium& m, const V3& o, const V3& d, int n) {
  double sum[3] = {}, square[3] = {};
  for (int i = 0; i < n; ++i) {
    const C3 light = emission_of_grid(m, o, d, 40, RandomStream(mix64(i)));
    for (int c = 0; c < 3; ++c) {
      sum[c] += light[c];
      square[c] += double{light[c]} * light[c];
    }
  }
  Mean r{};
  for (int c = 0; c < 3; ++c) {
    r.mean[c] = sum[c] / n;
    r.error[c] = std::sqrt(std::max(0., square[c] / n - r.mean[c] * r.mean[c]) / n);
  }
  return r;
}

// With the source radiance B everywhere, the emission is B (1 - transmittance) for any density. Means are
// within 5 standard errors (each of 24 checks fails by chance with probability 6e-7) and the float32 rounding
// of 40 steps.
TEST(MediumEmission, IsothermalGridEmitsOneMinusItsTransmittance) {
  const V3 o(-1, .3f, 1.1f), d = normalize(V3(9, 7.1f, 6.2f));
  for (const bool sparse : {false, true})
    for (const C3& sigma : {C3(.3f), C3(0, .3f, 6), C3(1e3f), C3(.1f, 1e2f, 1e7f)}) {
      const Grid g = unit_grid({9, 9, 9}, random_values({9, 9, 9}, 5, sparse), 0, max_component(sigma));
      const Medium m = of_grid(g, sigma, EmissionKind::per_absorption);
      const double depth = exact_integral(g, V3d(o), V3d(d), 0, 30);
      const Mean r = mean_of(m, o, d, 4000);
      for (int c = 0; c < 3; ++c) {
        const double expected = kEmission[c] * -std::expm1(-sigma[c] * depth);
        EXPECT_NEAR(r.mean[c], expected, 5 * r.error[c] + 40 * 0x1p-23 * expected) << sigma << " " << c;
        // The only noise comes from roulette, which acts where the transmittance is nearly 0.
        EXPECT_LE(r.error[c], 1e-4 * expected) << sigma << " " << c;
      }
    }
}

// Integral of e(t) exp(-sigma integral of rho), by Simpson's rule with fine steps.
double quadrature(const Grid& density, double sigma, const std::function<double(const V3&)>& e, const V3& o,
                  const V3& d, double length) {
  constexpr int kSteps = 20000;
  const double h = length / kSteps;
  double sum = 0, depth = 0;
  const auto rho = [&](double t) {
    const V3 q = density.to_index(o + d * static_cast<float>(t));
    for (int k = 0; k < 3; ++k)
      if (q[k] < density.domain_lo()[k] || q[k] > density.domain_hi()[k]) return 0.;
    return static_cast<double>(density.value_anywhere(q));
  };
  for (int i = 0; i < kSteps; ++i) {
    const double t = i * h, a = rho(t), b = rho(t + h / 2), c = rho(t + h);
    const auto at = [&](double x) { return e(o + d * static_cast<float>(x)); };
    const double half = depth + h / 24 * (5 * a + 8 * b - c), full = depth + h / 6 * (a + 4 * b + c);
    sum += h / 6 *
           (at(t) * std::exp(-sigma * depth) + 4 * at(t + h / 2) * std::exp(-sigma * half) +
            at(t + h) * std::exp(-sigma * full));
    depth = full;
  }
  return sum;
}

// The grids have different positions and sizes, and the channels different optical depths. The tolerance is 5
// standard errors plus 1e-3 of the quadrature, whose steps do not end at voxel boundaries.
TEST(MediumEmission, TwoGridsMatchQuadrature) {
  const Grid density = unit_grid({9, 9, 9}, random_values({9, 9, 9}, 5, true), 0, 3);
  const Affine finer = Affine::scale_translate(1.7, V3d(1, 2, 1.5));
  const Grid fire({11, 8, 9}, random_values({11, 8, 9}, 8), finer, V3d(0), V3d(10, 7, 8), 1);
  const V3 o(-1, .3f, 1.1f), d = normalize(V3(9, 7.1f, 6.2f));
  const auto inside = [&](const Grid& g, const V3& p) {
    const V3 q = g.to_index(p);
    for (int k = 0; k < 3; ++k)
      if (q[k] < g.domain_lo()[k] || q[k] > g.domain_hi()[k]) return 0.;
    return static_cast<double>(g.value_anywhere(q));
  };
  const C3 sigma(.2f, 1, 6);
  for (const EmissionKind emission_kind :
       {EmissionKind::per_length, EmissionKind::per_absorption, EmissionKind::black_body}) {
    Medium m = of_grid(density, sigma, emission_kind);
    m.sigma_s = sigma * .4f;
    m.absorbing = C3(.6f);
    m.kelvin_scale = 3000;
    m.kelvin_offset = 500;
    emit(m, fire);
    const Mean r = mean_of(m, o, d, 20000);
    for (int c = 0; c < 3; ++c) {
      const double absorption = .6 * sigma[c];
      const auto e = [&](const V3& p) {
        const double value = inside(fire, p), rho = inside(density, p);
        switch (emission_kind) {
          case EmissionKind::per_length:
            return kEmission[c] * value;
          case EmissionKind::black_body:
            return value > 0 ? kEmission[c] * absorption * rho *
                                   black_body_radiance(static_cast<float>(500 + 3000 * value))[c]
                             : 0.;
          default:
            return kEmission[c] * absorption * rho * value;
        }
      };
      const double expected = quadrature(density, sigma[c], e, o, d, 25);
      ASSERT_GT(expected, 0);
      EXPECT_NEAR(r.mean[c], expected, 5 * r.error[c] + 1e-3 * expected)
          << static_cast<int>(emission_kind) << " " << c;
      EXPECT_LE(r.error[c], .01 * expected) << static_cast<int>(emission_kind) << " " << c;
    }
  }
}

// Density, temperatures and weights have different positions, and the ray leaves the box of the weights where
// there is still density. The tolerance is 5 standard errors plus 1e-3 of the quadrature, as above.
TEST(MediumEmission, NormalisedBlackBodiesAreWeighted) {
  const Grid density = unit_grid({9, 9, 9}, random_values({9, 9, 9}, 5), 0, 3);
  const Grid fire({11, 8, 9}, random_values({11, 8, 9}, 8), Affine::scale_translate(1.7, V3d(1, 2, 1.5)),
                  V3d(0), V3d(10, 7, 8), 1);
  const Grid weight({3, 3, 3}, random_values({3, 3, 3}, 9), Affine::scale_translate(.5, V3d(1, 1, 1)), V3d(0),
                    V3d(2, 2, 2), 1);
  const V3 o(-1, .3f, 1.1f), d = normalize(V3(9, 7.1f, 6.2f));
  const auto inside = [](const Grid& g, const V3& p) {
    const V3 q = g.to_index(p);
    return g.in_domain(q) ? static_cast<double>(g.value_anywhere(q)) : 0.;
  };
  const C3 sigma(.2f, 1, 6);
  Medium m = of_grid(density, sigma, EmissionKind::black_body);
  m.kelvin_scale = 3000;
  m.kelvin_offset = 500;
  m.peak_one = true;
  m.weight = &weight;
  emit(m, fire);

  const Mean r = mean_of(m, o, d, 20000);

  for (int c = 0; c < 3; ++c) {
    const auto e = [&](const V3& p) {
      const double value = inside(fire, p);
      return value > 0 ? kEmission[c] * sigma[c] * inside(density, p) * inside(weight, p) *
                             black_body_of_peak_one(static_cast<float>(500 + 3000 * value))[c]
                       : 0.;
    };
    const double expected = quadrature(density, sigma[c], e, o, d, 25);
    ASSERT_GT(expected, 0);
    EXPECT_NEAR(r.mean[c], expected, 5 * r.error[c] + 1e-3 * expected) << c;
    EXPECT_LE(r.error[c], .02 * expected) << c;
  }
}

TEST(MediumEmission, AgreesForGridsWithoutInterpolation) {
  const Grid density = voxel_grid({7, 7, 7}, random_values({7, 7, 7}, 5), kNearest, Wrap::clamp, 3);
  const Medium m = of_grid(density, C3(1), EmissionKind::per_absorption);
  const V3 o(-1, 1.3f, 1.1f), d = normalize(V3(9, 3.1f, 4.2f));

  const Mean r = mean_of(m, o, d, 4000);

  const double expected = -std::expm1(-exact_integral(density, V3d(o), V3d(d), 0, 30));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(r.mean[c] / kEmission[c], expected, 5 * r.error[c] + 1e-5);
}

TEST(MediumEmission, InvalidRaysAreDark) {
  const Grid g = unit_grid({3, 3, 3}, random_values({3, 3, 3}, 5));
  const Medium m = of_grid(g, C3(1), EmissionKind::per_absorption);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(emission_of_grid(m, {nan, 0, 0}, {1, 0, 0}, 5, RandomStream(1)), C3(0));
  EXPECT_EQ(emission_of_grid(m, {0, 0, 0}, {nan, 0, 0}, kInfinity, RandomStream(1)), C3(0));
  EXPECT_EQ(emission_of_grid(m, {0, 9, 0}, {1, 0, 0}, kInfinity, RandomStream(1)), C3(0));
}

// Illuminant A of CIE 15 is a black body of 2856 K, with x = .44758, y = .40745. The candela was once defined
// by a black body at the freezing point of platinum, 2041.4 K, as one sixtieth of the light of 1 cm^2:
// 600,000 cd/m^2, within half a per cent. The luminance uses 683 lm/W at 555 nm and an observer whose y
// integrates to 106.857 nm.
TEST(BlackBody, HasTheColourAndLuminanceOfItsTemperature) {
  const auto luminance = [](const C3& c) {
    return .212639005871510 * c.x + .715168678767756 * c.y + .072192315360734 * c.z;
  };
  const C3 a = black_body_radiance(2856);
  // The chromaticity x, y of linear sRGB, by the matrix of its primaries.
  const double x = .412390799265959 * a.x + .357584339383878 * a.y + .180480788401834 * a.z, y = luminance(a),
               z = .019330818715592 * a.x + .119194779794626 * a.y + .950532152249661 * a.z;
  EXPECT_NEAR(x / (x + y + z), .44758, 2e-4);
  EXPECT_NEAR(y / (x + y + z), .40745, 2e-4);
  // The blue component is outside of sRGB and set to 0, which adds less than .1 % of the luminance.
  EXPECT_NEAR(luminance(black_body_radiance(2041.4f)) * 683.002 * 106.857 / 600000, 1, .006);
}

// Planck's law, with its constants; its largest value is found by trying wavelengths in steps of 1e-4. The
// nearest one is off the peak by at most 5e-5, so the error is at most (5e-5)^2 / 2 times the curvature,
// which is below 20 there.
TEST(BlackBody, NormalisedSpectrumIsDividedByItsLargestValue) {
  const double h = 6.62607015e-34, c = 299792458, k = 1.380649e-23;
  for (const double t : {250., 1500., 2856., 6500., 30000.}) {
    double largest = 0;
    for (double nm = 2e6 / t; nm < 4e6 / t; nm *= 1.0001) {
      const double m = nm * 1e-9;
      largest = std::max(largest, 2 * h * c * c / std::pow(m, 5) / std::expm1(h * c / (m * k * t)) * 1e-9);
    }
    const C3 whole = black_body_radiance(static_cast<float>(t)),
             one = black_body_of_peak_one(static_cast<float>(t));
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(one[i] * largest, whole[i], 1e-6 * whole[i]) << t << " " << i;
  }
}

// No component is above the bound by which media_build.cpp checks emission, and cold bodies are black.
TEST(BlackBody, NormalisedSpectrumIsBounded) {
  EXPECT_EQ(black_body_of_peak_one(199), C3(0));
  EXPECT_EQ(black_body_of_peak_one(std::numeric_limits<float>::quiet_NaN()), C3(0));
  for (float t = 200; t < 1e12f; t *= 1.07f) {
    const C3 b = black_body_of_peak_one(t);
    EXPECT_TRUE(is_finite(b)) << t;
    EXPECT_LE(max_component(b), 3.25f) << t;
  }
}

TEST(BlackBody, IsDarkWhenColdAndNeverAboveRayleighJeans) {
  for (const float t : {-5.f, 0.f, 199.f, -kInfinity, std::numeric_limits<float>::quiet_NaN()})
    EXPECT_EQ(black_body_radiance(t), C3(0)) << t;
  float before = 0;
  for (float t = 200; t < 1e7f; t *= 1.07f) {
    const C3 c = black_body_radiance(t);
    EXPECT_TRUE(is_finite(c)) << t;
    EXPECT_GE(c.x, before) << t;
    before = c.x;
  }
  const C3 hot = black_body_radiance(1e6f), hotter = black_body_radiance(4e6f);
  for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(hotter[c], 4 * hot[c]);
}

}  // namespace
}  // namespace ls::render

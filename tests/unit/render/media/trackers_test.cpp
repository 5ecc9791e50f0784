// Tests delta tracking, residual ratio tracking and the exact integration of dense cells against exact
// integrals.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/chi_square.h"
#include "tests/unit/render/grids.h"
#include "worker/render/media/medium.h"

namespace ls::render {
namespace {

// The means are within 5 standard errors of the exact integral (each of 42 checks fails by chance with
// probability 6e-7, any of them with 3e-5)
constexpr int kTrackedFlights = 40000;

struct Track {
  const char* name;
  Grid grid;
  C3 sigma;
};
std::vector<Track> tracks() {
  std::vector<Track> t;
  t.push_back({"dense", unit_grid({9, 9, 9}, random_values({9, 9, 9}, 5)), C3(.3f)});
  t.push_back({"sparse", unit_grid({9, 9, 9}, random_values({9, 9, 9}, 6, true)), C3(2)});
  t.push_back({"chromatic", unit_grid({9, 9, 9}, random_values({9, 9, 9}, 7)), C3(0, .2f, .6f)});
  // Some cells are tracked and some integrated exactly. One channel has no extinction, one is nearly opaque.
  t.push_back({"dense chromatic", unit_grid({9, 9, 9}, random_values({9, 9, 9}, 17, true)), C3(0, .3f, 6)});
  const auto voxels = [](unsigned seed) { return random_values({9, 9, 9}, seed); };
  t.push_back({"nearest", voxel_grid({9, 9, 9}, voxels(11), kNearest, Wrap::clamp), C3(.3f)});
  t.push_back(
      {"nearest chromatic", voxel_grid({9, 9, 9}, voxels(12), kNearest, Wrap::repeat), C3(0, .2f, .6f)});
  t.push_back({"repeated", voxel_grid({9, 9, 9}, voxels(13), kTrilinear, Wrap::repeat), C3(.3f)});
  return t;
}

TEST(Trackers, TransmittancesAverageToTheExactOnes) {
  for (const Track& t : tracks()) {
    Medium m;
    m.grid = true;
    m.density = &t.grid;
    m.sigma_t = t.sigma;
    const V3 o(-1, .3f, 1.1f), d = normalize(V3(9, 7.1f, 6.2f));
    const double tau = exact_integral(t.grid, V3d(o), V3d(d), 0, 30);
    double sum[3] = {}, square[3] = {}, fly[3] = {}, fly2[3] = {};
    MediumCounters counters;
    for (int i = 0; i < kTrackedFlights; ++i) {
      const C3 r = transmittance<kEverything>(m, o, d, 0, 30, RandomStream(mix64(i)));
      // Delta tracking: the weight of flights that pass, by the balance heuristic over heroes.
      const int hero = i % 3;
      RandomStream s(mix64(i + (1ull << 40)));
      const std::uint32_t bits = s.bits();
      const Flight f = free_flight<kEverything>(m, hero, bits, o, d, 30, s, counters);
      const double density = (double{f.density.x} + f.density.y + f.density.z) / 3;
      for (int c = 0; c < 3; ++c) {
        sum[c] += r[c];
        square[c] += double{r[c]} * r[c];
        const double v = f.scattered ? 0 : f.weight[c] / density;
        fly[c] += v;
        fly2[c] += v * v;
      }
    }
    EXPECT_EQ(counters.majorant_violations, 0u);
    const auto check = [&](double s, double s2, double expected, const char* what, int c) {
      const double mean = s / kTrackedFlights,
                   se = std::sqrt(std::max(0., s2 / kTrackedFlights - mean * mean) / kTrackedFlights);
      // Optical depths are sums of about 30 steps in float32, each rounded by 2^-24 of the depth.
      EXPECT_NEAR(mean, expected, 5 * se + expected * 30 * 0x1p-23)
          << t.name << " " << what << " channel " << c;
      EXPECT_LT(se, .05 * expected) << t.name << " " << what;
    };
    for (int c = 0; c < 3; ++c) {
      check(sum[c], square[c], std::exp(-t.sigma[c] * tau), "ratio", c);
      check(fly[c], fly2[c], std::exp(-t.sigma[c] * tau), "delta", c);
    }
  }
}

// One voxel of density 1e6 among empty ones: rays that miss it are not attenuated, rays through it are
// blocked.
TEST(Trackers, DenseVoxelDoesNotDarkenItsCell) {
  const Size n{16, 16, 16};
  std::vector<float> values(16 * 16 * 16, 0);
  values[(8 * 16 + 8) * 16 + 8] = 1e6f;
  for (const float rho : {1.f, 2e-5f, 1e-6f}) {  // scale of the density; the small ones are tracked
    std::vector<float> v = values;
    for (float& x : v) x *= rho;
    const Grid g = unit_grid(n, v);
    Medium m;
    m.grid = true;
    m.density = &g;
    m.sigma_t = C3(1, 1, 0);
    for (const float offset : {0.f, .5f, .99f, 1.f, 2.f}) {
      const V3 o(-1, 8 + offset, 8), d(1, 0, 0);
      const double expected = std::exp(-exact_integral(g, V3d(o), V3d(d), 0, 30));
      double sum = 0, square = 0;
      constexpr int kRays = 4000;
      for (int i = 0; i < kRays; ++i) {
        const C3 t = transmittance<kEverything>(m, o, d, 0, 30, RandomStream(mix64(i)));
        ASSERT_EQ(t.x, t.y);
        ASSERT_EQ(t.z, 1.f);
        sum += t.x;
        square += double{t.x} * t.x;
      }
      const double mean = sum / kRays, se = std::sqrt(std::max(0., square / kRays - mean * mean) / kRays);
      EXPECT_NEAR(mean, expected, 5 * se + 1e-5 * expected + 1e-30) << rho << " " << offset;
      EXPECT_LT(se, .02) << rho << " " << offset;
    }
  }
}

// The densities are so high that a tracker's steps would be smaller than the rounding of its distance. The
// number of voxels limits the work.
TEST(Trackers, HugeDensitiesCostNoTimeAndStopLightAtOnce) {
  const Size n{64, 64, 64};
  std::vector<float> v = random_values(n, 15, true);
  for (const float sigma : {1e6f, 1e9f, 1e20f, 1e30f}) {
    const Grid g = unit_grid(n, v, 0, sigma);
    for (const C3& s : {C3(sigma), C3(0, .5f * sigma, sigma)}) {
      Medium m;
      m.grid = true;
      m.density = &g;
      m.sigma_t = m.sigma_s = s;
      MediumCounters counters;
      std::mt19937 rng(9);
      int scattered = 0;
      for (int i = 0; i < 300; ++i) {
        const V3 o(V3d(32) + random_direction(rng) * 60.), d = normalize(V3(32) - o);
        const C3 t = transmittance<kEverything>(m, o, d, 0, 200, RandomStream(mix64(i)));
        ASSERT_EQ(t, C3(0, 0, 0) + C3(s.x == 0, 0, 0));
        RandomStream r(mix64(i + 1000));
        const std::uint32_t bits = r.bits();
        const Flight f = free_flight<kEverything>(m, i % 3, bits, o, d, 200, r, counters);
        ASSERT_TRUE(is_finite(f.weight) && is_finite(f.density));
        scattered += f.scattered;
        if (!f.scattered) {
          ASSERT_EQ(s[i % 3], 0);
        } else if (sigma > 1e8f) {
          // The flight ends at the first density on the ray, up to float32 positions: an error of 2^-19 over
          // at most 64, with values below 1.
          ASSERT_LT(exact_integral(g, V3d(o), V3d(d), 0, f.t * (1 - 1e-6)), 64 * 0x1p-19 + 40 / s[i % 3])
              << sigma;
        }
      }
      EXPECT_GE(scattered, 200);
    }
  }
}

// Flights through cells that are integrated exactly end as the closed form requires: the optical depth at the
// end has the density e^-depth.
TEST(Trackers, FlightsThroughDenseCellsAreExponentialInDepth) {
  const Size n{32, 32, 32};
  std::vector<float> v = random_values(n, 16, true);
  // One voxel in 8 is dense, so rays cross tracked cells as well as integrated ones.
  const Grid g = unit_grid(n, v, 0, 40);
  Medium m;
  m.grid = true;
  m.density = &g;
  m.sigma_t = m.sigma_s = C3(40);
  MediumCounters counters;
  constexpr int kTrackedFlights = 20000, kBins = 16;
  std::vector<double> count(kBins, 0), expected(kBins, double{kTrackedFlights} / kBins);
  for (int i = 0; i < kTrackedFlights; ++i) {
    RandomStream r(mix64(i));
    const V3 o(-1, 3 + 20 * r.uniform(), 3 + 20 * r.uniform()), d = normalize(V3(1, .2f, .1f));
    const std::uint32_t bits = r.bits();
    const Flight f = free_flight<kEverything>(m, 0, bits, o, d, 100, r, counters);
    ASSERT_TRUE(f.scattered);
    const double share = -std::expm1(-40 * exact_integral(g, V3d(o), V3d(d), 0, f.t));
    ++count[static_cast<std::size_t>(std::min(kBins - 1, static_cast<int>(share * kBins)))];
  }
  test::ChiSquareTally tally("render/trackers");
  tally.expect("dense cells", expected, count);
  tally.close();
  EXPECT_EQ(counters.majorant_violations, 0u);
}

TEST(Trackers, HomogeneousTransmittanceIsExactIntoTheTail) {
  Medium m;
  m.sigma_t = C3(1, 2, 0);
  const C3 t = transmittance<kEverything>(m, V3(0), V3(0, 0, 1), 0, 20, RandomStream(0));
  EXPECT_NEAR(t.x / std::exp(-20.), 1, 1e-5);
  EXPECT_NEAR(t.y / std::exp(-40.), 1, 1e-5);
  EXPECT_EQ(t.z, 1.f);
}

}  // namespace
}  // namespace ls::render

// Density grids: interpolation, exact integrals, the walk through macro cells, and the trackers on top of
// them.
#include "worker/render/grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "worker/render/medium.h"

namespace ls::render {
namespace {

using Size = std::array<int, 3>;

// Nodes at integer points of the world; the domain may reach beyond them.
Grid unit_grid(Size n, std::vector<float> v, double beyond = 0, double sigma = 1) {
  return {n,
          std::move(v),
          Affine(),
          V3d(-beyond),
          V3d(n[0] - 1 + beyond, n[1] - 1 + beyond, n[2] - 1 + beyond),
          sigma};
}
std::vector<float> random_values(Size n, unsigned seed, bool sparse = false) {
  std::mt19937 rng(seed);
  std::vector<float> v(static_cast<std::size_t>(n[0]) * n[1] * n[2]);
  for (float& x : v) x = sparse && rng() % 8 ? 0.f : static_cast<float>(rng()) * 0x1p-32f;
  return v;
}
V3d random_direction(std::mt19937& rng) {
  std::normal_distribution<double> n;
  const double x = n(rng), y = n(rng), z = n(rng);
  return V3d(x, y, z).normalized();
}

TEST(Grid, InterpolatesToItsNodesAndClampsBeyondThem) {
  const Size n{2, 3, 4};
  const auto values = random_values(n, 1);
  const Grid g = unit_grid(n, values, .5);
  for (int z = 0; z < 4; ++z)
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 2; ++x)
        // Three lerps of numbers below 1, each rounded twice.
        EXPECT_NEAR(g.value(V3(x, y, z)), values[static_cast<std::size_t>((z * 3 + y) * 2 + x)], 6 * 0x1p-25);

  EXPECT_EQ(g.value(V3(-.4f, -.4f, -.4f)), values.front());
  EXPECT_EQ(g.value(V3(1.5f, 2.5f, 3.5f)), g.value(V3(1, 2, 3)));
  EXPECT_FLOAT_EQ(g.value(V3(.5f, 0, 0)), (values[0] + values[1]) / 2);
}

TEST(Grid, DiagonalOfTheProductOfCoordinatesIsTheRootOfThreeQuarters) {
  std::vector<float> v(8, 0);
  v[7] = 1;  // density = x y z
  EXPECT_NEAR(unit_grid({2, 2, 2}, v).exact_integral({0, 0, 0}, {1, 1, 1}, 0, 1) * std::sqrt(3.),
              std::sqrt(3.) / 4, 1e-15);
}

TEST(Grid, IntegralsOfTentRampAndConstantMatchClosedForms) {
  std::vector<float> tent(27, 0);
  tent[13] = 5;
  EXPECT_NEAR(unit_grid({3, 3, 3}, tent).exact_integral({-4, 1, 1}, {1, 0, 0}, 0, 10), 5, 1e-14);  // rho h

  const Grid ramp = unit_grid({4, 1, 1}, {0, 1, 2, 3}, .5);
  EXPECT_NEAR(ramp.exact_integral({-9, 0, 0}, {1, 0, 0}, 0, 99), 4.5 + 1.5,
              1e-13);  // clamped half voxels: 0 and 3/2
  EXPECT_NEAR(ramp.exact_integral({1.25, 0, 0}, {-1, 0, 0}, 0, 1), .5 * (1.25 * 1.25 - .25 * .25), 1e-14);

  const Grid constant = unit_grid({2, 3, 4}, std::vector<float>(24, 3), .5);
  EXPECT_NEAR(constant.exact_integral({-9, 1, 1}, {1, 0, 0}, 0, 99), 3 * 2, 1e-13);  // 1 + two half voxels
  EXPECT_EQ(constant.exact_integral({-9, 7, 1}, {1, 0, 0}, 0, 99), 0);
}

struct Ray {
  V3 o, d;
};
std::vector<Ray> awkward_rays() {
  std::vector<Ray> rays = {
      {{-3, 4, 4}, {1, 0, 0}},           {{-3, 4, 4}, {1, -0.f, -0.f}},   {{20, 0, 0}, {-1, 0, 0}},
      {{4, 4, -1}, {0, 0, 1}},           {{-1, -1, -1}, {.5f, .5f, .5f}}, {{20, 20, 20}, {-1, -1, -1}},
      {{4, -2, 8}, {1e-38f, 1, 1e-38f}}, {{4, -2, 8}, {1e-41f, 1, 0}},    {{0, 0, 0}, {1, 1e-7f, 0}},
      {{3.3f, 4.4f, 5.5f}, {0, -1, 0}},  {{8, 8, 8}, {.6f, .8f, 0}},      {{-1e6f, 5, 5}, {1, 1e-9f, 0}}};
  std::mt19937 rng(4);
  for (int i = 0; i < 2000; ++i) {
    const V3d d = random_direction(rng), o = V3d(6) + random_direction(rng) * 20.;
    rays.push_back({V3(o), V3(i % 2 ? d : (V3d(6) - o).normalized())});
  }
  return rays;
}

TEST(CellWalk, CoversTheRaysPartInTheDomainOnceAndInOrder) {
  const Grid g = unit_grid({13, 14, 11}, random_values({13, 14, 11}, 2), 0, 10);
  ASSERT_EQ(g.cell_size(), 4);
  const auto cells = g.cells();
  for (const Ray& r : awkward_rays()) {
    float last = -1, total = 0, first = -1;
    int count = 0;
    for (CellWalk w(g, r.o, r.d, 0, 2e6f); w.next(); ++count) {
      if (first < 0) first = w.begin();
      if (last >= 0) {
        ASSERT_EQ(w.begin(), last) << "a gap";
      }
      ASSERT_GE(w.end(), w.begin());
      total += w.end() - w.begin();
      last = w.end();
      ASSERT_LE(count, cells[0] + cells[1] + cells[2] + 3);
    }
    // The domain's chord, in double.
    double t0 = 0, t1 = 2e6;
    const double hi[3] = {12, 13, 10};
    for (int k = 0; k < 3; ++k) {
      if (r.d[k] == 0) {
        if (r.o[k] < 0 || r.o[k] > hi[k]) t1 = -1;
        continue;
      }
      const double a = -double{r.o[k]} / r.d[k], b = (hi[k] - r.o[k]) / r.d[k];
      t0 = std::max(t0, std::min(a, b));
      t1 = std::min(t1, std::max(a, b));
    }
    const double chord = std::max(0., t1 - t0);
    // Ends are rounded to float32 at their distance.
    ASSERT_NEAR(last >= 0 ? last - first : 0, chord, 0x1p-22 * std::max(1., std::abs(t1)))
        << "o " << r.o << " d " << r.d;
  }
}

TEST(CellWalk, BoundsHoldAtEveryPointOfEveryCell) {
  for (const bool sparse : {false, true}) {
    const Grid g = unit_grid({13, 14, 11}, random_values({13, 14, 11}, 3, sparse), .5, 10);
    std::mt19937 rng(1);
    for (const Ray& r : awkward_rays()) {
      for (CellWalk w(g, r.o, r.d, 0, 100); w.next();) {
        for (int i = 0; i <= 8; ++i) {
          const float v = g.value(w.index(w.begin() + (w.end() - w.begin()) * static_cast<float>(i) / 8));
          ASSERT_LE(v, w.cell().hi);
          ASSERT_LE(std::abs(v - w.cell().control), w.cell().residual);
        }
      }
    }
  }
}

TEST(CellWalk, MajorantDepthDoesNotDependOnHowARayIsCut) {
  const Grid g = unit_grid({13, 14, 11}, random_values({13, 14, 11}, 2), 0, 10);
  const auto depth = [&](const Ray& r, int parts) {
    double sum = 0;
    for (int i = 0; i < parts; ++i) {
      const float a = 40.f * static_cast<float>(i) / static_cast<float>(parts),
                  b = 40.f * static_cast<float>(i + 1) / static_cast<float>(parts);
      for (CellWalk w(g, r.o, r.d, a, b); w.next();) sum += w.cell().hi * (w.end() - w.begin());
    }
    return sum;
  };
  std::mt19937 rng(8);
  for (int i = 0; i < 50; ++i) {
    const Ray r{V3(V3d(6) + random_direction(rng) * 20.), V3(random_direction(rng))};
    // Each cut and each of up to 12 boundaries is good to 2^-23 of 40; rates are at most 1.
    EXPECT_NEAR(depth(r, 1), depth(r, 10), (12 + 10) * 40 * 0x1p-22);
    EXPECT_NEAR(depth(r, 1), depth(r, 1000), (12 + 1000) * 40 * 0x1p-22);
  }
}

TEST(Grid, ConstantGridsNeedNoResidual) {
  const Grid g = unit_grid({9, 9, 9}, std::vector<float>(729, .7f));
  for (int x = 0; x < g.cells()[0]; ++x) EXPECT_EQ(g.cell(x, 0, 0).residual, 0.f);
}

// ---- trackers: means within 5 standard errors of the exact integral (6e-7 a check, 30 checks: 2e-5)
constexpr int kFlights = 40000;

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
  return t;
}

TEST(Trackers, TransmittancesAverageToTheExactOnes) {
  for (const Track& t : tracks()) {
    Medium m;
    m.grid = true;
    m.density = &t.grid;
    m.sigma_t = t.sigma;
    const V3 o(-1, .3f, 1.1f), d = normalize(V3(9, 7.1f, 6.2f));
    const double tau = t.grid.exact_integral(V3d(o), V3d(d), 0, 30);
    double sum[3] = {}, square[3] = {}, fly[3] = {}, fly2[3] = {};
    MediumCounters counters;
    for (int i = 0; i < kFlights; ++i) {
      const C3 r = transmittance<kEverything>(m, o, d, 0, 30, RandomStream(mix64(i)));
      // Delta tracking: the flight that gets through, by the balance heuristic over heroes.
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
      const double mean = s / kFlights, se = std::sqrt(std::max(0., s2 / kFlights - mean * mean) / kFlights);
      // Depths are sums of float32: each of about 30 steps rounded by 2^-24 of the depth.
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

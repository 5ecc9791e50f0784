// Sampling of environment maps: samples have exactly the density that pdf reports.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <random>
#include <vector>

#include "tests/support/chi_square.h"
#include "tests/support/jacobian.h"
#include "tests/unit/render/envmap_builder.h"
#include "worker/render/math/random.h"

namespace ls::render {
namespace {

using test::SkyImage;

SkyImage random_sky(int width, int height, unsigned seed) {
  SkyImage s(width, height);
  std::mt19937 rng(seed);
  for (float& v : s.rgb) v = rng() % 3 == 0 ? static_cast<float>(rng() % 1000) / 500 : 0.f;
  if (height > 3) s.set(width / 3, height / 3, {34000, 30000, 20000});
  return s;
}
struct NamedSky {
  const char* name;
  SkyImage image;
};
std::vector<NamedSky> skies() {
  std::vector<NamedSky> all = {{"least", random_sky(2, 3, 1)},
                               {"small", random_sky(7, 5, 2)},
                               {"sun", random_sky(64, 32, 3)},
                               {"constant", SkyImage(6, 4, 2)}};
  SkyImage pole(8, 5), corner(8, 5);
  pole.set_row(0, {3, 2, 1});
  corner.set(7, 4, {1, 1, 1});
  all.push_back({"only a pole", pole});
  all.push_back({"only the last texel", corner});
  return all;
}

// The direction, in the map's own space, with the azimuth 2 pi u and the cosine z.
V3 direction(double u, double z) {
  const double r = std::sqrt(std::max(0., 1 - z * z));
  return V3(V3d(std::sin(2 * kPiD * u) * r, z, -std::cos(2 * kPiD * u) * r));
}

// A grid of `per` x `per` parts of each cell. Within a cell the density is bilinear in azimuth and cosine, so
// that the midpoint rule is exact.
struct Bins {
  int across, down, per = 2;  // numbers of cells across and down, and of parts along each side of a cell
  explicit Bins(const SkyImage& s) : across(s.width), down(s.height - 1) {}
  int size() const { return across * down * per * per; }
  double edge(int row) const {  // cosine at the upper edge of a row of parts
    const double top = std::cos(kPiD * (row / per) / down), bottom = std::cos(kPiD * (row / per + 1) / down);
    return top + (bottom - top) * (row % per) / per;
  }
  double share(const EnvironmentMap& m, int column, int row) const {
    const double u = ((column + .5) / per + .5) / across, z = (edge(row) + edge(row + 1)) / 2;
    return double{m.at(direction(u, z)).pdf} * 2 * kPiD / (across * per) * (edge(row) - edge(row + 1));
  }
  int of(const V3& d) const {
    double u = std::atan2(double{d.x}, -double{d.z}) / (2 * kPiD) * across - .5;
    u = (u < 0 ? u + across : u) * per;
    const double angle = std::atan2(std::hypot(double{d.x}, double{d.z}), double{d.y});
    int row = std::min(static_cast<int>(angle / kPiD * down), down - 1) * per;
    const double z = d.y / std::sqrt(double{dot(d, d)});
    while (row % per + 1 < per && z < edge(row + 1)) ++row;
    return row * across * per + std::min(static_cast<int>(u), across * per - 1);
  }
};

TEST(EnvironmentMap, DensityIntegratesToOne) {
  for (const NamedSky& n : skies()) {
    const EnvironmentMap m = map_of(n.image, test::rotate_y(0));
    const Bins bins(n.image);
    double sum = 0;
    for (int row = 0; row < bins.down * bins.per; ++row)
      for (int column = 0; column < bins.across * bins.per; ++column) sum += bins.share(m, column, row);
    // The place of each part is rounded by 2^-24 of a turn, and a cell is 1/64 of a turn.
    EXPECT_NEAR(sum, 1, 64 * 0x1p-22) << n.name;
  }
}

TEST(EnvironmentMap, SamplesFollowTheirDensity) {
  test::ChiSquareTally tally("render/envmap");
  for (const NamedSky& n : skies()) {
    const EnvironmentMap m = map_of(n.image);
    const Bins bins(n.image);
    constexpr int kSamples = 1 << 18;
    std::vector<double> expected, got(static_cast<std::size_t>(bins.size()));
    for (int row = 0; row < bins.down * bins.per; ++row)
      for (int column = 0; column < bins.across * bins.per; ++column)
        expected.push_back(kSamples * bins.share(m, column, row));
    RandomStream r(77);
    for (int i = 0; i < kSamples; ++i) {
      const std::uint32_t x = r.bits(), y = r.bits();
      ++got[static_cast<std::size_t>(bins.of(m.sample(x, y)))];
    }
    tally.expect(n.name, expected, got);
  }
  tally.close();
}

// Returns the first word for which `holds` is true; it must be true for all words that follow. 2^32 if there
// is none.
std::uint64_t first_where(const std::function<bool(std::uint32_t)>& holds) {
  std::uint64_t low = 0, high = std::uint64_t{1} << 32;
  while (low < high) {
    const std::uint64_t middle = (low + high) / 2;
    if (holds(static_cast<std::uint32_t>(middle)))
      high = middle;
    else
      low = middle + 1;
  }
  return low;
}

// Finite differences must not cross the kinks of the map between its cells. So each cell is tested alone,
// with the words that choose it: its share of all words, times the Jacobian of the map from the unit square
// onto it, is 1 over the density.
TEST(EnvironmentMap, SamplingJacobianIsOneOverTheDensity) {
  std::vector<NamedSky> all = skies();
  SkyImage overcast(12, 7);
  std::mt19937 rng(6);
  for (float& v : overcast.rgb) v = static_cast<float>(1 + rng() % 100);
  all.push_back({"overcast", overcast});
  int cells = 0;
  for (const NamedSky& n : all) {
    const EnvironmentMap m = map_of(n.image);
    Bins bins(n.image);
    bins.per = 1;
    const auto row_of = [&](std::uint32_t y) { return bins.of(m.sample(0, y)) / bins.across; };
    for (int j = 0; j < bins.down; ++j) {
      const std::uint64_t y0 = first_where([&](std::uint32_t y) { return row_of(y) >= j; });
      const std::uint64_t y1 = first_where([&](std::uint32_t y) { return row_of(y) > j; });
      const auto column_of = [&](std::uint32_t x) {
        return bins.of(m.sample(x, static_cast<std::uint32_t>((y0 + y1) / 2))) % bins.across;
      };
      for (int i = 0; i < bins.across; i += 1 + bins.across / 8) {
        const std::uint64_t x0 = first_where([&](std::uint32_t x) { return column_of(x) >= i; });
        const std::uint64_t x1 = first_where([&](std::uint32_t x) { return column_of(x) > i; });
        // With fewer words than these, single words would be visible in the differences.
        if (y1 < y0 + (1 << 24) || x1 < x0 + (1 << 24)) continue;
        const double wide = static_cast<double>(x1 - x0), high = static_cast<double>(y1 - y0);
        const auto word = [](std::uint64_t first, double words, float u) {
          return static_cast<std::uint32_t>(first + static_cast<std::uint64_t>(u * words));
        };
        test::expect_jacobian(
            fmt::format("{}, cell {} {}", n.name, i, j),
            [&](const V2& u) -> std::optional<test::Mapped> {
              const V3 d = m.sample(word(x0, wide, u.x), word(y0, high, u.y));
              return test::Mapped{V3d(d), double{m.at(d).pdf} / (wide * high * 0x1p-64)};
            },
            0x1p-23, 40);
        ++cells;
      }
    }
  }
  EXPECT_GT(cells, 50);
}

TEST(EnvironmentMap, ConstantMapIsSampledUniformly) {
  const EnvironmentMap m = map_of(SkyImage(16, 9, 3));
  RandomStream r(3);
  for (int i = 0; i < 1000; ++i) {
    const std::uint32_t x = r.bits(), y = r.bits();
    const EnvironmentMap::Light l = m.at(m.sample(x, y));
    // The probabilities of cells, of at least 1/128, are rounded to 2^-32; the rest is float32 rounding.
    EXPECT_NEAR(l.pdf * 4 * kPi, 1, 1e-5f);
    EXPECT_FLOAT_EQ(l.radiance.x, 3);
  }
  EXPECT_NEAR(m.flux(), 3 * 4 * kPiD, 1e-4);
}

// For a grey map, light over density is nearly constant away from the poles, so that sampling adds no noise.
TEST(EnvironmentMap, DensityFollowsTheLight) {
  SkyImage s(64, 32);
  std::mt19937 rng(5);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x) {
      const double v = 1 + rng() % 100;
      s.set(x, y, {v, v, v});
    }
  const EnvironmentMap m = map_of(s);
  RandomStream r(3);
  double sum = 0, square = 0;
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    const std::uint32_t x = r.bits(), y = r.bits();
    const EnvironmentMap::Light l = m.at(m.sample(x, y));
    ASSERT_GT(l.pdf, 0);
    const double v = l.radiance.x / l.pdf;
    sum += v;
    square += v * v;
  }
  const double mean = sum / kSamples, relative = (square / kSamples - mean * mean) / (mean * mean);
  // The variance is 1/8 in the two rows of cells next to the poles, which have 1/400 of all light.
  EXPECT_LT(relative, 1e-3);
}

TEST(EnvironmentMap, ExtremeRandomNumbersSamplePlacesWithLight) {
  for (const NamedSky& n : skies()) {
    const EnvironmentMap m = map_of(n.image);
    for (const std::uint32_t x : {0u, 1u, 0x80000000u, 0xffffffffu})
      for (const std::uint32_t y : {0u, 1u, 0x80000000u, 0xffffffffu}) {
        const V3 d = m.sample(x, y);
        EXPECT_NEAR(dot(d, d), 1, 1e-6f) << n.name;
        EXPECT_GT(m.at(d).pdf, 0) << n.name << " " << x << " " << y;
      }
  }
}

}  // namespace
}  // namespace ls::render

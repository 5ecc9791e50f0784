// Points at which glowing media are asked for their light.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/chi_square.h"
#include "tests/support/jacobian.h"
#include "tests/unit/render/grids.h"
#include "worker/render/math/sampler.h"
#include "worker/render/media/emission.h"

namespace ls::render {
namespace {

constexpr int kEmissionCells = 48, kEmissionSamples = 100000;
constexpr double kDepths[] = {0, 1e-16, 1e-6, .5, 4, 40};
constexpr float kSigmas[] = {1e-3f, .7f, 9.f};

// The density of truncated_exponential().
double truncated_exponential_pdf(double t, double k, double h) {
  return std::exp(-k * t) / (h * mean_transmittance(k * h));
}

// Counts of `sample` by cells of [0, length] against the density's integral by Simpson's rule in 64 parts.
template <class Pdf, class Sample>
void compare(test::ChiSquareTally& tally, const std::string& name, double length, double slack, Pdf pdf,
             Sample sample) {
  std::vector<double> expected(kEmissionCells), got(kEmissionCells, 0);
  const double width = length / kEmissionCells, h = width / 64;
  double inside = 0;
  for (int i = 0; i < kEmissionCells; ++i) {
    double sum = 0;
    for (int k = 0; k < 64; ++k) {
      const double a = i * width + k * h;
      sum += pdf(a) + 4 * pdf(a + h / 2) + pdf(a + h);
    }
    expected[static_cast<std::size_t>(i)] = sum * h / 6 * kEmissionSamples;
    inside += sum * h / 6;
  }
  EXPECT_NEAR(inside, 1, slack) << name << ": the density's integral";
  RandomStream r(43);
  for (int i = 0; i < kEmissionSamples; ++i) {
    const double t = sample(double{r.uniform()});
    ASSERT_TRUE(t >= 0 && t <= length * (1 + 1e-6)) << name;
    ++got[static_cast<std::size_t>(std::min(kEmissionCells - 1, static_cast<int>(t / width)))];
  }
  tally.expect(name, expected, got);
}

// A ray through a grid of voxels of width 1, from one side of it to the other.
const V3 kFrom(0, 1.3f, 2.1f), kAlong(1, .45f, .32f);
constexpr float kLength = 8;
std::vector<Grid> fields() {
  std::vector<Grid> all;
  all.push_back(unit_grid({9, 9, 9}, random_values({9, 9, 9}, 5)));
  all.push_back(unit_grid({9, 9, 9}, random_values({9, 9, 9}, 6, true)));
  all.push_back(voxel_grid({9, 9, 9}, random_values({9, 9, 9}, 7), kNearest, Wrap::clamp));
  return all;
}

TEST(EmissionPoints, FollowTheirDensity) {
  test::ChiSquareTally tally("sampling/glow_points");
  const double h = 2;
  for (const double depth : kDepths)
    compare(
        tally, fmt::format("as if of one density, depth {}", depth), h, 1e-4,
        [&](double t) { return truncated_exponential_pdf(t, depth / h, h); },
        [&](double u) { return truncated_exponential(u, depth / h, h); });
  for (const Grid& g : fields())
    for (const float s : kSigmas) {
      const auto depth = [&](double t) {
        return s * g.pass(kFrom, kAlong, 0, static_cast<float>(t)).integral;
      };
      const double absorbed = -std::expm1(-depth(kLength));
      compare(
          tally, fmt::format("where {} absorbs", s), kLength,
          // Simpson's rule misses a sixth of a step at each of about 16 jumps of at most s / absorbed.
          g.lookup() == Lookup::nearest ? 16 * kLength / kEmissionCells / 64 / 6 * s / absorbed : 1e-4,
          [&](double t) {
            const V3 p = kFrom + kAlong * static_cast<float>(t);
            return absorption_pdf(s, value_at(g, p), std::exp(-depth(t)), absorbed);
          },
          [&](double u) {
            const Passage p = g.pass(kFrom, kAlong, 0, kLength, absorption_depth(u, s, absorbed));
            return p.reached ? double{p.t} : double{kLength};
          });
    }
  tally.close();
}

TEST(EmissionPoints, DerivativeIsOneOverTheDensity) {
  const double h = 2;
  for (const double depth : kDepths)
    test::expect_slope(
        fmt::format("as if of one density, depth {}", depth),
        [&](double u) { return truncated_exponential(u, depth / h, h); },
        [&](double t) { return truncated_exponential_pdf(t, depth / h, h); }, 2 * 0x1p-52);
  // Within one voxel: at the planes between them the density has kinks, which differences see.
  const Grid g = unit_grid({2, 2, 2}, {.2f, .9f, .5f, .1f, .8f, .3f, .6f, 1});
  const V3 from(0, .1f, .2f), along(1, .5f, .4f);
  for (const float s : kSigmas) {
    const auto depth = [&](double t) { return s * g.pass(from, along, 0, static_cast<float>(t)).integral; };
    const double absorbed = -std::expm1(-depth(1));
    test::expect_slope(
        fmt::format("where {} absorbs", s),
        [&](double u) {
          const Passage p = g.pass(from, along, 0, 1, absorption_depth(u, s, absorbed));
          return p.reached ? double{p.t} : 1.;
        },
        [&](double t) {
          const V3 p = from + along * static_cast<float>(t);
          return absorption_pdf(s, value_at(g, p), std::exp(-depth(t)), absorbed);
        },
        // Newton's iteration ends within 1e-7 of the way, and points are float32's.
        1e-7 + 0x1p-24);
  }
}

}  // namespace
}  // namespace ls::render

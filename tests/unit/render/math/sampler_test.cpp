// The random numbers of a sample: they are functions of (seed, pixel, sample, vertex, purpose), form
// low-discrepancy points within a half of a pixel's samples, and are independent otherwise.
#include "worker/render/math/sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

namespace ls::render {
namespace {

std::array<std::uint32_t, 4> sobol4(std::uint32_t index, std::uint64_t key) {
  return sobol4_reversed(reverse_bits(index), key);
}

// True if these 2^k points form a (0, k, 2)-net in base 2: each elementary interval of area 2^-k contains one
// point.
bool is_net(const std::vector<std::array<std::uint32_t, 2>>& points, int k) {
  for (int a = 0; a <= k; ++a) {
    std::set<std::uint64_t> cells;
    for (const auto& p : points) {
      const std::uint64_t x = a ? p[0] >> (32 - a) : 0, y = k - a ? p[1] >> (32 - (k - a)) : 0;
      cells.insert((x << 32) | y);
    }
    if (cells.size() != points.size()) return false;
  }
  return true;
}

TEST(Sobol, PowerOfTwoPrefixesAreNetsInTwoDimensions) {
  for (const std::uint64_t key : {0ull, 1ull, 0x123456789abcdefull, ~0ull}) {
    for (int k = 0; k <= 10; ++k) {
      std::vector<std::array<std::uint32_t, 2>> points;
      for (std::uint32_t i = 0; i < (1u << k); ++i) {
        const auto p = sobol4(i, key);
        points.push_back({p[0], p[1]});
      }
      EXPECT_TRUE(is_net(points, k)) << "key " << key << ", 2^" << k;
    }
  }
}

TEST(Sobol, EveryDimensionIsStratified) {
  for (int k = 0; k <= 12; ++k) {
    for (std::size_t d = 0; d < 4; ++d) {
      std::set<std::uint32_t> cells;
      for (std::uint32_t i = 0; i < (1u << k); ++i) cells.insert(k ? sobol4(i, 77)[d] >> (32 - k) : 0);
      EXPECT_EQ(cells.size(), std::size_t{1} << k);
    }
  }
}

TEST(Sobol, AlignedBlocksAreNets) {
  // A round has a power of two of samples in each half
  for (const std::uint32_t start : {32u, 64u, 96u, 1024u}) {
    std::vector<std::array<std::uint32_t, 2>> points;
    for (std::uint32_t i = start; i < start + 32; ++i) {
      const auto p = sobol4(i, 5);
      points.push_back({p[0], p[1]});
    }
    EXPECT_TRUE(is_net(points, 5)) << start;
  }
}

TEST(SampleStream, HalvesAreEvenAndOddSamplesEachStratified) {
  for (const std::uint64_t half : {0u, 1u}) {
    std::vector<std::array<std::uint32_t, 2>> points;
    for (std::uint64_t i = 0; i < 64; ++i) {
      const Group g = SampleStream(3, 10, 20, 2 * i + half).group(1, Purpose::direction);
      points.push_back({g.bits[0], g.bits[1]});
    }
    EXPECT_TRUE(is_net(points, 6));
  }
}

// The mean product of two centred uniform numbers over n pairs has the standard deviation 1 / (12 sqrt n).
// The limit is 5 of them, which is exceeded with probability 6e-7.
constexpr int kPairs = 4096;
constexpr double kLimit = 5 / (12. * 64);
double correlation(const auto& a, const auto& b) {
  double sum = 0;
  for (std::uint64_t i = 0; i < kPairs; ++i) sum += (a(i) - .5) * (b(i) - .5);
  return sum / kPairs;
}

TEST(SampleStream, PixelsHalvesSeedsVerticesAndPurposesAreUncorrelated) {
  const auto at = [](std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint64_t half, int vertex,
                     Purpose purpose) {
    return [=](std::uint64_t i) {
      return double{SampleStream(seed, x, y, 2 * i + half).group(vertex, purpose).u(0)};
    };
  };
  const auto base = at(0, 5, 6, 0, 1, Purpose::light);

  EXPECT_LT(std::abs(correlation(base, at(1, 5, 6, 0, 1, Purpose::light))), kLimit);
  EXPECT_LT(std::abs(correlation(base, at(0, 6, 5, 0, 1, Purpose::light))), kLimit);
  EXPECT_LT(std::abs(correlation(base, at(0, 5, 7, 0, 1, Purpose::light))), kLimit);
  EXPECT_LT(std::abs(correlation(base, at(0, 5, 6, 1, 1, Purpose::light))), kLimit);
  EXPECT_LT(std::abs(correlation(base, at(0, 5, 6, 0, 2, Purpose::light))), kLimit);
  EXPECT_LT(std::abs(correlation(base, at(0, 5, 6, 0, 1, Purpose::direction))), kLimit);
  EXPECT_LT(std::abs(correlation(base, at(0, 5, 6, 0, SampleStream::kSobolVertices, Purpose::light))),
            kLimit);
}

TEST(SampleStream, MillionKeysOfAJobAreDistinct) {
  // The first words of trackers' streams are 64-bit hashes; among 2^20 of them a collision has the
  // probability 3e-8.
  std::vector<std::uint64_t> keys;
  for (std::uint32_t y = 0; y < 16; ++y)
    for (std::uint32_t x = 0; x < 16; ++x)
      for (std::uint64_t s = 0; s < 64; ++s)
        for (int v = 0; v < 16; ++v)
          for (const Purpose p :
               {Purpose::track_flight, Purpose::track_shadow, Purpose::track_segment, Purpose::hero})
            keys.push_back(SampleStream(1, x, y, s).stream(v, p).next());
  std::sort(keys.begin(), keys.end());
  EXPECT_EQ(std::adjacent_find(keys.begin(), keys.end()), keys.end());
}

TEST(SampleStream, SamplesBeyondTheSequenceAreDrawnByHash) {
  const std::uint64_t last = (std::uint64_t{1} << 33) - 1;
  EXPECT_NE(SampleStream(0, 0, 0, last).group(0, Purpose::camera).bits,
            SampleStream(0, 0, 0, last + 1).group(0, Purpose::camera).bits);
  EXPECT_NE(SampleStream(0, 0, 0, last + 1).group(0, Purpose::camera).bits,
            SampleStream(0, 0, 0, last + 3).group(0, Purpose::camera).bits);
}

TEST(Exponential, MatchesTheLogarithmAtBothEnds) {
  const auto check = [](std::uint32_t bits) {
    const double x = (static_cast<double>(~bits) + .5) * 0x1p-32, y = (bits + .5) * 0x1p-32;
    const double exact = x < .5 ? -std::log1p(-x) : -std::log(y);
    // The error is that of four roundings of 2^-24 and of a logarithm that is accurate to one ulp.
    ASSERT_NEAR(exponential(bits) / exact, 1, 6 * 0x1p-24) << bits;
  };
  EXPECT_FLOAT_EQ(exponential(0), 33 * std::log(2.f));
  for (std::uint64_t b = 0; b < (1ull << 32); b += 65521) check(static_cast<std::uint32_t>(b));
  for (int k = 0; k < 32; ++k) {
    for (std::uint32_t i = 0; i < 300; ++i) {
      check((1u << k) + i);
      check(~((1u << k) + i));
    }
  }
  for (std::uint32_t i = 0; i < 300; ++i) check(~i);
}

// A medium of optical depth `depth` scatters the share 1 - e^-depth of all flights: that share of the 2^32
// inputs, to within one input.
TEST(Exponential, ThinDepthAbsorbsItsOwnShare) {
  for (const double depth : {1e-9, 1e-8, 3e-8, 1e-7, 1e-6, 1e-3, .5, .7, 2.}) {
    std::uint64_t lo = 0, hi = 1ull << 32;  // bisection: depths decrease with the input
    while (lo < hi) {
      const std::uint64_t mid = (lo + hi) / 2;
      if (exponential(static_cast<std::uint32_t>(mid)) < static_cast<float>(depth)) {
        hi = mid;
      } else {
        lo = mid + 1;
      }
    }
    const double expected = -0x1p32 * std::expm1(-depth);
    EXPECT_NEAR(static_cast<double>((1ull << 32) - lo), expected, 1 + expected * 8 * 0x1p-24) << depth;
  }
}

TEST(UnitFloat, StaysBelowOne) {
  EXPECT_EQ(unit_float(0xffffffffu), 1 - 0x1p-24f);
  EXPECT_EQ(unit_float(0), 0.f);
}

TEST(RandomStream, HasTheMomentsOfItsDistributions) {
  RandomStream r(42);
  constexpr int kN = 1 << 20;
  double u = 0, e = 0;
  for (int i = 0; i < kN; ++i) u += r.uniform();
  for (int i = 0; i < kN; ++i) e += r.exponential();
  EXPECT_NEAR(u / kN, .5, 5 * std::sqrt(1. / 12 / kN));  // 5 standard deviations
  EXPECT_NEAR(e / kN, 1, 5 * std::sqrt(1. / kN));
}

TEST(RandomStream, ExponentialsResolveThinDepths) {
  RandomStream r(43);
  constexpr int kN = 1 << 22;
  int odd = 0, below = 0;
  for (int i = 0; i < kN; ++i) {
    const float e = r.exponential();
    ASSERT_GT(e, 0);
    if (e < 0x1p-13f) {
      ++below;
      // -log of a float32 near 1 would be a multiple of 2^-24, up to its second-order term.
      odd += std::abs(std::remainder(e, 0x1p-24f)) > .25f * 0x1p-24f;
    }
  }
  EXPECT_NEAR(below, kN * 0x1p-13, 5 * std::sqrt(kN * 0x1p-13));
  EXPECT_GT(odd, below / 4);  // on average half of the 512
}

}  // namespace
}  // namespace ls::render

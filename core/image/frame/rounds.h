// A round is a range of the sample indices of a tile. The first rounds have 2, 2, 4, 8, 16, 32 samples per
// pixel, all later ones 64. This division is fixed: it does not depend on the number of samples of a job, on
// cost or on timing. So two renders of a tile with the same samples add them in the same groups, and their
// sums in double are equal bit for bit.
#pragma once

#include <algorithm>
#include <cstdint>

namespace ls {

using RoundIndex = std::uint32_t;

// A half-open range of sample indices [s0, s1). Samples with even indices form half A, those with odd indices
// half B. Both ends are even, so that both halves have the same number of samples.
struct SampleRange {
  std::uint64_t s0 = 0, s1 = 0;
  std::uint64_t count() const { return s1 - s0; }
  bool operator==(const SampleRange&) const = default;
};

// Returns the range of samples of round k (counted from 0), not truncated.
constexpr SampleRange round_range(RoundIndex k) {
  if (k == 0) return {0, 2};
  if (k <= 5) return {std::uint64_t{1} << k, std::uint64_t{2} << k};
  return {64 * static_cast<std::uint64_t>(k - 5), 64 * static_cast<std::uint64_t>(k - 4)};
}

// Rounds a requested number of samples per pixel up to the number that is rendered: an even number, at least
// 2.
constexpr std::uint64_t even_spp(std::uint64_t spp) { return std::max<std::uint64_t>(2, spp + (spp & 1)); }

// Returns the number of rounds of an image with `spp` samples; its last round may be truncated.
constexpr RoundIndex round_count(std::uint64_t spp) {
  const std::uint64_t n = even_spp(spp);
  if (n <= 64) {
    RoundIndex k = 0;
    while (round_range(k).s1 < n) ++k;
    return k + 1;
  }
  return static_cast<RoundIndex>((n + 63) / 64 + 5);
}

// Returns the samples of round k of an image with `spp` samples: the full range, truncated at `spp`.
constexpr SampleRange cut_range(RoundIndex k, std::uint64_t spp) {
  SampleRange r = round_range(k);
  r.s1 = std::min(r.s1, even_spp(spp));
  return r;
}

static_assert(round_range(0) == SampleRange{0, 2} && round_range(1) == SampleRange{2, 4});
static_assert(round_range(2) == SampleRange{4, 8} && round_range(5) == SampleRange{32, 64});
static_assert(round_range(6) == SampleRange{64, 128} && round_range(7) == SampleRange{128, 192});
static_assert(round_count(2) == 1 && round_count(4) == 2 && round_count(5) == 3 && round_count(64) == 6);
static_assert(round_count(65) == 7 && round_count(128) == 7 && round_count(129) == 8);

}  // namespace ls

// Exponential back-off with jitter: the n-th wait, from n = 0, is between 50 % and 100 % of min(first * 2^n,
// `most`). The jitter keeps a thousand workers from reconnecting at the same instant; it is seeded, so that
// tests can predict it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>

#include "common/base/clock.h"

namespace ls::worker {

class Backoff {
 public:
  Backoff(Duration first, Duration most, std::uint64_t seed) : first_(first), most_(most), random_(seed) {}

  Duration next() {
    const Duration whole = std::min(first_ * (std::int64_t{1} << std::min(attempts_, 20)), most_);
    ++attempts_;
    const double part = 0.5 + 0.5 * static_cast<double>(random_() >> 11) * 0x1p-53;
    return std::chrono::duration_cast<Duration>(whole * part);
  }
  void reset() { attempts_ = 0; }

 private:
  Duration first_, most_;
  int attempts_ = 0;
  std::mt19937_64 random_;
};

}  // namespace ls::worker

// When a job with a target error stops. The decision to stop after round k is taken from rounds before k
// only: an image's own last round would bias the decision low. Image-wide and from complete checkpoints,
// hence the same on every farm.
#pragma once

#include <cstdint>

#include "common/image/rounds.h"
#include "coordinator/domain/limits.h"

namespace ls::coordinator {

// relMSE at `to_spp` predicted from that at `from_spp`: the error's variance falls as 1/n. Samplers that do
// better make the prediction high, so that the target is overshot, never undershot.
constexpr double predicted_relmse(double relmse, std::uint64_t from_spp, std::uint64_t to_spp) {
  return relmse * static_cast<double>(from_spp) / static_cast<double>(to_spp);
}

// With rounds 0..k-1 folded everywhere and `relmse` measured there: is k to be the last one? False for a NaN.
constexpr bool stop_after(RoundIndex k, double relmse, double target, std::uint64_t spp) {
  if (k == 0 || cut_range(k, spp).s1 < kMinSppBeforeStop) return false;
  return predicted_relmse(relmse, cut_range(k - 1, spp).s1, cut_range(k, spp).s1) <= target;
}

// The last round that may be folded while the first `complete` rounds are complete and no stop has been
// decided: whether round `complete` is the last one is known, so the next one is surely wanted; and nothing
// stops below the minimum.
constexpr RoundIndex fold_limit(RoundIndex complete) {
  constexpr RoundIndex kFirstStop = round_count(kMinSppBeforeStop) - 1;
  const RoundIndex surely_wanted = complete == 0 ? 0 : complete + 1;
  return surely_wanted > kFirstStop ? surely_wanted : kFirstStop;
}

}  // namespace ls::coordinator

#include "coordinator/assemble/verify.h"

#include <fmt/format.h>

#include <cmath>

#include "util/protocol/limits.h"

namespace ls::coordinator {
namespace {

BadResult bad(const UnitResult& result, Errc code, std::string_view why) {
  return {{code, fmt::format("the result of tile {} round {} was refused: {}", result.unit.tile,
                             result.unit.round, why)}};
}

// True if the headers `got` and `expected` are equal, except for the end of the sample range: both sample
// ranges begin where round `round` begins, but may be truncated at different samples.
bool same_round(const UnitHeader& got, const UnitHeader& expected, RoundIndex round) {
  UnitHeader other = got;
  other.samples = expected.samples;
  const SampleRange full = round_range(round);
  return other == expected && got.samples.s0 == full.s0 && got.samples.s1 > full.s0 &&
         got.samples.s1 <= full.s1;
}

}  // namespace

Verified verify_result(const UnitResult& result, const UnitHeader& expected, FrameSize frame, AovSet aovs) {
  if (result.exr.size() > ls::limits::kPartialBytes)
    return bad(
        result, Errc::resource_exhausted,
        fmt::format("{} bytes are more than the {} allowed", result.exr.size(), ls::limits::kPartialBytes));
  if (!std::isfinite(result.cpu_seconds) || result.cpu_seconds < 0)
    return bad(result, Errc::invalid_argument, "its CPU time is not a number of seconds");
  if (const auto sound = check_health(result.health, expected.tile, round_range(result.unit.round)); !sound)
    return bad(result, sound.error().code, sound.error().message);
  auto partial = decode_partial(result.exr, expected, frame, aovs);
  if (!partial) {
    const auto own = decode_partial_file(result.exr);
    if (own && own->frame == frame && own->partial.aovs == aovs &&
        same_round(own->partial.header, expected, result.unit.round) &&
        unit_digest(own->partial) == result.digest)
      return OtherRange{own->partial.header.samples};
    return bad(result, partial.error().code, partial.error().message);
  }
  if (const Digest digest = unit_digest(*partial); digest != result.digest)
    return bad(result, Errc::invalid_argument,
               fmt::format("its digest is {}, not {} as it says; the worker's memory or network may be bad",
                           digest.hex(), result.digest.hex()));
  return std::move(*partial);
}

}  // namespace ls::coordinator

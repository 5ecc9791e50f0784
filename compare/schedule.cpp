#include "compare/schedule.h"

#include <algorithm>

namespace ls::race {
namespace {

// A round that was cut to the time left is not rendered if it would add less than 1 / kLeastShare of the
// existing samples.
constexpr std::uint64_t kLeastShare = 16;

}  // namespace

std::optional<std::size_t> next_turn(std::span<const Turn> turns, std::size_t lap) {
  std::optional<std::size_t> best;
  const auto middle = [&](std::size_t i) { return turns[i].used + turns[i].expected / 2; };
  for (std::size_t k = 0; k < turns.size(); ++k) {
    const std::size_t i = (k + lap) % turns.size();
    if (turns[i].done) continue;
    if (!best || middle(i) < middle(*best)) best = i;
  }
  return best;
}

std::optional<SampleRange> next_range(RoundIndex k, double seconds_per_sample, double seconds_left,
                                      std::uint64_t most_spp) {
  SampleRange range = round_range(k);
  const std::uint64_t most = even_spp(most_spp);
  if (range.s0 >= most) return std::nullopt;
  range.s1 = std::min(range.s1, most);
  if (k == 0) return range;
  if (!(seconds_left > 0)) return std::nullopt;
  const double fits = seconds_left / seconds_per_sample;
  if (fits >= static_cast<double>(range.count())) return range;
  const auto whole = static_cast<std::uint64_t>(fits);
  const std::uint64_t count = whole - whole % 2;
  if (count < 2 || count * kLeastShare < range.s0) return std::nullopt;
  range.s1 = range.s0 + count;
  return range;
}

}  // namespace ls::race

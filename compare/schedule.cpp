#include "compare/schedule.h"

#include <algorithm>
#include <cmath>

namespace ls::race {
namespace {

// If a cut round would add less than 1 / kLeastShare of the existing samples, it is not rendered.
constexpr std::uint64_t kLeastShare = 16;
constexpr std::uint64_t kGrowth = 4;
// A run that fills at least this share of the time is the last: a next run could not be much longer.
constexpr double kFull = .7;
// No run is planned for more than this share of the time, because costs are estimates.
constexpr double kMostOfTime = 1.15;
constexpr std::size_t kMostRuns = 12;  // in case a program's cost does not grow with its samples

}  // namespace

std::string to_string(RaceClock clock) { return clock == RaceClock::wall ? "wall" : "cpu"; }

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

std::optional<NextRun> next_run(std::span<const PastRun> past, std::uint64_t first, double time,
                                std::uint64_t most_spp) {
  if (past.empty()) return NextRun{std::min(first, most_spp), 0};
  const PastRun& last = past.back();
  if (last.seconds >= kFull * time || last.spp >= most_spp || past.size() >= kMostRuns) return std::nullopt;
  double per_sample = last.seconds / static_cast<double>(last.spp), start = 0;
  if (past.size() > 1) {
    const PastRun& before = past[past.size() - 2];
    const double slope = (last.seconds - before.seconds) / static_cast<double>(last.spp - before.spp);
    if (slope > 0) per_sample = std::min(slope, per_sample);
    start = std::max(0., last.seconds - per_sample * static_cast<double>(last.spp));
  }
  const auto cost = [&](std::uint64_t spp) { return start + per_sample * static_cast<double>(spp); };
  const std::uint64_t grown = std::min(kGrowth * last.spp, most_spp);
  if (cost(grown) <= kFull * time) return NextRun{grown, cost(grown)};
  // Otherwise the next run has as many samples as fill the time. If these are no more than the samples of the
  // last run, there is no further run.
  const double filling = (time - start) / per_sample;
  const auto spp = std::min<std::uint64_t>(most_spp, static_cast<std::uint64_t>(std::max(0., filling)));
  if (spp <= last.spp || cost(spp) > kMostOfTime * time) return std::nullopt;
  return NextRun{spp, cost(spp)};
}

}  // namespace ls::race

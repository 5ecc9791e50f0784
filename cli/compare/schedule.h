// Who is next in a race, and how far. Pure: times are told, no clock is read.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/image/rounds.h"

namespace ls::race {

// The clock that a race is timed by. `cpu`: CPU seconds of all threads over the number of threads, which is
// what a quiet machine would show on its wall; it also holds on a busy one, as far as caches and memory are
// not shared with others.
enum class RaceClock { wall, cpu };
std::string to_string(RaceClock clock);

// What something cost: wall seconds, and CPU seconds of all its threads.
struct Cost {
  double wall = 0, cpu = 0;
  double seconds(RaceClock clock, int threads) const {
    return clock == RaceClock::wall ? wall : cpu / threads;
  }
  Cost operator+(const Cost& o) const { return {wall + o.wall, cpu + o.cpu}; }
};

// One that takes part, before its next turn.
struct Turn {
  bool done = false;
  double used = 0;      // seconds of the race that it has behind it
  double expected = 0;  // that the next turn will take; 0: not known
};
// Whose turn it is: the one whose next turn has its middle earliest in the race, so that short turns
// alternate, and a single long one falls into the middle of the others'. Of equals the first from `lap` on,
// cyclically: nobody always goes first. Nothing: all are done.
std::optional<std::size_t> next_turn(std::span<const Turn> turns, std::size_t lap);

// The samples that a render goes on with: round `k` as a whole, or cut to what fits into `seconds_left` at
// `seconds_per_sample` (per sample per pixel; 0: not known yet, only before round 0) and below `most_spp` in
// all. Nothing: it ends here, for nothing fits, or so little that it would add no more than a sixteenth.
std::optional<SampleRange> next_range(RoundIndex k, double seconds_per_sample, double seconds_left,
                                      std::uint64_t most_spp);

// Samples of the next run of a program that starts from nothing each time, given its runs so far, ascending:
// the first has `first`, each next four times as many, and the last what fills the time. Its time is a
// start and so much a sample (a line through the last two runs). Nothing: it has had its last run.
struct PastRun {
  std::uint64_t spp = 0;
  double seconds = 0;
};
struct NextRun {
  std::uint64_t spp = 0;
  double expected = 0;  // seconds; 0: not known
};
std::optional<NextRun> next_run(std::span<const PastRun> past, std::uint64_t first, double time,
                                std::uint64_t most_spp);

}  // namespace ls::race

// Decides which racer runs next, and for how long. Pure: times are arguments, no clock is read.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/image/frame/rounds.h"

namespace ls::race {

// The clock of a race. `cpu`: CPU seconds of all threads divided by the number of threads, which is what wall
// time would be on a quiet machine; it also works on a busy one, except for shared caches and memory.
enum class RaceClock { wall, cpu };
std::string to_string(RaceClock clock);

// A cost: wall seconds, and CPU seconds of all threads.
struct Cost {
  double wall = 0, cpu = 0;
  double seconds(RaceClock clock, int threads) const {
    return clock == RaceClock::wall ? wall : cpu / threads;
  }
  Cost operator+(const Cost& o) const { return {wall + o.wall, cpu + o.cpu}; }
};

// A racer before its next turn.
struct Turn {
  bool done = false;
  double used = 0;      // seconds of the race used so far
  double expected = 0;  // seconds expected for the next turn; 0: unknown
};
// The racer whose next turn has its middle earliest in the race, so that short turns alternate, and a single
// long one falls into the middle of the others'. Among equals the first from `lap` on, cyclically, so that
// none always goes first. nullopt: all are done.
std::optional<std::size_t> next_turn(std::span<const Turn> turns, std::size_t lap);

// The samples with which a render continues: round `k` as a whole, or cut to what fits into `seconds_left` at
// `seconds_per_sample` (per sample per pixel; 0: unknown, only before round 0) and below `most_spp` in total.
// nullopt: it ends here, because nothing fits, or no more than a sixteenth would be added.
std::optional<SampleRange> next_range(RoundIndex k, double seconds_per_sample, double seconds_left,
                                      std::uint64_t most_spp);

// Samples of the next run of a program that starts anew each time, given its runs so far, ascending: the
// first has `first`, each next four times as many, and the last as many as fill the time. Its time is
// modelled as a constant plus a cost per sample (a line through the last two runs). nullopt: it has had its
// last run.
struct PastRun {
  std::uint64_t spp = 0;
  double seconds = 0;
};
struct NextRun {
  std::uint64_t spp = 0;
  double expected = 0;  // seconds; 0: unknown
};
std::optional<NextRun> next_run(std::span<const PastRun> past, std::uint64_t first, double time,
                                std::uint64_t most_spp);

}  // namespace ls::race

// Decides which racer (an integrator with one seed) runs next, and for how long. The functions are pure:
// times are arguments, no clock is read.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "common/image/frame/rounds.h"

namespace ls::race {

// The clock by which a race measures time. `wall` is wall time. `cpu` is the CPU time of all threads divided
// by the number of threads: on a quiet machine this equals wall time, and other programs on a busy machine
// change it only through shared caches and memory.
enum class RaceClock { wall, cpu };

// A cost: wall seconds, and CPU seconds of all threads.
struct Cost {
  double wall = 0, cpu = 0;
  double seconds(RaceClock clock, int threads) const {
    return clock == RaceClock::wall ? wall : cpu / threads;
  }
  Cost operator+(const Cost& o) const { return {wall + o.wall, cpu + o.cpu}; }
};

// The state of a racer before its next turn.
struct Turn {
  bool done = false;
  double used = 0;      // seconds of the race used so far
  double expected = 0;  // seconds expected for the next turn; 0: unknown
};
// Returns the index of the racer that runs next: the one with the smallest used + expected / 2, the middle of
// its next turn in its own time. So racers take turns and use equal times. If several have the same middle,
// the first one from index `lap` on, cyclically, runs, so that no racer always goes first. nullopt: all are
// done.
std::optional<std::size_t> next_turn(std::span<const Turn> turns, std::size_t lap);

// Returns the samples that a render adds next: those of round `k` (a fixed range of samples), cut to what
// fits into `seconds_left` at a cost of `seconds_per_sample`, and to `most_spp` samples per pixel in total.
// `seconds_per_sample` is the time for one more sample in every pixel; 0: unknown, which is allowed only for
// round 0. nullopt: the render ends here, because no samples fit, or a cut round would add less than a
// sixteenth of the existing samples.
std::optional<SampleRange> next_range(RoundIndex k, double seconds_per_sample, double seconds_left,
                                      std::uint64_t most_spp);

}  // namespace ls::race

// The racers of a race, each an integrator on one scene with one seed, and who runs next, and for how long.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/image/error/error_estimate.h"
#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"

namespace ls::render {
class World;
}

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

inline constexpr std::uint64_t kNoLimit = UINT64_C(1) << 31;  // samples per pixel that no race reaches

// The conditions of a race, the same for all racers.
struct Conditions {
  double time = 10;  // seconds, on the race's clock
  RaceClock clock = RaceClock::wall;
  int threads = 1;
  std::uint64_t most_spp = kNoLimit;
  FrameSize size;
  double seconds(const Cost& cost) const { return cost.seconds(clock, threads); }
};

// One image of a racer at some point of the race: the racer's total cost up to then, without loading, and the
// image's file, written by keep().
struct Checkpoint {
  double spp = 0;
  Cost cost;
  bool last = false;    // true for the racer's last image
  ImageError estimate;  // the image's own error estimate
  std::filesystem::path picture;
};

// The state of a racer before its next turn.
struct Turn {
  bool done = false;
  double used = 0;      // seconds of the race used so far
  double expected = 0;  // seconds expected for the next turn; 0: unknown
};

class Racer {
 public:
  virtual ~Racer() = default;
  virtual Turn next() const = 0;
  // Runs the racer for one turn. An error ends its participation. failed_precondition: `stop` was set.
  virtual Result<void> take_turn(const std::atomic<bool>& stop) = 0;
  virtual std::vector<Checkpoint> checkpoints() const = 0;
  // Returns the files, written by keep(), with the means of the two halves of the samples of the last image.
  virtual std::vector<std::filesystem::path> halves() const = 0;
  virtual std::vector<std::string> notes() const { return {}; }  // remarks for the report
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

// An integrator in a race: renders the rounds of a job as usual and folds them (adds them to the image), on
// threads of this process. Its time includes rendering, folding and estimating the error, but not loading the
// scene.
struct RenderEntry {
  std::shared_ptr<const render::World> world;
  TileGrid grid;
  std::string name;  // for file names: the lane's name, unique in `folder`
  std::filesystem::path folder;
};
// Makes the racer. It also renders a few samples that are not counted, to warm up memory.
std::unique_ptr<Racer> make_render_racer(RenderEntry entry, const Conditions& conditions);

}  // namespace ls::race

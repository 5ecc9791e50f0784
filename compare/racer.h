// The racers of a race: each renders one scene with one integrator and one seed. They take turns.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/image/error/error_estimate.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"

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
  double time = 10;  // time of each racer, in seconds on the race's clock
  RaceClock clock = RaceClock::wall;
  int threads = 1;
  std::uint64_t most_spp = kNoLimit;
  FrameSize size;
  double seconds(const Cost& cost) const { return cost.seconds(clock, threads); }
};

// An image that a racer had at some point of the race. `cost` is all that the racer had used by then, except
// for loading the scene. `picture` is the file of the image, written by keep() (picture.h).
struct Checkpoint {
  double spp = 0;
  Cost cost;
  bool last = false;    // true for the racer's last image
  ImageError estimate;  // the error, as the render itself estimates it
  std::filesystem::path picture;
};

// The state of a racer before its next turn. Times are in seconds on the race's clock.
struct Turn {
  bool done = false;
  double used = 0;      // time that the racer has used so far
  double expected = 0;  // expected duration of the next turn; 0: unknown
};

class Racer {
 public:
  virtual ~Racer() = default;
  virtual Turn next() const = 0;
  // Lets the racer render for one turn. failed_precondition: `stop` was set. After any other error the racer
  // gets no more turns.
  virtual Result<void> take_turn(const std::atomic<bool>& stop) = 0;
  virtual std::vector<Checkpoint> checkpoints() const = 0;
  // Returns two files, written by keep(): the means of the even samples (half A) and of the odd samples (half
  // B) of the last image.
  virtual std::vector<std::filesystem::path> halves() const = 0;
  virtual std::vector<std::string> notes() const { return {}; }  // remarks for the report
};

// Returns the samples that a render adds next: those of round `k` (a fixed range of samples), shortened to
// what fits into `seconds_left`, and to `most_spp` samples per pixel in total. `seconds_per_sample` is the
// time for one more sample in every pixel; 0: unknown, which is allowed only for round 0, since that round is
// rendered in any case. nullopt: the render ends here, because no samples fit, or those that fit are less
// than a sixteenth of the samples rendered so far.
std::optional<SampleRange> next_range(RoundIndex k, double seconds_per_sample, double seconds_left,
                                      std::uint64_t most_spp);

// The inputs of make_render_racer(): the loaded scene with its integrator, the tiles of the image, and where
// to write files.
struct RenderEntry {
  std::shared_ptr<const render::World> world;
  TileGrid grid;
  std::string name;  // the lane's name; begins the names of its files, so it is unique in `folder`
  std::filesystem::path folder;
};
// Makes a racer that renders the rounds of a job as usual and folds them (adds them to the image), on threads
// of this process. Its time includes rendering, folding and estimating the error, but not loading the scene.
// Before the race it renders a few samples that are not counted, to warm up memory.
std::unique_ptr<Racer> make_render_racer(RenderEntry entry, const Conditions& conditions);

}  // namespace ls::race

// A participant in a race: an integrator on one scene with one seed.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "common/image/error/error_estimate.h"
#include "common/image/frame/frame.h"
#include "compare/schedule.h"

namespace ls::race {

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

}  // namespace ls::race

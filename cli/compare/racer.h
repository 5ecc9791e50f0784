// One that takes part in a race: an integrator of ours or another program, on one scene with one seed.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/compare/schedule.h"
#include "common/base/clock.h"
#include "common/base/error.h"
#include "common/image/error_estimate.h"
#include "common/image/frame.h"

namespace ls::race {

inline constexpr std::uint64_t kNoLimit = UINT64_C(1) << 31;  // samples a pixel that no race comes to

// The conditions, the same for everybody.
struct Conditions {
  double time = 10;  // seconds, on the race's clock
  RaceClock clock = RaceClock::wall;
  int threads = 1;
  std::uint64_t most_spp = kNoLimit;
  FrameSize size;
  double seconds(const Cost& cost) const { return cost.seconds(clock, threads); }
};

// One picture: what it cost from nothing, load left out, and where it lies (see keep()).
struct Checkpoint {
  double spp = 0;
  Cost cost;
  bool last = false;                   // as far as this racer came
  std::optional<ImageError> estimate;  // by the picture itself; ours only
  std::filesystem::path picture;
};

class Racer {
 public:
  virtual ~Racer() = default;
  virtual Turn next() const = 0;
  // An error ends this racer's race. failed_precondition after `stop`: it was told to.
  virtual Result<void> take_turn(const std::atomic<bool>& stop) = 0;
  virtual std::vector<Checkpoint> checkpoints() const = 0;
  // The two halves' means of the last picture (see keep()); ours only.
  virtual std::vector<std::filesystem::path> halves() const { return {}; }
  virtual std::vector<std::string> notes() const { return {}; }  // what must be known besides, in words
};

}  // namespace ls::race

// A participant in a race: one of our integrators or an external program, on one scene with one seed.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "common/image/error/error_estimate.h"
#include "common/image/frame/frame.h"
#include "compare/schedule.h"

namespace ls::race {

inline constexpr std::uint64_t kNoLimit = UINT64_C(1) << 31;  // samples per pixel that no race reaches

// The conditions, the same for all racers.
struct Conditions {
  double time = 10;  // seconds, on the race's clock
  RaceClock clock = RaceClock::wall;
  int threads = 1;
  std::uint64_t most_spp = kNoLimit;
  FrameSize size;
  double seconds(const Cost& cost) const { return cost.seconds(clock, threads); }
};

// One image: its total cost without loading, and its file (see keep()).
struct Checkpoint {
  double spp = 0;
  Cost cost;
  bool last = false;                   // the racer's last one
  std::optional<ImageError> estimate;  // the image's own error estimate; ours only
  std::filesystem::path picture;
};

class Racer {
 public:
  virtual ~Racer() = default;
  virtual Turn next() const = 0;
  // An error ends this racer's participation. failed_precondition after `stop`.
  virtual Result<void> take_turn(const std::atomic<bool>& stop) = 0;
  virtual std::vector<Checkpoint> checkpoints() const = 0;
  // The half means of the last image (see keep()); ours only.
  virtual std::vector<std::filesystem::path> halves() const { return {}; }
  virtual std::vector<std::string> notes() const { return {}; }  // remarks for the report
};

}  // namespace ls::race

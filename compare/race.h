// A race compares integrators at equal cost on one scene. An entrant is an integrator that takes part. It
// renders the scene once per seed; each of these runs is a lane. The lanes of one seed run in turns
// (racer.h). At the end the errors of all images are measured.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compare/picture.h"
#include "compare/racer.h"

namespace ls::race {

struct Entrant {
  std::string name;
  // True if the integrator renders all features of the scene, so that its images can serve as references.
  bool whole = false;
};

struct Lane {
  std::size_t entrant = 0, seed = 0;  // index of the entrant, and of the seed, from 0
  std::vector<Checkpoint> checkpoints;
  std::vector<std::filesystem::path> halves;
  std::vector<std::string> notes;
};
struct Failure {
  std::size_t entrant = 0;
  std::string why;
};
struct Lanes {
  std::vector<Lane> lanes;        // ordered by seed, then by entrant
  std::vector<Failure> failures;  // the entrants that failed; they have no lanes
};

// Creates the racer that renders one lane: an entrant with a seed (both are indices). The scene is already
// loaded when it returns.
using MakeRacer = std::function<Result<std::unique_ptr<Racer>>(std::size_t entrant, std::size_t seed)>;
// Called before each turn of a lane; `used` is the time that the lane has used so far, in seconds on the
// race's clock.
using Progress = std::function<void(std::size_t seed, std::size_t entrant, double used)>;

// Runs all lanes. The seeds run one after the other. The entrants of one seed run in turns (next_turn() in
// racer.h), and each seed begins with another entrant. Returns an error only if `stop` was set. If a racer
// fails, its entrant leaves the race and all its lanes are removed; the others go on.
Result<Lanes> run_lanes(std::size_t entrants, std::size_t seeds, const MakeRacer& make,
                        const std::atomic<bool>& stop, const Progress& progress);

struct JudgedPoint {
  double spp = 0;
  Cost cost;
  double seconds = 0;  // the cost so far, in seconds on the race's clock
  bool last = false;
  std::optional<ImageError> estimate;
  // Errors against the reference. A value that is not positive means that the noise of the reference hides
  // the error.
  double mse = 0, relmse = 0;
};
struct JudgedLane {
  std::size_t entrant = 0, seed = 0;
  std::vector<JudgedPoint> points;
};
struct Race {
  std::string scene;
  Conditions conditions;
  std::vector<Entrant> entrants;
  std::vector<JudgedLane> lanes;
  std::vector<Failure> failures;
  std::string reference;       // the reference used, in words
  double reference_noise = 0;  // relMSE of the mean of the two reference images; 0 if there is only one
  std::vector<std::string> notes;
};

// Checks that judge() can work without a reference from the user. invalid_argument: no entrant renders all
// features of the scene, or there are fewer than two seeds.
Result<void> judges_itself(const Race& race, std::size_t seeds);

// Measures the errors of all images against `reference`. Without it, each seed s gets its own reference. It
// is made from final images of one entrant: of those that render all features of the scene, the one with the
// smallest estimated error. Its images of all seeds but s give the two images of the reference: the mean of
// their halves A (even samples), and the mean of their halves B (odd samples). These two are independent of
// the images of seed s and of each other. invalid_argument: there is no such entrant, or only one seed.
Result<void> judge(Race& race, const Lanes& lanes, std::size_t seeds,
                   const std::optional<Reference>& reference);

}  // namespace ls::race

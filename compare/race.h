// A race on one scene. An entrant is an integrator that takes part. It runs once per seed; each such run is a
// lane. Lanes run in turns, then their images are judged.
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
  // True if it renders everything that the scene has, so that its images can serve as references.
  bool whole = false;
};

struct Lane {
  std::size_t entrant = 0, seed = 0;  // indices
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
  std::vector<Failure> failures;  // an entrant that failed has no lanes
};

// Creates the racer of an entrant for one seed (both are indices), with the scene loaded.
using MakeRacer = std::function<Result<std::unique_ptr<Racer>>(std::size_t entrant, std::size_t seed)>;
// Called before each turn of a lane; `used` is the time that the lane has used so far, in seconds on the
// race's clock.
using Progress = std::function<void(std::size_t seed, std::size_t entrant, double used)>;

// Runs the seeds one after the other. For one seed the entrants run in turns (schedule.h), beginning with
// another entrant for each seed. Returns an error only because of `stop`; an error of a racer only removes
// its entrant from the race.
Result<Lanes> run_lanes(std::size_t entrants, std::size_t seeds, const MakeRacer& make,
                        const std::atomic<bool>& stop, const Progress& progress);

struct JudgedPoint {
  double spp = 0;
  Cost cost;
  double seconds = 0;  // on the race's clock
  bool last = false;
  std::optional<ImageError> estimate;
  double mse = 0, relmse = 0;  // errors against the reference; 0 or less: hidden by the reference's noise
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
  double reference_noise = 0;  // relMSE of the mean of two references
  std::vector<std::string> notes;
};

// Checks that judge() can work without a reference. invalid_argument: no entrant renders everything that
// the scene has, or there are not enough seeds.
Result<void> judges_itself(const Race& race, std::size_t seeds);

// Measures the errors of all images against `reference`. Without a reference, it makes one for each seed s
// from the final images that the best entrant rendered with all other seeds: one image from the means of
// their halves A (even samples), another from those of their halves B (odd samples). These two are
// independent of the images of seed s and of each other. invalid_argument: there is no such entrant, or only
// one seed.
Result<void> judge(Race& race, const Lanes& lanes, std::size_t seeds,
                   const std::optional<Reference>& reference);

}  // namespace ls::race

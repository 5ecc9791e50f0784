// A race on one scene: lanes (a racer with a seed) run in turns, then their images are judged.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "compare/picture.h"
#include "compare/racer.h"

namespace ls::race {

struct Entrant {
  std::string name;
  bool ours = false;
  // It renders everything that the scene has, so its images can serve as references.
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

// Creates the racer of an entrant for the seed with this index, loaded and ready.
using MakeRacer = std::function<Result<std::unique_ptr<Racer>>(std::size_t entrant, std::size_t seed)>;
// Called before each turn.
using Progress = std::function<void(std::size_t seed, std::size_t entrant, double used)>;

// Runs seed after seed; the entrants of one seed in turns (schedule.h), each time beginning with another.
// Returns an error only because of `stop`; a racer's own error only removes its entrant.
Result<Lanes> run_lanes(std::size_t entrants, std::size_t seeds, const MakeRacer& make,
                        const std::atomic<bool>& stop, const Progress& progress);

struct JudgedPoint {
  double spp = 0;
  Cost cost;
  double seconds = 0;  // on the race's clock
  bool last = false;
  std::optional<ImageError> estimate;
  double mse = 0, relmse = 0;  // against the reference; not above 0: hidden by the reference's noise
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

// invalid_argument unless there is such an entrant of ours, and enough seeds, that judge() needs no
// reference.
Result<void> judges_itself(const Race& race, std::size_t seeds);

// Measures all images against `reference`. Without one, uses the images of the other seeds by the best of our
// own entrants: for seed s the means of the halves A and of the halves B of its final images of all seeds but
// s, which are independent of the image and of each other. invalid_argument: there is no such entrant, or
// only one seed.
Result<void> judge(Race& race, const Lanes& lanes, std::size_t seeds,
                   const std::optional<Reference>& reference);

}  // namespace ls::race

// A race on one scene: lanes (a racer with a seed) in turns, and then the judgement of their pictures.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cli/compare/picture.h"
#include "cli/compare/racer.h"

namespace ls::race {

struct Entrant {
  std::string name;
  bool ours = false;
  // It sees all that the scene has: its pictures may stand for the right answer.
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
  std::vector<Lane> lanes;        // by seed, then by entrant
  std::vector<Failure> failures;  // of an entrant that failed there are no lanes
};

// Makes the racer of an entrant for the seed of this index, loaded and ready.
using MakeRacer = std::function<Result<std::unique_ptr<Racer>>(std::size_t entrant, std::size_t seed)>;
// Told before each turn.
using Progress = std::function<void(std::size_t seed, std::size_t entrant, double used)>;

// Seed after seed; the entrants of one seed in turns (schedule.h), each time beginning with another. The
// error is that of `stop`; a racer's own trouble ends its entrant only.
Result<Lanes> run_lanes(std::size_t entrants, std::size_t seeds, const MakeRacer& make,
                        const std::atomic<bool>& stop, const Progress& progress);

struct JudgedPoint {
  double spp = 0;
  Cost cost;
  double seconds = 0;  // on the race's clock
  bool last = false;
  std::optional<ImageError> estimate;
  double mse = 0, relmse = 0;  // the true ones; not above 0: less than the reference's noise lets one see
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
  std::string reference;       // what the pictures were measured against, in words
  double reference_noise = 0;  // its own relMSE, of two references' mean
  std::vector<std::string> notes;
};

// Whether there is such an entrant of ours, and seeds enough, that judge() needs no reference:
// invalid_argument otherwise.
Result<void> judges_itself(const Race& race, std::size_t seeds);

// Measures all pictures against `reference`; without one against the other seeds' pictures by the best of our
// own entrants: of seed s against the means of the halves A and of the halves B of its final pictures of all
// seeds but s, which are independent of the picture and of each other. invalid_argument: there is no such
// entrant, or one seed only.
Result<void> judge(Race& race, const Lanes& lanes, std::size_t seeds,
                   const std::optional<Reference>& reference);

}  // namespace ls::race

#include "compare/race.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

namespace ls::race {
namespace {

// The part of a race that has one seed. run() lets all entrants (integrators) render with this seed, in
// turns, to the end. It adds a lane (the run of an entrant with a seed) for each entrant that finishes, and a
// failure for each that fails.
class Heat {
 public:
  Heat(std::size_t seed, Lanes& out) : seed_(seed), out_(out) {}

  Result<void> run(std::size_t entrants, const std::set<std::size_t>& out_of_it, const MakeRacer& make,
                   const std::atomic<bool>& stop, const Progress& progress) {
    for (std::size_t e = 0; e < entrants; ++e) {
      if (out_of_it.contains(e)) continue;
      auto racer = make(e, seed_);
      if (racer)
        running_.push_back({e, std::move(*racer)});
      else
        out_.failures.push_back({e, racer.error().message});
    }
    for (std::size_t lap = seed_;; ++lap) {
      if (stop) return fail(Errc::failed_precondition, "told to stop");
      std::vector<Turn> turns;
      for (const auto& r : running_) turns.push_back(r.racer->next());
      const auto next = next_turn(turns, lap);
      if (!next) break;
      progress(seed_, running_[*next].entrant, turns[*next].used);
      if (auto ok = take_turn(*next, stop); !ok) return ok;
    }
    for (const auto& r : running_)
      out_.lanes.push_back({r.entrant, seed_, r.racer->checkpoints(), r.racer->halves(), r.racer->notes()});
    return {};
  }

 private:
  struct Running {
    std::size_t entrant;
    std::unique_ptr<Racer> racer;
  };
  Result<void> take_turn(std::size_t i, const std::atomic<bool>& stop) {
    auto ok = running_[i].racer->take_turn(stop);
    if (ok) return ok;
    if (stop) return tl::unexpected(ok.error());
    out_.failures.push_back({running_[i].entrant, ok.error().message});
    running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(i));
    return {};
  }

  const std::size_t seed_;
  Lanes& out_;
  std::vector<Running> running_;
};

// Computes the weighted mean of images.
class Sum {
 public:
  void add(const Pixels& pixels, double weight) {
    if (sums_.empty()) sums_.resize(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) sums_[i] += weight * static_cast<double>(pixels[i]);
    weights_ += weight;
  }
  Pixels mean() const {
    Pixels out(sums_.size());
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<float>(sums_[i] / weights_);
    return out;
  }

 private:
  std::vector<double> sums_;
  double weights_ = 0;
};

// Returns the entrant whose final images have the smallest estimated relMSE, summed over the seeds. Only
// entrants that render all features of the scene and have an image for every seed are considered. nullopt:
// there is none.
std::optional<std::size_t> best_of(const Race& race, const Lanes& lanes, std::size_t seeds) {
  std::optional<std::size_t> best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t e = 0; e < race.entrants.size(); ++e) {
    if (!race.entrants[e].whole) continue;
    double error = 0;
    std::size_t found = 0;
    for (const Lane& lane : lanes.lanes)
      if (lane.entrant == e && !lane.checkpoints.empty())
        error += lane.checkpoints.back().estimate.relmse, ++found;
    if (found == seeds && error < least) best = e, least = error;
  }
  return best;
}

Result<Reference> without(std::size_t seed, std::size_t entrant, const Lanes& lanes, FrameSize size) {
  Sum first, second;
  for (const Lane& lane : lanes.lanes) {
    if (lane.entrant != entrant || lane.seed == seed) continue;
    const auto a = kept(lane.halves[0], size), b = kept(lane.halves[1], size);
    if (!a) return tl::unexpected(a.error());
    if (!b) return tl::unexpected(b.error());
    first.add(*a, lane.checkpoints.back().spp);
    second.add(*b, lane.checkpoints.back().spp);
  }
  return Reference{first.mean(), second.mean()};
}

Result<JudgedLane> judged(const Lane& lane, const Reference& reference, const Conditions& conditions) {
  JudgedLane out{lane.entrant, lane.seed, {}};
  for (const Checkpoint& c : lane.checkpoints) {
    const auto pixels = kept(c.picture, conditions.size);
    if (!pixels) return tl::unexpected(pixels.error());
    const Wrong w = wrong(*pixels, reference);
    out.points.push_back({c.spp, c.cost, conditions.seconds(c.cost), c.last, c.estimate, w.mse, w.relmse});
  }
  return out;
}

void take_notes(Race& race, const Lanes& lanes) {
  for (const Lane& lane : lanes.lanes)
    for (const std::string& note : lane.notes) {
      const std::string text =
          fmt::format("{}, seed {}: {}", race.entrants[lane.entrant].name, lane.seed, note);
      race.notes.push_back(text);
    }
}

tl::unexpected<Error> no_judge() {
  return bad_argument(
      "without --reference the pictures are measured against those of the other seeds by an "
      "integrator that sees all of the scene: there must be one, and two seeds at least");
}

}  // namespace

Result<Lanes> run_lanes(std::size_t entrants, std::size_t seeds, const MakeRacer& make,
                        const std::atomic<bool>& stop, const Progress& progress) {
  Lanes out;
  std::set<std::size_t> failed;
  for (std::size_t s = 0; s < seeds; ++s) {
    Heat heat(s, out);
    if (auto ok = heat.run(entrants, failed, make, stop, progress); !ok) return tl::unexpected(ok.error());
    for (const Failure& f : out.failures) failed.insert(f.entrant);
  }
  std::erase_if(out.lanes, [&](const Lane& lane) { return failed.contains(lane.entrant); });
  return out;
}

Result<void> judges_itself(const Race& race, std::size_t seeds) {
  const bool sees_all =
      std::any_of(race.entrants.begin(), race.entrants.end(), [](const Entrant& e) { return e.whole; });
  return seeds >= 2 && sees_all ? Result<void>() : no_judge();
}

Result<void> judge(Race& race, const Lanes& lanes, std::size_t seeds,
                   const std::optional<Reference>& reference) {
  race.failures = lanes.failures;
  take_notes(race, lanes);
  std::optional<std::size_t> best;
  if (!reference) {
    if (auto possible = judges_itself(race, seeds); !possible) return possible;
    best = best_of(race, lanes, seeds);
    if (!best) return no_judge();
    race.reference = fmt::format(
        "the final pictures of all other seeds by {}: the means of their halves are two references, "
        "independent of each other and of the picture",
        race.entrants[*best].name);
  }
  for (std::size_t s = 0; s < seeds; ++s) {
    std::optional<Reference> own;
    if (best) {
      auto made = without(s, *best, lanes, race.conditions.size);
      if (!made) return tl::unexpected(made.error());
      own = std::move(*made);
    }
    const Reference& used = own ? *own : *reference;
    if (s == 0) race.reference_noise = noise_of(used);
    for (const Lane& lane : lanes.lanes) {
      if (lane.seed != s) continue;
      auto done = judged(lane, used, race.conditions);
      if (!done) return tl::unexpected(done.error());
      race.lanes.push_back(std::move(*done));
    }
  }
  return {};
}

}  // namespace ls::race

// Tests races of simulated entrants whose images have a known error.
#include "compare/race.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "compare/summary.h"

namespace ls::race {
namespace {

using testing::HasSubstr;

constexpr FrameSize kRaceSize{64, 48};
constexpr double kGrey = .5;

// Returns the right image plus independent normal noise of this variance in every value.
Pixels noisy(double variance, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(kGrey, std::sqrt(variance));
  Pixels pixels(3 * static_cast<std::size_t>(kRaceSize.width * kRaceSize.height));
  for (float& value : pixels) value = static_cast<float>(noise(random));
  return pixels;
}

// A racer whose images have noise of variance 1 / (speed x seconds); each turn takes one second.
class Noise final : public Racer {
 public:
  Noise(double speed, double time, std::filesystem::path stem, std::uint64_t seed, std::string fails = "")
      : speed_(speed), time_(time), stem_(std::move(stem)), seed_(seed), fails_(std::move(fails)) {}

  Turn next() const override { return {used_ >= time_, used_, 1}; }
  Result<void> take_turn(const std::atomic<bool>&) override {
    if (!fails_.empty() && used_ >= 2) return fail(Errc::invalid_argument, fails_);
    used_ += 1;
    for (const char* half : {".a", ".b"}) write(stem_.string() + half, 2);
    const std::filesystem::path picture = stem_.string() + std::to_string(static_cast<int>(used_));
    write(picture, 1);
    ImageError estimate;
    estimate.relmse = 1 / (speed_ * used_);
    points_.push_back({used_, {used_, 2 * used_}, used_ >= time_, estimate, picture});
    return {};
  }
  std::vector<Checkpoint> checkpoints() const override { return points_; }
  std::vector<std::filesystem::path> halves() const override {
    return {stem_.string() + ".a", stem_.string() + ".b"};
  }

 private:
  void write(const std::filesystem::path& file, double share) {
    EXPECT_TRUE(keep(file, noisy(share / (speed_ * used_), seed_ * 1000 + ++drawn_)));
  }
  const double speed_, time_;
  const std::filesystem::path stem_;
  const std::uint64_t seed_;
  const std::string fails_;
  std::uint64_t drawn_ = 0;
  double used_ = 0;
  std::vector<Checkpoint> points_;
};

struct Ran {
  Race race;
  Result<Lanes> lanes;
  std::vector<std::size_t> order;  // the entrant of each turn, over all seeds
};

// Runs a race of entrants with these speeds, `time` turns each.
Ran ran(const Scratch& scratch, const std::vector<double>& speeds, std::size_t seeds, double time,
        const std::string& second_fails = "") {
  Ran out;
  out.race.conditions.size = kRaceSize;
  for (std::size_t e = 0; e < speeds.size(); ++e)
    out.race.entrants.push_back({"speed " + std::to_string(speeds[e]), true});
  const std::atomic<bool> stop{false};
  out.lanes = run_lanes(
      speeds.size(), seeds,
      [&](std::size_t e, std::size_t s) -> Result<std::unique_ptr<Racer>> {
        const auto stem = scratch.folder() / (std::to_string(e) + "-" + std::to_string(s) + "-");
        return std::make_unique<Noise>(speeds[e], time, stem, e * 100 + s,
                                       e == 1 && s == 1 ? second_fails : "");
      },
      stop, [&](std::size_t, std::size_t entrant, double) { out.order.push_back(entrant); });
  return out;
}

TEST(Races, GoSeedBySeedInTurns) {
  const auto scratch = Scratch::make();
  const Ran r = ran(*scratch, {1, 1}, 2, 3);

  ASSERT_TRUE(r.lanes);
  EXPECT_EQ(r.order, (std::vector<std::size_t>{0, 1, 0, 1, 0, 1, 1, 0, 1, 0, 1, 0}));
  ASSERT_EQ(r.lanes->lanes.size(), 4u);
  EXPECT_EQ(r.lanes->lanes[0].checkpoints.size(), 3u);
}

// The image has 9216 values with noise of variance v, and the two references have noise of variance vr each.
// If vr <= v, the standard error of the measured mean square is below v sqrt(2 / 9216) (1 + vr / v) < .04 v.
// The tests allow five standard errors, 20 %.
TEST(Races, FindTheTrueErrorAndRatioByTheOtherSeeds) {
  const auto scratch = Scratch::make();
  Ran r = ran(*scratch, {1000, 250}, 4, 4);

  ASSERT_TRUE(judge(r.race, *r.lanes, 4, std::nullopt));

  ASSERT_EQ(r.race.lanes.size(), 8u);
  for (const JudgedLane& lane : r.race.lanes) {
    const double v = 1 / (4 * (lane.entrant == 0 ? 1000. : 250.));
    EXPECT_NEAR(lane.points.back().mse / v, 1, .2) << lane.entrant;
    EXPECT_NEAR(lane.points.back().relmse / (v / (kGrey * kGrey + .01)), 1, .2);
  }
  EXPECT_THAT(r.race.reference, HasSubstr("speed 1000"));
  const auto rows = rows_of(r.race);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_FALSE(rows[0].ratio);
  ASSERT_TRUE(rows[1].ratio);
  EXPECT_NEAR(rows[1].ratio->value, 4, .4);  // the mean over four seeds, each within about 6 %
  EXPECT_LT(rows[1].ratio->lo, 4.4);
  EXPECT_GT(rows[1].ratio->hi, 3.6);
}

TEST(Races, TwoReferencesDropTheirOwnNoise) {
  const auto scratch = Scratch::make();
  Ran r = ran(*scratch, {1000}, 1, 4);
  const double v = 1 / 4000.;

  const Reference both{noisy(v, 7), noisy(v, 8)}, one{noisy(v, 7), {}};
  Race twice = r.race, once = r.race;
  ASSERT_TRUE(judge(twice, *r.lanes, 1, both));
  ASSERT_TRUE(judge(once, *r.lanes, 1, one));

  EXPECT_NEAR(twice.lanes[0].points.back().mse / v, 1, .2);
  EXPECT_NEAR(once.lanes[0].points.back().mse / v, 2, .2);  // the reference's noise counts as error
  EXPECT_NEAR(twice.reference_noise / (v / 2 / (kGrey * kGrey + .01)), 1, .2);
}

TEST(Races, GoOnWithoutTheOneThatFails) {
  const auto scratch = Scratch::make();
  Ran r = ran(*scratch, {1000, 500, 250}, 3, 3, "out of paint");

  ASSERT_TRUE(r.lanes);
  ASSERT_EQ(r.lanes->failures.size(), 1u);
  EXPECT_EQ(r.lanes->failures[0].entrant, 1u);
  EXPECT_EQ(r.lanes->failures[0].why, "out of paint");
  EXPECT_EQ(r.lanes->lanes.size(), 6u);
  ASSERT_TRUE(judge(r.race, *r.lanes, 3, std::nullopt));
  EXPECT_EQ(rows_of(r.race).size(), 2u);
}

TEST(Races, NeedAReferenceOrTwoSeedsOfSomethingWhole) {
  const auto scratch = Scratch::make();
  Ran single = ran(*scratch, {1000}, 1, 3);
  EXPECT_THAT(judge(single.race, *single.lanes, 1, std::nullopt).error().message, HasSubstr("--reference"));

  Ran blind = ran(*scratch, {1000}, 2, 3);
  blind.race.entrants[0].whole = false;  // such as an integrator that ignores media
  EXPECT_FALSE(judge(blind.race, *blind.lanes, 2, std::nullopt));
}

TEST(Races, EndWhenTheUserWantsIt) {
  std::atomic<bool> stop{true};
  const auto lanes = run_lanes(
      1, 1, [](auto, auto) -> Result<std::unique_ptr<Racer>> { return std::make_unique<Noise>(1, 3, "", 0); },
      stop, [](auto, auto, auto) {});

  EXPECT_EQ(lanes.error().code, Errc::failed_precondition);
}

}  // namespace
}  // namespace ls::race

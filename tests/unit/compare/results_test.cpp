// Tests curves, predictions and the files of a comparison.
#include "compare/results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace ls::race {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Returns a lane with the error 1 / (speed x seconds). The estimate is the true error; its interval extends
// by the factor `interval` to each side.
JudgedLane lane(std::size_t entrant, std::size_t seed, double speed, const std::vector<double>& spp,
                double interval = 1.2) {
  JudgedLane out{entrant, seed, {}};
  for (const double n : spp) {
    const double seconds = n / 100, error = 1 / (speed * seconds);
    ImageError estimate;
    estimate.relmse = error, estimate.relmse_lo = error / interval, estimate.relmse_hi = error * interval;
    out.points.push_back({n, {seconds, 2 * seconds}, seconds, n == spp.back(), estimate, error, error});
  }
  return out;
}

Results results(double second_speed = 5) {
  Results out{{"two cores of a machine", .01, "build 1"}, 3, {}};
  Race race;
  race.scene = "fog, \"thick\"";
  race.conditions = {10, RaceClock::wall, 2, UINT64_C(1) << 31, {64, 48}};
  race.entrants = {{"Lightshaft <b>|volpath", true}, {"Other"}};
  for (std::size_t s = 0; s < 3; ++s) {
    race.lanes.push_back(lane(0, s, 10 + static_cast<double>(s),
                              {2, 4, 8, 16, 32, 64, 128, 192, 200 + 2. * static_cast<double>(s)}));
    race.lanes.push_back(lane(1, s, second_speed, {4, 16, 64}));
    for (JudgedPoint& p : race.lanes.back().points) p.estimate.reset();
  }
  race.reference = "two files";
  race.reference_noise = .001;
  out.races.push_back(std::move(race));
  return out;
}

TEST(Curves, JoinSeedsAtEqualSamplesAndAtTheirEnds) {
  const auto curve = curve_of(results().races[0], 0);

  ASSERT_EQ(curve.size(), 9u);
  EXPECT_NEAR(curve[0].seconds, .02, 1e-12);
  EXPECT_NEAR(curve[0].relmse.value, 1 / (.02 * std::cbrt(10. * 11 * 12)), 1e-9);
  EXPECT_LT(curve[0].relmse.lo, curve[0].relmse.value);
  EXPECT_NEAR(curve[8].spp, std::cbrt(200. * 202 * 204),
              1e-9);  // the three ends have different sample counts
}

TEST(Curves, LeaveOutWhatTheReferenceCannotSee) {
  Results r = results();
  r.races[0].lanes[0].points[3].relmse = -1e-6;

  EXPECT_EQ(curve_of(r.races[0], 0).size(), 8u);
  EXPECT_THAT(markdown(r), HasSubstr("1 picture cannot be measured"));
}

TEST(Pages, SayHowManySamplesThereWereAndNotAbout) {
  Results r = results();
  for (JudgedLane& lane : r.races[0].lanes) lane.points.back().spp = 1024;
  EXPECT_THAT(markdown(r), AllOf(HasSubstr("| 1,024 |"), Not(HasSubstr("1,020"))));
  r.races[0].lanes[0].points.back().spp = 1030;
  EXPECT_THAT(markdown(r), HasSubstr("| 1,026 |")) << "the geometric mean, 1025.998, of seeds that differ";
}

TEST(Rows, HaveEfficiencySlopeAndRatio) {
  const auto rows = rows_of(results().races[0]);

  ASSERT_EQ(rows.size(), 2u);
  EXPECT_NEAR(rows[0].efficiency->value, std::cbrt(10. * 11 * 12), 1e-9);  // 1 / (error x seconds) = speed
  EXPECT_NEAR(rows[0].slope->value, 1, 1e-9);
  EXPECT_NEAR(rows[1].ratio->value, std::cbrt(10. * 11 * 12) / 5, 1e-9);
  EXPECT_NEAR(rows[1].spread, 1, 1e-9);
}

// If errors fall exactly as 1/N, every prediction is right.
TEST(Predictions, AreMadeOnlyWhereTheirOutcomeIsSeen) {
  const auto all = predictions_of(results().races[0]);

  ASSERT_FALSE(all.empty());
  for (const Prediction& p : all) {
    EXPECT_EQ(p.entrant, 0u) << "the other program estimates nothing";
    EXPECT_LE(p.spent + p.hi, 2 * 2.04 + 1e-9) << "its interval ends after the race";
    EXPECT_TRUE(p.within()) << p.spp << " " << p.target;
    EXPECT_GE(p.spp, 8);
  }
}

TEST(Predictions, OfATargetThatIsNotReachedAreWrong) {
  Results r = results();
  for (JudgedLane& l : r.races[0].lanes)
    for (JudgedPoint& p : l.points)
      if (p.estimate && p.spp > 32)
        p.estimate->relmse = l.points[4].estimate->relmse;  // constant from 32 samples on
  const auto all = predictions_of(r.races[0]);

  const auto early = std::count_if(all.begin(), all.end(), [](const Prediction& p) { return p.spp == 32; });
  EXPECT_GT(early, 0);
  for (const Prediction& p : all)
    if (p.spp == 32) EXPECT_FALSE(p.within());
}

TEST(Files, KeepTheirColumnsWhateverNamesAre) {
  const Results r = results();

  EXPECT_THAT(points_csv(r),
              HasSubstr("\n\"fog, \"\"thick\"\"\",Lightshaft <b>|volpath,0,2,0.02,0.04,0.02,5,"));
  Results later = r;
  later.first_seed = 101;
  EXPECT_THAT(points_csv(later), HasSubstr("|volpath,101,2,0.02,")) << "the seed that makes it again";
  EXPECT_THAT(markdown(later), HasSubstr("The seeds are 101 to 103"));
  EXPECT_THAT(summary_csv(r), HasSubstr(",Other,3,64,0.64,0.3125,"));
  EXPECT_THAT(forecasts_csv(r),
              HasSubstr("scene,entrant,seed,spp,spent,target,predicted,lo,hi,actual,within\n"));
}

TEST(Files, PagesEscapeWhatScenesAndProgramsSay) {
  Results r = results();
  r.races[0].failures.push_back({1, "<script>alert(1)</script>"});

  EXPECT_THAT(html_page(r), Not(HasSubstr("<script>")));
  EXPECT_THAT(html_page(r), Not(HasSubstr("<b>")));
  EXPECT_THAT(html_page(r), HasSubstr("&lt;script&gt;"));
  EXPECT_THAT(markdown(r), HasSubstr("Lightshaft \\<b\\>\\|volpath"));
  EXPECT_THAT(markdown(r), HasSubstr("(fog___thick_.svg)"));
  EXPECT_THAT(plot_svg(r.races[0]), HasSubstr("<svg"));
}

TEST(Files, SayWhenTheMachineWasBusy) {
  Results quiet = results(), loud = results();
  loud.machine.others = .4;

  EXPECT_FALSE(busy(quiet.machine));
  EXPECT_THAT(markdown(quiet), HasSubstr("Nothing else ran"));
  EXPECT_THAT(markdown(loud), AllOf(HasSubstr("had 40.0 % of its cores' time"),
                                    HasSubstr("Wall seconds on a busy machine say little")));
  loud.races[0].conditions.clock = RaceClock::cpu;
  EXPECT_THAT(markdown(loud), HasSubstr("ratios hold better"));
}

TEST(Files, WithOneSeedClaimNoInterval) {
  Results r = results();
  std::erase_if(r.races[0].lanes, [](const JudgedLane& l) { return l.seed > 0; });

  EXPECT_THAT(markdown(r), Not(HasSubstr("inf")));
  EXPECT_THAT(html_page(r), Not(HasSubstr("inf")));
  EXPECT_THAT(summary_csv(r), Not(HasSubstr("inf")));
}

}  // namespace
}  // namespace ls::race

// Tests how the cases of the validation table are judged. A renderer fails whose error is as large as the
// band, and so does a result from too few samples.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <set>

#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"
#include "validation/measure/hypothesis_tests.h"
#include "validation/run.h"

namespace ls::cases {
namespace {

cli::ValidateCase judged(double got, double error, double band, double freedom = 1000, double unknown = 0) {
  cli::ValidateCase c;
  c.expected = 2;
  c.got = got;
  c.standard_error = error;
  c.band = band;
  c.level = c.band_level = .01;  // an interval of +- 2.58 standard errors
  judge_equivalence(c, freedom, unknown, 1e-9, 40);
  return c;
}

TEST(Equivalence, PassesOnlyIfTheIntervalIsInTheBandAndContainsTheAnswer) {
  EXPECT_TRUE(judged(2, .001, .003).passed());
  EXPECT_TRUE(judged(2.002, .001, .003).passed());
  EXPECT_FALSE(judged(2.004, .001, .003).passed()) << "inside the band, but far off by its own error";
  EXPECT_FALSE(judged(2, .003, .003).passed()) << "nobody knows";
  EXPECT_TRUE(judged(2, .003, .003).too_wide);
  EXPECT_FALSE(judged(2.004, .001, .003).too_wide);
  EXPECT_FALSE(judged(2, .001, .003, 20).passed()) << "a few pixels rule";
  EXPECT_TRUE(judged(2.0001, 0, .003, 1000, .0002).passed());
  EXPECT_FALSE(judged(2.0003, 0, .003, 1000, .0002).passed());
  EXPECT_FALSE(judged(std::nan(""), 0, .003).passed());
}

TEST(Equivalence, MeasuresZByChanceAndByWhatIsAllowedWithoutIt) {
  EXPECT_NEAR(judged(2.003, .001, .003).z, 3, 1e-9);
  EXPECT_NEAR(judged(2.0001, 1e-9, .003, 1000, .0002).z, .5, 1e-9) << "a last place, and not 1e5 errors";
  EXPECT_NEAR(judged(2.0001, 0, .003, 1000, .0002).z, .5, 1e-9);
  EXPECT_NEAR(judged(2.005, .003, .01, 1000, .004).z, 1, 1e-9);
  EXPECT_EQ(judged(2.005, .003, .01, 1000, .004).allowance, .004);
}

TEST(Equivalence, BandHasItsOwnLevel) {
  const auto judged_at = [](double off, double level, double band_level) {
    cli::ValidateCase c;
    c.expected = 1;
    c.got = 1 + off;
    c.standard_error = .001;
    c.band = .004;
    c.level = level;
    c.band_level = band_level;
    judge_equivalence(c, 1e6, 0, 1e-9, 40);
    return c;
  };
  // The level 1e-6 means an interval of +- 4.89 standard errors, .01 one of +- 2.58.
  EXPECT_TRUE(judged_at(0, 1e-6, .01).passed());
  EXPECT_TRUE(judged_at(0, .01, 1e-6).too_wide);
  EXPECT_TRUE(judged_at(.0016, 1e-6, .01).too_wide);
  EXPECT_FALSE(judged_at(.003, .01, .9).passed()) << "in the band, and misses the answer";
  EXPECT_TRUE(judged_at(.003, 1e-6, .9).passed());
}

TEST(Equivalence, QuantilesMatchTheTables) {
  EXPECT_NEAR(cli::student_quantile(.05, 10), 2.228139, 1e-6);
  EXPECT_NEAR(cli::student_quantile(.01, 1e9), 2.575829, 1e-5);
}

// A table of one case: white light behind half a mean free path of medium.
Table one_case(double expected, double band) {
  Table t;
  t.mean("one", "N0", "",
         [] {
           SceneBuilder builder;
           builder.container(CubeShape{}, {}, builder.null(), builder.homogeneous(rgb(.25), rgb(.5)));
           builder.environment();
           builder.scene.integrator.max_depth = 1;
           builder.look({-3, .5, .5}, {.5, .5, .5});
           return builder;
         },
         grey(expected), {.band = band});
  return t;
}

TEST(Cases, RightAnswerPassesAndAnAnswerOutsideTheBandFails) {
  const double right = std::exp(-.5);
  EXPECT_TRUE(run_cases(one_case(right, .01), {}).at(0).passed());
  EXPECT_FALSE(run_cases(one_case(right * 1.01, .01), {}).at(0).passed());
  EXPECT_FALSE(run_cases(one_case(right * .99, .01), {}).at(0).passed());
}

TEST(Cases, UseAsManyPathsAsTheirBandNeeds) {
  const auto wide = run_cases(one_case(std::exp(-.5), .02), {}).at(0),
             narrow = run_cases(one_case(std::exp(-.5), .002), {}).at(0);
  EXPECT_GT(narrow.paths, 5 * wide.paths);
  EXPECT_TRUE(narrow.passed()) << narrow.why;
}

TEST(Cases, CaseWithARefusedSceneFails) {
  Table t;
  t.mean(
      "bad", "N0", "",
      [] {
        SceneBuilder builder;
        builder.container(CubeShape{}, {}, builder.null(), builder.homogeneous(rgb(1e38), rgb(0)));
        return builder;
      },
      grey(1));
  const auto line = run_cases(t, {}).at(0);
  EXPECT_NE(line.why.find("extinction"), std::string::npos) << line.why;
}

// A case about media fails if pruning removes its medium, since it would then pass whatever the renderer
// does.
TEST(Cases, AreSkippedWithoutTheirMedium) {
  const auto nothing = [](bool grid) {
    SceneBuilder builder;
    const Configuration way{grid, false};
    way.choose(builder);
    builder.container(CubeShape{}, {}, builder.null(), way.medium(builder, rgb(0), rgb(0), 0, {}));
    builder.environment();
    return builder;
  };
  for (const bool grid : {false, true}) {
    const std::string id = grid ? "mine/grid/volpath" : "mine/homogeneous/volpath";
    Table t;
    t.mean(
        id, "N0", "", [=] { return nothing(grid); }, grey(1));
    t.exact(id, "N0", "", [=](const Bench& b) { return every_value(b, nothing(grid), 4, grey(1), 0); });
    for (const cli::ValidateCase& line : run_cases(t, {}))
      EXPECT_NE(line.why.find("asks nothing of media"), std::string::npos) << id << ": " << line.why;
  }
  Table other;
  other.exact("mine", "N0", "",
              [=](const Bench& b) { return every_value(b, nothing(false), 4, grey(1), 0); });
  EXPECT_TRUE(run_cases(other, {}).at(0).passed());
}

TEST(Cases, AreSelectedByPrefixOrGlob) {
  EXPECT_TRUE(asked_for("N03-slab/grid/volpath", ""));
  EXPECT_TRUE(asked_for("N03-slab/grid/volpath", "N03"));
  EXPECT_TRUE(asked_for("N03-slab/grid/volpath", "*grid*"));
  EXPECT_FALSE(asked_for("N03-slab/grid/volpath", "grid"));
}

TEST(Cases, HaveUniqueIdsAndRows) {
  std::set<std::string> ids;
  const Table table = all_cases();
  for (const Case& c : table.cases()) {
    EXPECT_TRUE(ids.insert(c.id).second) << c.id << " is there twice";
    EXPECT_FALSE(c.rows.empty() || c.about.empty()) << c.id;
  }
}

TEST(Cases, ExplainAWiderBand) {
  const Table table = all_cases();
  for (const Case& c : table.cases())
    EXPECT_EQ(c.options.band > kBand, !c.options.why_band.empty()) << c.id << ": " << c.options.band;
}

// The known values are eight digits of a point source's fluence, by quadrature of its Fourier transform, a
// method that the tested code does not use.
TEST(EndlessMedium, PointHasTheFluenceOfTheFourierSolution) {
  constexpr double kRadii[] = {.25, 1, 2, 5};
  const std::map<double, std::array<double, 4>> known = {
      {.3, {1.1403563, .043133829, .0048538194, 5.4892674e-5}},
      {.5, {1.2648813, .058695138, .0079276237, 1.2913241e-4}},
      {.8, {1.5188779, .10741259, .022065806, 9.5217959e-4}},
      {.9, {1.6393113, .14328386, .037126399, .0029151251}},
      {.99, {1.8031446, .22019457, .084976895, .019841736}},
      {.999, {1.8404525, .24795726, .10858551, .036265014}}};
  for (const auto& [c, phi] : known)
    for (std::size_t i = 0; i < 4; ++i)  // eight digits are exact to a relative 5e-8
      EXPECT_NEAR(endless_fluence(c, kRadii[i], 0), phi[i], 6e-8 * phi[i]) << c << ' ' << kRadii[i];
}

// The fluence of a ball is the mean fluence of its points. Here the mean is taken by the midpoint rule over
// radius and angle, since the tested code integrates over the angle in closed form. With 40 x 40 midpoints
// (h = 1/40) of a function whose second derivatives are about 1, the relative error is about h^2 = 6e-4.
TEST(EndlessMedium, BallHasTheMeanFluenceOfItsPoints) {
  constexpr double kRadius = .5, kDistance = 1, kAlbedo = .8;
  constexpr int kSteps = 40;
  double sum = 0, weight = 0;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const double a = kRadius * (i + .5) / kSteps, mu = -1 + 2 * (j + .5) / kSteps;
      const double s = std::sqrt(kDistance * kDistance + a * a - 2 * a * kDistance * mu);
      sum += a * a * endless_fluence(kAlbedo, s, 0), weight += a * a;
    }
  EXPECT_NEAR(endless_fluence(kAlbedo, kDistance, kRadius), sum / weight, 1e-3 * sum / weight);
}

}  // namespace
}  // namespace ls::cases

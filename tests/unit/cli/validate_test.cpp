// Tests the statistics of `lightshaft validate` against printed tables, its verdicts, and its tests from Nori
// files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/scene_builder.h"
#include "validation/measure/hypothesis_tests.h"
#include "validation/nori_test_run.h"

namespace ls::cli {
namespace {

// Critical values of Student's t and of chi-square, to the digits of the usual tables.
TEST(ValidateStats, TailsMatchTheTables) {
  EXPECT_NEAR(student_tails(1, 1), .5, 1e-12);
  EXPECT_NEAR(student_tails(2.228139, 10), .05, 1e-6);
  EXPECT_NEAR(student_tails(-3.169273, 10), .01, 1e-6);
  EXPECT_NEAR(student_tails(1.959964, 1e7), .05, 1e-6);
  EXPECT_NEAR(student_tails(0, 3), 1, 1e-12);
  EXPECT_NEAR(chi2_tail(3.841459, 1), .05, 1e-6);
  EXPECT_NEAR(chi2_tail(18.307038, 10), .05, 1e-6);
  EXPECT_NEAR(chi2_tail(124.342113, 100), .05, 1e-6);
  EXPECT_NEAR(chi2_tail(70.064895, 100), .99, 1e-6);
  EXPECT_NEAR(chi2_tail(2, 2), std::exp(-1.), 1e-12);
}

TEST(ValidateStats, ChiSquareMergesRareCellsAndFindsSamplesWithoutDensity) {
  // The cells that expect 2, 3 and 15 are merged into one of 20, where 5 + 4 + 15 = 24 are observed. The
  // statistic is (24 - 20)^2 / 20 + (36 - 40)^2 / 40.
  const std::array<double, 4> expected{2, 40, 3, 15}, observed{5, 36, 4, 15};
  const ChiSquare merged = chi_square(expected, observed, 10);
  EXPECT_EQ(merged.freedom, 1);
  EXPECT_DOUBLE_EQ(merged.statistic, 16. / 20 + 16. / 40);
  EXPECT_EQ(merged.p, chi2_tail(merged.statistic, 1));
  EXPECT_EQ(merged.impossible, 0);
  // Since the edges of cells are rounded, a few samples may lie in a cell with density 0.
  for (const double strays : {10., 11.}) {
    const std::array<double, 2> none{0, 100}, some{strays, 100 - strays};
    EXPECT_EQ(chi_square(none, some, 10).impossible, strays > 10 ? strays : 0);
  }
}

// The significance levels that Nori prints for the level .01 and 4, 3 and 2 references.
TEST(ValidateStats, SidakCorrectionMatchesNori) {
  EXPECT_NEAR(sidak(.01, 4), .00250943, 1e-8);
  EXPECT_NEAR(sidak(.01, 3), .00334451, 1e-8);
  EXPECT_NEAR(sidak(.01, 2), .00501256, 1e-8);
  EXPECT_DOUBLE_EQ(sidak(.01, 1), .01);
}

ValidateCase judged(double expected, double got, double error, double rounding = 0, std::uint64_t bad = 0) {
  ValidateCase c;
  c.expected = expected;
  c.got = got;
  c.standard_error = error;
  c.level = .01;
  c.nonfinite = bad;
  judge(c, 1000, rounding);
  return c;
}

TEST(ValidateTable, VerdictUsesTheProbability) {
  EXPECT_TRUE(judged(1, 1.02, .01).passed());
  EXPECT_FALSE(judged(1, 1.03, .01).passed());
  EXPECT_NEAR(judged(1, 1.03, .01).z, 3, 1e-9);
  // An exact answer (standard error 0) may differ only by the rounding of float32.
  EXPECT_TRUE(judged(1, 1 + 1e-6, 0, 2e-6).passed());
  EXPECT_FALSE(judged(1, 1 + 1e-6, 0, 5e-7).passed());
  EXPECT_FALSE(judged(1, 1, .01, 0, 3).passed()) << "samples that went wrong";
  EXPECT_FALSE(judged(1, std::nan(""), .01).passed());
  EXPECT_FALSE(judged(1, 1, std::nan("")).passed());
}

TEST(ValidateTable, JsonHasEveryCaseAndTheCounts) {
  const auto j = table_json({judged(1, 1, .01), judged(1, 2, .01)});
  EXPECT_EQ(j["passed"], 1);
  EXPECT_EQ(j["failed"], 1);
  EXPECT_EQ(j["cases"][0]["verdict"], "pass");
  EXPECT_EQ(j["cases"][1]["verdict"], "fail");
  EXPECT_TRUE(j["cases"][1].contains("why"));
}

TEST(ValidateFile, BsdfIsSeenFromTheRequestedAngle) {
  // A conductor with index 1.5 that absorbs nothing reflects as a smooth dielectric boundary does. The
  // references are Fresnel's formulas at 0 and 60 degrees.
  test::SceneBuilder builder;
  builder.shape(RectangleShape{}, {},
                builder.bsdf(ConductorBsdf{{1.5, 1.5, 1.5}, {0, 0, 0}, builder.texture({1, 1, 1})}));
  NoriTest t;
  t.bsdfs.push_back(builder.scene);
  t.angles = {0, 60};
  const double c = std::cos(test::kPi / 3), ct = std::sqrt(1 - .75 / 2.25);
  const double rs = (c - 1.5 * ct) / (c + 1.5 * ct), rp = (ct - 1.5 * c) / (ct + 1.5 * c);
  t.references = {.04, (rs * rs + rp * rp) / 2};
  const auto cases = validate_test(t, {}, {.threads = 1});
  ASSERT_TRUE(cases) << cases.error().message;
  ASSERT_EQ(cases->size(), 2u);
  for (const ValidateCase& one : *cases) EXPECT_TRUE(one.passed()) << one.name << ": " << one.why;
}

TEST(ValidateFile, DeltaLobesHaveNoDensityToTest) {
  test::SceneBuilder builder;
  builder.shape(RectangleShape{}, {}, builder.mirror());
  NoriTest t;
  t.kind = NoriTestKind::chi2_test;
  t.bsdfs.push_back(builder.scene);
  const auto cases = validate_test(t, {}, {.threads = 1});
  ASSERT_FALSE(cases);
  EXPECT_EQ(cases.error().code, Errc::invalid_argument);
}

TEST(ValidateChi2, FollowsItsDegreesOfFreedomForARightSampler) {
  // The samples of a diffuse surface pass the test against its own density, with a p-value that is not small.
  test::SceneBuilder builder;
  builder.shape(RectangleShape{}, {}, builder.diffuse(.5));
  NoriTest t;
  t.kind = NoriTestKind::chi2_test;
  t.bsdfs.push_back(builder.scene);
  t.sample_count = 200'000;
  const auto c = chi2_case(t, 0, {}, 1);
  ASSERT_TRUE(c) << c.error().message;
  EXPECT_TRUE(c->why.empty()) << c->why;
  EXPECT_GT(c->p, 1e-4);
  // The expected statistic is the number of degrees of freedom: the upper hemisphere has about 100 cells, and
  // the empty cells of the lower one are merged into another cell.
  EXPECT_GT(c->expected, 90);
  EXPECT_LT(c->expected, 110);
}

}  // namespace
}  // namespace ls::cli

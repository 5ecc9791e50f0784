// What a report states about the error against a reference, and what it leaves open.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "coordinator/assemble/job_report.h"

namespace ls::coordinator {
namespace {

using nlohmann::json;

// Facts of a job whose errors fall as 1/N. The squared bias against the reference is `floor`, and the
// comparison has this standard error.
ReportFacts compared(double floor, std::optional<double> standard_error) {
  ReportFacts facts;
  facts.job.spec.reference = sha256("reference");
  facts.error = ImageError{.trusted = true};
  for (double spp = 8; spp <= 1024; spp *= 2) {
    const double e = 1 / spp;
    ConvergencePoint point{spp, spp, spp, {e, e, .9 * e, 1.1 * e}};
    point.reference_error =
        ReferenceError{std::sqrt(e + floor), e + floor, {}, standard_error, standard_error};
    facts.convergence.push_back(point);
  }
  return facts;
}

json told(const ReportFacts& facts) { return json::parse(report_json(facts)); }

TEST(ReferenceReport, ReportsAFloorOnlyAboveTheReferencesNoise) {
  EXPECT_EQ(told(compared(.01, {}))["verdict_kind"], "bias_floor");
  EXPECT_EQ(told(compared(.01, .002))["verdict_kind"], "bias_floor");  // the bias is five standard errors
  EXPECT_EQ(told(compared(.01, .003))["verdict_kind"], "converging");  // the bias is three standard errors
}

TEST(ReferenceReport, SameSeedHasNoVerdict) {
  ReportFacts facts = compared(.01, 1e-6);
  facts.job.reference_same_seed = true;

  const json report = told(facts);

  EXPECT_EQ(report["verdict_kind"], "converging");
  EXPECT_EQ(report["reference"]["same_seed"], true);
  EXPECT_EQ(header_notes(facts).at("reference_same_seed"), kSameSeed);
  EXPECT_GT(header_figures(facts).at("true_relmse"), .01) << "it is told as before";
}

TEST(ReferenceReport, ReportsErrorsBelowItsNoise) {
  const ReportFacts facts = compared(0, .001);  // its error at the last checkpoint is 1 / 1024
  const json below = told(facts), without = told(compared(0, {}));

  EXPECT_EQ(below["reference"]["below_noise"], true);
  EXPECT_EQ(below["reference"]["rmse_below_noise"], true);
  EXPECT_EQ(below["reference"]["relmse_stderr"], .001);
  EXPECT_EQ(below["convergence"][0]["true_relmse_below_noise"], false);
  EXPECT_EQ(below["true_relmse"], 1. / 1024) << "the number stands as before";
  EXPECT_EQ(header_notes(facts).at("true_below_noise"), "rmse relmse");
  EXPECT_EQ(without["reference"]["below_noise"], false);
  EXPECT_EQ(without["reference"]["relmse_stderr"], nullptr);
  EXPECT_TRUE(header_notes(compared(0, {})).empty());
}

}  // namespace
}  // namespace ls::coordinator

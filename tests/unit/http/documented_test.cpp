// The report has the members that openapi.json describes.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "coordinator/assemble/job_report.h"
#include "coordinator/views/views.h"
#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

using nlohmann::json;

json properties_of(const char* schema) {
  return json::parse(embedded_openapi())["components"]["schemas"][schema]["properties"];
}

void expect_described(const json& answer, const json& properties) {
  for (const auto& [key, value] : answer.items()) EXPECT_TRUE(properties.contains(key)) << key;
  for (const auto& [key, value] : properties.items())
    EXPECT_TRUE(answer.contains(key) || key == "frames") << key << " is described and does not come";
}

TEST(Documented, OpenApiDocumentsAllMembersOfAReport) {
  coordinator::ReportFacts facts;
  facts.job.spec.target_error = 1e-3;
  facts.job.spec.reference = sha256("reference");
  facts.job.stopped = StopReason::error;
  facts.job.spec.denoise = true;
  facts.denoised = coordinator::DenoisedFigures{"Open Image Denoise 2.5.1", "", {}, 1, TrueError{}};
  facts.error = ImageError{};
  for (const double spp : {2., 4., 8., 16.}) {
    coordinator::ConvergencePoint point{spp, spp, spp, {1, .1 / spp, .05 / spp, .2 / spp, .9, 1.1}};
    point.reference_error = coordinator::ReferenceError{1, .1 / spp, .5};
    facts.convergence.push_back(point);
  }

  const json report = json::parse(coordinator::report_json(facts));

  const json described = properties_of("Report");
  expect_described(report, described);
  expect_described(report["convergence"][2], described["convergence"]["items"]["properties"]);
}

}  // namespace
}  // namespace ls::http::testing

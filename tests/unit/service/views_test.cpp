#include "coordinator/views/views.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace ls::coordinator {
namespace {

TEST(JobViewJson, EtaWithMoreWorkersHasTheirNumber) {
  JobView view;
  view.eta_with_more = 66;
  view.eta_with_more_ci95 = std::pair(50., 90.);

  const auto json = nlohmann::json::parse(job_json(view));

  EXPECT_EQ(json["eta_with_more"],
            nlohmann::json::parse(R"({"workers": 8, "seconds": 66.0, "ci95": [50.0, 90.0]})"));
}

TEST(JobViewJson, EtaWithMoreWorkersIsNullIfMoreDoNotHelp) {
  const auto json = nlohmann::json::parse(job_json(JobView{}));

  EXPECT_TRUE(json.at("eta_with_more").is_null());
}

}  // namespace
}  // namespace ls::coordinator

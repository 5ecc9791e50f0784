#include "coordinator/views/views.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace ls::coordinator {
namespace {

TEST(JobViewJson, EtaWithMoreWorkersHasTheirNumberAndKeepsTheDeprecatedKeys) {
  JobView view;
  view.eta_with_more = 66;
  view.eta_with_more_ci95 = std::pair(50., 90.);

  const auto json = nlohmann::json::parse(job_json(view));

  EXPECT_EQ(json["eta_with_more"],
            nlohmann::json::parse(R"({"workers": 8, "seconds": 66.0, "ci95": [50.0, 90.0]})"));
  EXPECT_EQ(json["eta_with_8_more"], 66.0);
  EXPECT_EQ(json["eta_with_8_more_ci95"], json["eta_with_more"]["ci95"]);
}

TEST(JobViewJson, KeysOfMoreWorkersAreNullIfMoreDoNotHelp) {
  const auto json = nlohmann::json::parse(job_json(JobView{}));

  for (const char* key : {"eta_with_more", "eta_with_8_more", "eta_with_8_more_ci95"})
    EXPECT_TRUE(json.at(key).is_null()) << key;
}

}  // namespace
}  // namespace ls::coordinator

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/local/local_render.h"

namespace ls::cli {
namespace {

nlohmann::json told(const LocalFacts& facts) {
  return local_report(R"({"name": "/home/someone/a.xml", "samples": 400})", facts).value_or(nullptr);
}

TEST(LocalReport, ReportsInstructionsPerSampleWhereTheyAreCounted) {
  LocalFacts facts;
  facts.instructions = 10'000'000;

  const auto j = told(facts);

  EXPECT_EQ(j.at("instructions").at("count"), 10'000'000);
  EXPECT_EQ(j.at("instructions").at("per_sample"), 25'000.);
  EXPECT_EQ(j.at("name"), "a.xml");
}

TEST(LocalReport, SaysWhyInstructionsAreNotCounted) {
  LocalFacts facts;
  facts.instructions = fail(Errc::unavailable, "this machine has no counter");

  const auto j = told(facts);

  EXPECT_EQ(j.at("instructions"), nlohmann::json({{"uncounted", "this machine has no counter"}}));
}

}  // namespace
}  // namespace ls::cli

#include "common/report/number_text.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/report/shown.h"

namespace ls::report {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// The table is shared with the dashboard, whose texts tests/web/test_modules.py compares with it.
TEST(Words, AreThoseOfTheTable) {
  const std::pair<const char*, std::string (*)(double)> all[] = {
      {"figure", figure},        {"given", given},     {"duration", duration}, {"count", count},
      {"samples", sample_count}, {"bytes", byte_size}, {"percent", percent}};
  for (const auto& [what, words] : all)
    for (const auto& row : shown(what))
      EXPECT_EQ(words(row[0].is_null() ? kUnknown : row[0].get<double>()), row[1].get<std::string>()) << what;
}

TEST(Words, DatesAreInUtc) {
  EXPECT_EQ(date_time(1765000000), "2025-12-06 05:46 UTC");
  EXPECT_EQ(date_time(kUnknown), "–");
}

}  // namespace
}  // namespace ls::report

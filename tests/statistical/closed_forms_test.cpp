// Subjects of the table of `lightshaft validate` in its full bands: the quick table, which every test run
// asks (tests/system/test_validation_table.py), would take three times these deviations for right. Long cases
// are left to `lightshaft validate`.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cctype>
#include <string>
#include <vector>

#include "tests/support/significance.h"
#include "validation/result_table.h"
#include "validation/run.h"
#include "validation/significance_level.h"

namespace ls::test {
namespace {

// Each of the two runs shares the product's rate among its own intervals, as many as there are.
static_assert(cases::kWrongVerdicts <= rate_of(Family::table));
static_assert(cases::kWrongVerdicts <= rate_of(Family::closed_forms));

const cases::Table& table() {
  static const cases::Table table = [] {
    cases::Table t;
    for (const auto add : {cases::add_furnaces, cases::add_direct_light, cases::add_skies,
                           cases::add_coatings, cases::add_overlaps, cases::add_slopes})
      add(t);
    return t;
  }();
  return table;
}

std::vector<std::size_t> short_ones() {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < table().cases().size(); ++i)
    if (!table().cases()[i].options.slow) indices.push_back(i);
  return indices;
}

class ClosedForm : public testing::TestWithParam<std::size_t> {};

TEST_P(ClosedForm, IsMatchedInEveryChannel) {
  for (const cli::ValidateCase& line : cases::run_case(table(), GetParam(), {.threads = 2})) {
    fmt::print("{}\n", cli::table_line(line));
    EXPECT_TRUE(line.passed()) << line.name << ": " << line.why;
  }
  std::fflush(stdout);
}

// GoogleTest's names are of letters, digits and underscores.
INSTANTIATE_TEST_SUITE_P(All, ClosedForm, testing::ValuesIn(short_ones()), [](const auto& info) {
  std::string name = table().cases()[info.param].id;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
});

}  // namespace
}  // namespace ls::test

// More closed forms, judged as those of `lightshaft validate` are (cli/cases): equivalence within a band, one
// false-positive rate for the whole list, fixed seeds.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/statistical/case.h"
#include "tests/support/significance.h"
#include "validation/result_table.h"
#include "validation/run.h"
#include "validation/significance_level.h"

namespace ls::test {
namespace {

// Both tables share the product's rate among their own intervals, as many as there are.
static_assert(cases::kWrongVerdicts <= rate_of(Family::table));
static_assert(cases::kWrongVerdicts <= rate_of(Family::closed_forms));

const cases::Table& table() {
  static const cases::Table table = [] {
    std::vector<Case> list;
    add_extremes(list);
    add_environments(list);
    add_materials(list);
    add_distant(list);
    add_overlaps(list);
    add_points_in_grids(list);
    add_channels(list);
    cases::Table t;
    for (const Case& c : list)
      t.mean(c.name, "more", "More closed forms.", c.builder, c.expected,
             {.band = c.band,
              .slack = c.slack,
              .complement = c.complement,
              .channels = true,
              .paths = c.spp * 256});
    return t;
  }();
  return table;
}

class ClosedForm : public testing::TestWithParam<std::size_t> {};

TEST_P(ClosedForm, IsMatchedInEveryChannel) {
  const auto lines = cases::run_case(table(), GetParam(), {.threads = 2});

  ASSERT_EQ(lines.size(), 3u);
  for (const cli::ValidateCase& line : lines) {
    fmt::print("{}\n", cli::table_line(line));
    EXPECT_TRUE(line.passed()) << line.name << ": " << line.why;
  }
  std::fflush(stdout);
}

INSTANTIATE_TEST_SUITE_P(All, ClosedForm, testing::Range(std::size_t{0}, table().cases().size()),
                         [](const auto& info) { return table().cases()[info.param].id; });

}  // namespace
}  // namespace ls::test

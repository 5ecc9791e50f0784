// Subjects of the table of `lightshaft validate` in its full bands: the quick table, which every test run
// asks (tests/system/test_validation_table.py), would take three times these deviations for right. Cases
// whose full bands take ten seconds and more of two processors are left to `lightshaft validate`.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/significance.h"
#include "validation/measure/judge.h"
#include "validation/run.h"

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

// Prefixes of the ids of cases that take long in full bands; the quick table runs them.
constexpr std::string_view kLongInFullBands[] = {
    "7.6a-through-three-slopes-in-2/", "7.6c-chromatic-ball-in-a-map/",  "7.6c-chromatic-ball-in-walls/",
    "7.6c-grid-in-walls/distant-mis",  "7.6c-shining-sphere-chromatic/", "7.6f-lamp-in-two-clouds/",
    "N69-slab-by-priority-R/",         "N69-slab-of-eight-boxes-R/",     "N69-slab-of-grid-and-constant-R/",
    "N69-slab-of-two-halves-R/",
};

std::vector<std::size_t> short_ones() {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < table().cases().size(); ++i) {
    const auto& c = table().cases()[i];
    const bool is_long =
        std::ranges::any_of(kLongInFullBands, [&](auto name) { return c.id.starts_with(name); });
    if (!c.options.slow && !is_long) indices.push_back(i);
  }
  return indices;
}

TEST(ClosedForms, EveryLongPrefixMatchesACaseOfTheQuickTable) {
  for (const std::string_view name : kLongInFullBands)
    EXPECT_TRUE(std::ranges::any_of(table().cases(), [&](const auto& c) {
      return !c.options.slow && c.id.starts_with(name);
    })) << name;
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

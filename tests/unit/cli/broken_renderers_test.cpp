// Runs the table of cases of `lightshaft validate` with two broken renderers: one that renders black, and one
// that renders everything twice as bright. Every case must fail for both. Cases that cannot detect one of
// them are listed here, each with another case that detects it. tests/mutation tests renderers that lack a
// single term (docs/design/validation.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "validation/run.h"

namespace ls::cases {
namespace {

struct Blind {
  const char *ids, *why;
  bool black, twice;    // whether the case passes for a black image, for a twice as bright one
  const char* partner;  // a case on the same code path that fails; null where nothing is rendered
};

constexpr const char *kNoPicture = "the scene is refused, or its inputs are counted: nothing is rendered",
                     *kDark = "the answer is 0", *kTwoPictures = "two pictures are compared";
constexpr Blind kBlind[] = {
    {"N14-nan", kNoPicture, true, true, nullptr},
    {"N14-inf", kNoPicture, true, true, nullptr},
    {"N14-minus-inf", kNoPicture, true, true, nullptr},
    {"N14-1e38", kNoPicture, true, true, nullptr},
    {"N14-negatives-are-counted", kNoPicture, true, true, nullptr},
    {"N19-g-*-is-refused*", kNoPicture, true, true, nullptr},
    {"N40-index-out-of-range", kNoPicture, true, true, nullptr},
    {"N44-squeezed-too-much", kNoPicture, true, true, nullptr},
    {"N44-singular", kNoPicture, true, true, nullptr},
    {"N45-texel-nan", kNoPicture, true, true, nullptr},
    {"N45-texel-inf", kNoPicture, true, true, nullptr},
    {"N47-focus-at-*", kNoPicture, true, true, nullptr},

    {"N03-nothing-gets-through", kDark, true, true, "N03-semi-infinite"},
    {"N16-black", kDark, true, true, "N16-white"},
    {"N28-no-area-at-all", kDark, true, true, "N28-triangles-without-area"},
    {"N29-only-black-lights", kDark, true, true, "N30-4-lamps"},
    {"N32-lamp-in-a-mirror", kDark, true, true, "N35-grazing"},
    {"N36-conductor-of-air", kDark, true, true, "N36-fresnel-normal"},
    {"N37-light-from-behind", kDark, true, true, "N37-furnace"},
    {"N39-leaks", kDark, true, true, "N39-closed-box"},
    {"N45-negative-texel", kDark, true, true, "N45-one-texel"},
    {"N46-normal-from-below", kDark, true, true, "N37-furnace"},

    {"N04-scaled-by", kTwoPictures, false, true, "N04-sigma"},
    {"N14-negative-", kTwoPictures, false, true, "N09-equal-values"},
    {"N14-albedo-above-1", kTwoPictures, false, true, "N16-white"},
    {"N29-light-of-no-power", kTwoPictures, false, true, "N30-4-lamps"},
    {"N32-lengths-of", kTwoPictures, false, true, "N22-passing-a-lamp"},
    {"N33-alpha-0", kTwoPictures, false, true, "N38-furnace"},
    {"N33-coated-metal-alpha-0", kTwoPictures, false, true, "N36-coated-metal"},
    {"N33-principled-roughness-0", kTwoPictures, false, true, "N38-furnace"},
    {"N33-rough-sheet-alpha-0", kTwoPictures, false, true, "N38-rough-sheet"},
    {"N36-coat-of-air", kTwoPictures, false, true, "N36-coated-metal"},
    {"N36-index-matched", kTwoPictures, false, true, "N36-fresnel-normal"},
    {"N40-degenerate-triangles", kTwoPictures, false, true, "N28-triangles-without-area"},
    {"N42-null-interfaces", kTwoPictures, false, true, "N42-plates"},
    {"N44-instance", kTwoPictures, false, true, "N26-disk"},
    {"N45-texel-above-1", kTwoPictures, false, true, "N45-one-texel"},
    {"N46-normal-of-nothing", kTwoPictures, false, true, "N37-furnace"},
    {"N47-lens-of-nothing", kTwoPictures, false, true, "N47-circle-of-confusion"},
    {"N48-crop-filter", kTwoPictures, false, true, "N48-frame"},
    {"height-fog-as-grid", kTwoPictures, false, true, "height-fog-through"},
    {"N70-first-samples", "the values may be any that are numbers", false, true, "N04-sigma"},
    {"7.6h-order-", "an order adds light, however much", false, true, "7.6h-once"},
};

const Blind* blind(const std::string& id) {
  for (const Blind& b : kBlind)
    if (asked_for(id, b.ids)) return &b;
  return nullptr;
}

std::vector<cli::ValidateCase> with_gain(const Table& table, double gain, const std::string& only = "") {
  return run_cases(table, {.threads = 2, .only = only, .gain = gain});
}

void every_case_fails(double gain, bool Blind::*passes) {
  const Table table = all_cases();
  std::vector<std::string> passed;
  for (const cli::ValidateCase& line : with_gain(table, gain)) {
    const Blind* const known = blind(line.name);
    if (line.passed()) passed.push_back(line.name);
    EXPECT_EQ(line.passed(), known != nullptr && known->*passes)
        << line.name << (known != nullptr ? known->why : "") << " expects " << line.expected << ", got "
        << line.got << ": " << line.why;
  }
  for (const Blind& b : kBlind) {
    if (!(b.*passes)) continue;
    EXPECT_TRUE(
        std::any_of(passed.begin(), passed.end(), [&](const auto& id) { return asked_for(id, b.ids); }))
        << b.ids << " is listed in vain";
  }
}

TEST(BrokenRenderers, BlackImagesFailEveryCaseThatExpectsLight) { every_case_fails(0, &Blind::black); }

TEST(BrokenRenderers, DoubledLightFailsEveryCaseThatExpectsLight) { every_case_fails(2, &Blind::twice); }

TEST(BrokenRenderers, CasesThatMissThemHaveAPartnerThatFails) {
  const Table table = all_cases();
  for (const Blind& b : kBlind)
    for (const double gain : {0., 2.}) {
      if (!(gain == 0 ? b.black : b.twice) || b.partner == nullptr) continue;
      const auto lines = with_gain(table, gain, b.partner);
      EXPECT_FALSE(lines.empty()) << b.partner;
      for (const cli::ValidateCase& line : lines)
        EXPECT_FALSE(line.passed()) << line.name << " is no partner of " << b.ids;
    }
}

// A correct renderer passes all cases, so the tests above do not fail just because every result fails.
TEST(BrokenRenderers, DifferFromARightRendererInTheSameFigures) {
  const Table table = all_cases();
  std::size_t measured = 0;
  for (std::size_t i = 0; i < table.cases().size(); ++i) {
    if (std::holds_alternative<Exact>(table.cases()[i].question)) continue;
    for (const cli::ValidateCase& line : run_case(table, i, {.gain = 1})) {
      EXPECT_TRUE(line.passed()) << line.name << ": " << line.why;
      ++measured;
    }
  }
  EXPECT_GT(measured, 700u);
}

}  // namespace
}  // namespace ls::cases

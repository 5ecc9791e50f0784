// Problems counted by cause and located: the result does not depend on the order of the units.
#include "core/image/film/health.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace ls {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Health of(HealthCause cause, int x, int y, std::uint64_t sample) {
  Health h;
  h.add(cause, 1, {x, y, sample});
  return h;
}

// Returns problems all over an image, each as a Health of its own.
std::vector<Health> scattered() {
  std::vector<Health> all;
  for (int i = 0; i < 40; ++i) {
    all.push_back(of(HealthCause::infinite, (i * 7) % 16, (i * 5) % 9, static_cast<std::uint64_t>(i)));
    if (i % 3 == 0) all.push_back(of(HealthCause::negative, i % 16, 2, 5));
    if (i % 10 == 0) all.push_back(of(HealthCause::majorant_violation, 1, 1, static_cast<std::uint64_t>(i)));
  }
  return all;
}

Health merged(const std::vector<Health>& all) {
  Health sum;
  for (const Health& h : all) sum.merge(h);
  return sum;
}

TEST(Health, DoesNotDependOnTheOrderOfMerging) {
  std::vector<Health> all = scattered();
  const Health expected = merged(all);
  std::mt19937 random(5);
  for (int turn = 0; turn < 20; ++turn) {
    std::shuffle(all.begin(), all.end(), random);
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(random() % all.size());
    Health halves = merged({all.begin(), middle});
    halves.merge(merged({middle, all.end()}));
    EXPECT_EQ(merged(all), expected);
    EXPECT_EQ(halves, expected);
  }
}

TEST(Health, KeepsTheFirstPlacesOfEachCauseRowByRowAndCountsAll) {
  const Health h = merged(scattered());
  EXPECT_EQ(h.nonfinite, 40u);
  EXPECT_EQ(h.negative, 14u);
  EXPECT_EQ(h.majorant_violations, 4u);
  const auto& first = h.causes.at(HealthCause::infinite).first;
  ASSERT_EQ(first.size(), kHealthLocations);
  EXPECT_TRUE(std::is_sorted(first.begin(), first.end()));
  // Row 0 has i = 0, 9, 18, 27 and 36, in columns 0, 15, 14, 13 and 12. Row 1 has i = 2, 11, 20, 29 and 38.
  EXPECT_EQ(first[0], (HealthLocation{0, 0, 0}));
  EXPECT_EQ(first[1], (HealthLocation{12, 0, 36}));
  EXPECT_EQ(first[4], (HealthLocation{15, 0, 9}));
  EXPECT_EQ(first[5].y, 1);
}

TEST(Health, CountsEachPlaceOnce) {
  Health h;
  h.add(HealthCause::majorant_violation, 3, {4, 5, 6});
  h.add(HealthCause::majorant_violation, 2, {4, 5, 6});
  EXPECT_EQ(h.causes.at(HealthCause::majorant_violation).first.size(), 1u);
  EXPECT_EQ(h.majorant_violations, 5u);
}

TEST(Health, CountsClampedInputsOnceAlthoughEveryUnitReportsThem) {
  Health h;
  h.add(HealthCause::negative_density, 7);
  Health sum = h;
  sum.merge(h);
  EXPECT_EQ(sum, h);
  EXPECT_EQ(sum.nonfinite, 0u);
  EXPECT_FALSE(sum.clean());
}

TEST(Health, HealthyUnitsAddNothing) {
  Health h;
  h.add(HealthCause::none, 1, {1, 2, 3});
  h.add(HealthCause::infinite, 0, {1, 2, 3});
  EXPECT_TRUE(h.clean());
  EXPECT_EQ(canonical_json(h), "{}");
}

TEST(Health, IsReadBackAsItWasWritten) {
  Health h = merged(scattered());
  h.add(HealthCause::degenerate_triangle, std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(parse_health(canonical_json(h)).value(), h);
  EXPECT_EQ(canonical_json(of(HealthCause::too_large, 3, 4, 5)),
            R"({"too_large":{"count":1,"first":[[3,4,5]]}})");
}

TEST(Health, UnknownCauseHasNoName) {
  const auto h =
      parse_health(R"({"brand_new":{"count":2,"first":[[1,1,1]]},"older":{"count":3,"first":[]}})");
  ASSERT_TRUE(h);
  EXPECT_EQ(h->nonfinite, 5u);
  EXPECT_EQ(h->causes.at(HealthCause::unnamed).count, 5u);
}

TEST(Health, RefusesMalformedText) {
  const std::string nine = "[0,0,0],[0,0,1],[0,0,2],[0,0,3],[0,0,4],[0,0,5],[0,0,6],[0,0,7],[0,0,8]";
  for (const std::string& text : {
           std::string(""),
           std::string("[]"),
           std::string("7"),
           std::string("{"),
           std::string(R"({"infinite":3})"),
           std::string(R"({"infinite":{"count":-1,"first":[]}})"),
           std::string(R"({"infinite":{"count":1}})"),
           std::string(R"({"infinite":{"count":1,"first":{}}})"),
           std::string(R"({"infinite":{"count":1,"first":[[1,2]]}})"),
           std::string(R"({"infinite":{"count":1,"first":[[1,-2,3]]}})"),
           std::string(R"({"infinite":{"count":1,"first":[[4294967296,2,3]]}})"),
           std::string(R"({"infinite":{"count":2,"first":[[1,2,3],[1,2,3]]}})"),
           R"({"infinite":{"count":9,"first":[)" + nine + "]}}",
           std::string(5000, '[') + std::string(5000, ']'),
       })
    EXPECT_FALSE(parse_health(text)) << text.substr(0, 60);
}

TEST(Health, UnitCannotReportPixelsOfOthers) {
  const PixelRect rect{32, 0, 64, 32};
  const SampleRange samples{4, 8};
  EXPECT_TRUE(check_health(of(HealthCause::infinite, 32, 31, 7), rect, samples));
  for (const auto& h : {of(HealthCause::infinite, 31, 0, 4), of(HealthCause::infinite, 64, 0, 4),
                        of(HealthCause::negative, 40, 32, 4), of(HealthCause::negative, 40, 0, 3),
                        of(HealthCause::infinite, 40, 0, 8)})
    EXPECT_FALSE(check_health(h, rect, samples)) << canonical_json(h);
  Health many;
  many.add(HealthCause::infinite, 32 * 32 * 4 + 1);
  EXPECT_FALSE(check_health(many, rect, samples));
}

TEST(Health, DescribesProblemsInASentence) {
  EXPECT_EQ(sentence(HealthCause::not_a_number, 1), "1 sample was not a number (NaN); it counts as zero");
  EXPECT_EQ(sentence(HealthCause::infinite, 1204), "1,204 samples were infinite; they count as zero");
  EXPECT_THAT(sentence(HealthCause::too_many_surfaces, 2),
              AllOf(HasSubstr("more than 1,048,576 rays"), HasSubstr("more than 65,536 surfaces")));
  EXPECT_THAT(sentence(HealthCause::majorant_violation, 2), HasSubstr("may be biased"));
  EXPECT_THAT(sentence(HealthCause::negative_density, 2), HasSubstr("of volumes of the scene were made 0"));
}

}  // namespace
}  // namespace ls

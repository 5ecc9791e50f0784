// The techniques that a job chooses by name, instead of its scene's integrator.
#include "core/job/techniques.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/job/settings.h"

namespace ls {
namespace {

using testing::HasSubstr;

TEST(TechniqueChoice, IsReadFromItsText) {
  for (const TechniqueRow& row : techniques())
    for (const std::string sign : {"+", "-"}) {
      const std::string text = sign + std::string(row.name);
      const auto choice = parse_technique_choice(text);
      ASSERT_TRUE(choice) << text;
      EXPECT_EQ(choice->with.has(row.technique), sign == "+") << text;
      EXPECT_EQ(choice->without.has(row.technique), sign == "-") << text;
      EXPECT_EQ(to_string(*choice), text);
    }
  EXPECT_EQ(to_string(*parse_technique_choice("-path_reuse,+camera_points")), "+camera_points,-path_reuse");
}

TEST(TechniqueChoice, RefusesOtherTexts) {
  for (const char* text :
       {"", ",", "path_reuse", "+", "-", "+none", "*path_reuse", "-path_reuse,", ",-path_reuse",
        "-path_reuse,,-light_tree", "-path_reuse,+path_reuse", "+light_tree,+light_tree", "- path_reuse",
        "-Path_reuse", "-equiangular,-exponential"})
    EXPECT_FALSE(parse_technique_choice(text)) << text;
}

TEST(TechniqueChoice, ExcludingATechniqueChangesTheIntegrator) {
  const IntegratorSettings plain;
  for (const TechniqueRow& row : techniques()) {
    TechniqueChoice without;
    without.without.add(row.technique);
    EXPECT_NE(with_choice(plain, without), plain) << row.name;
    TechniqueChoice with;
    with.with.add(row.technique);
    const IntegratorSettings again = with_choice(with_choice(plain, without), with);
    EXPECT_EQ(again, with_choice(plain, with)) << row.name << ": the last choice counts";
  }
}

TEST(TechniqueChoice, SetsTheParametersOfTheScene) {
  const auto of = [](std::string_view text) { return with_choice({}, *parse_technique_choice(text)); };
  EXPECT_EQ(of("-path_reuse").path_reuse, -1);
  EXPECT_EQ(of("+path_reuse").path_reuse, kUsualPathReuse);
  EXPECT_EQ(of("+light_vertices").light_vertices, 1);
  EXPECT_TRUE(of("-lamp_directions").phase_only);
  EXPECT_EQ(of("-exponential").distance, DistanceSampling::equiangular);
  EXPECT_EQ(of("-equiangular").distance, DistanceSampling::exponential);
  EXPECT_EQ(of("-equiangular").equiangular, -1);
}

TEST(TechniqueChoice, IsASettingOfAJob) {
  const auto spec = parse_job_spec(R"({"techniques":"-path_reuse,+camera_points"})");
  ASSERT_TRUE(spec) << spec.error().message;
  EXPECT_THAT(canonical_json(*spec), HasSubstr(R"("techniques":"+camera_points,-path_reuse")"));
  EXPECT_EQ(parse_job_spec(canonical_json(*spec)).value(), *spec);
  const auto wrong = parse_job_spec(R"({"techniques":"-path_re"})");
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, HasSubstr("'techniques'"));
  EXPECT_THAT(wrong.error().message, HasSubstr("path_reuse"));
}

}  // namespace
}  // namespace ls

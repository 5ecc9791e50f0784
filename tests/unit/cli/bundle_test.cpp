#include <gtest/gtest.h>

#include "cli/farm/farm_api.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/message/message.h"
#include "core/job/describe.h"
#include "core/job/objects.h"

namespace ls::cli {
namespace {

TEST(Bundle, IsRecognisedByTheFilesName) {
  EXPECT_EQ(bundle_type("a/bath.ZIP"), "application/zip");
  for (const char* tar : {"bath.tar", "bath.tar.gz", "bath.tgz"})
    EXPECT_EQ(bundle_type(tar), "application/x-tar");
  for (const char* scene : {"bath.xml", "zip", "bath.zip.xml", ""}) EXPECT_FALSE(bundle_type(scene)) << scene;
}

Result<JobSpec> as_the_coordinator_reads(const JobSpec& spec, const std::set<std::string_view>& given,
                                         const std::string& base = "{}") {
  const auto target = http::parse_target("/api/v1/jobs" + spec_query(spec, given));
  if (!target) return tl::unexpected(target.error());
  return http::spec_from_query(target->query, "", base);
}

TEST(SpecQuery, CoversEverySetting) {
  JobSpec spec;
  spec.spp = 64;
  spec.target_error = 0.1;
  spec.time = 1.0 / 3;
  spec.seed = ~std::uint64_t{0};
  spec.size = {320, 200};
  spec.integrator = "path";
  spec.aov = {"depth", "albedo"};
  spec.defines = {{"a", "b=c & d#?/%\xc3\xb6"}, {"e", ""}};
  spec.priority = -3;
  spec.float_output = true;
  spec.tags = {"fast", "big"};
  spec.max_workers = 4;
  spec.max_units = 100;
  spec.memory = std::uint64_t{8} << 30;
  spec.numeric_class = "armv8-a:gcc-14.2.0";

  EXPECT_EQ(as_the_coordinator_reads(spec, {"priority"}), spec);
}

TEST(SpecQuery, MissingKeysComeFromTheBundle) {
  EXPECT_EQ(spec_query({}, {}), "");

  const auto spec =
      as_the_coordinator_reads({}, {}, R"({"spp": 5, "priority": 2, "float": true, "tags": ["a"]})");

  ASSERT_TRUE(spec);
  EXPECT_EQ(spec->spp, 5u);
  EXPECT_EQ(spec->priority, 2);
  EXPECT_TRUE(spec->float_output);
  EXPECT_EQ(spec->tags, std::vector<std::string>{"a"});
  JobSpec back_to_normal;
  EXPECT_EQ(as_the_coordinator_reads(back_to_normal, {"priority"}, R"({"priority": 2})")->priority, 0);
  const std::string denoised = R"({"target_error": 0.1, "target_layer": "denoised"})";
  EXPECT_EQ(as_the_coordinator_reads({}, {"target_layer"}, denoised)->target_layer, TargetLayer::raw);
}

// Returns a value of the setting that is not its default.
template <class T>
T other_value(const job::Setting& s) {
  if constexpr (requires(T t) { t.has_value(); })
    return other_value<typename T::value_type>(s);
  else if constexpr (job::kIs<T, bool>)
    return true;
  else if constexpr (job::kIsWhole<T>)
    return static_cast<T>(s.range.most);
  else if constexpr (job::kIs<T, double>)
    return 1.0 / 3;
  else if constexpr (std::is_enum_v<T>)
    return offered(T{}).back();
  else if constexpr (job::kIs<T, std::string>)
    return "a-name.of:it";
  else if constexpr (job::kIs<T, job::Names>)
    return {"one", "two"};
  else if constexpr (job::kIs<T, job::Defines>)
    return {{"a", "b=c, d"}, {"e", ""}};
  else if constexpr (job::kIs<T, FrameSize>)
    return {32768, 2};
  else if constexpr (job::kIs<T, FrameRange>)
    return {7, 7, 1};  // one frame, which a job with a reference may have
  else if constexpr (job::kIs<T, LightMix>)
    return parse_light_mix("key=2").value();
  else if constexpr (job::kIs<T, TechniqueChoice>)
    return *parse_technique_choice("+light_tree,-path_reuse");
  else
    return sha256("reference");
}

TEST(SpecQuery, AndJsonSayEverySettingOfTheTable) {
  JobSpec spec;
  job::for_each_setting(spec, [&]<class T>(const job::Setting& s, T& value) {
    value = other_value<T>(s);
    EXPECT_NE(value, T{}) << s.name;
  });

  EXPECT_EQ(as_the_coordinator_reads(spec, {}), spec);
  EXPECT_EQ(parse_job_spec(canonical_json(spec)), spec);
  EXPECT_TRUE(job::check_ranges(spec, "spec"));
}

Result<JobSpec> read_query(const http::Fields& query, const std::string& base) {
  return http::spec_from_query(query, "name", base);
}

TEST(SpecQuery, GoesBeforeTheSpecOfTheBundle) {
  const std::string base = R"({"spp": 5, "aov": ["depth"], "defines": {"a": "1", "b": "2"}})";

  const auto spec = read_query({{"aov", "albedo"}, {"define", "b=3"}, {"define", "c=4"}}, base);

  ASSERT_TRUE(spec) << spec.error().message;
  EXPECT_EQ(spec->spp, 5u);
  EXPECT_EQ(spec->aov, std::vector<std::string>{"albedo"});
  EXPECT_EQ(spec->defines, (std::map<std::string, std::string>{{"a", "1"}, {"b", "3"}, {"c", "4"}}));
}

TEST(SpecQuery, AndBundleTogetherDecideWhetherTheImageIsDenoised) {
  const std::string denoised = R"({"target_error": 0.1, "target_layer": "denoised"})";

  EXPECT_FALSE(read_query({{"target_layer", "raw"}}, denoised)->denoise);
  EXPECT_TRUE(read_query({}, denoised)->denoise);
  EXPECT_FALSE(read_query({{"denoise", "false"}}, denoised));
  EXPECT_FALSE(read_query({{"frames", "1-2"}}, R"({"defines": {"frame": "3"}})"));
}

TEST(SpecQuery, DoesNotHideAWrongValueOfTheBundle) {
  EXPECT_FALSE(read_query({{"spp", "4"}}, R"({"spp": 0})"));
}

}  // namespace
}  // namespace ls::cli

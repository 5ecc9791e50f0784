#include <gtest/gtest.h>

#include "cli/farm/farm_api.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/message/message.h"

namespace ls::cli {
namespace {

TEST(Bundle, IsToldByTheNameOfTheFile) {
  EXPECT_EQ(bundle_type("a/bath.ZIP"), "application/zip");
  for (const char* tar : {"bath.tar", "bath.tar.gz", "bath.tgz"})
    EXPECT_EQ(bundle_type(tar), "application/x-tar");
  for (const char* scene : {"bath.xml", "zip", "bath.zip.xml", ""}) EXPECT_FALSE(bundle_type(scene)) << scene;
}

Result<JobSpec> as_the_coordinator_reads(const JobSpec& spec, bool with_priority,
                                         const std::string& base = "{}") {
  const auto target = http::parse_target("/api/v1/jobs" + spec_query(spec, with_priority));
  if (!target) return tl::unexpected(target.error());
  return http::spec_from_query(target->query, "", base);
}

TEST(SpecQuery, SaysAllOfASpec) {
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

  EXPECT_EQ(as_the_coordinator_reads(spec, true), spec);
}

TEST(SpecQuery, LeavesToTheBundleWhatWasNotAskedFor) {
  EXPECT_EQ(spec_query({}, false), "");

  const auto spec =
      as_the_coordinator_reads({}, false, R"({"spp": 5, "priority": 2, "float": true, "tags": ["a"]})");

  ASSERT_TRUE(spec);
  EXPECT_EQ(spec->spp, 5u);
  EXPECT_EQ(spec->priority, 2);
  EXPECT_TRUE(spec->float_output);
  EXPECT_EQ(spec->tags, std::vector<std::string>{"a"});
  JobSpec back_to_normal;
  EXPECT_EQ(as_the_coordinator_reads(back_to_normal, true, R"({"priority": 2})")->priority, 0);
}

}  // namespace
}  // namespace ls::cli

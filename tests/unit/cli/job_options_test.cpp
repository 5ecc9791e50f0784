#include "cli/output/job_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/job/limits.h"

namespace ls::cli {
namespace {

using testing::HasSubstr;

std::string error_of(const JobOptions& options) {
  const auto spec = options.parse();
  return spec ? "" : spec.error().message;
}

TEST(JobOptions, LeavesToTheSceneWhatIsNotGiven) {
  const auto spec = JobOptions{}.parse();

  ASSERT_TRUE(spec);
  EXPECT_EQ(*spec, JobSpec{});
}

TEST(JobOptions, TakesEveryOption) {
  JobOptions options;
  options.spp = "64";
  options.target_error = "1e-3";
  options.time = "2.5";
  options.seed = "18446744073709551615";
  options.size = "640x360";
  options.integrator = "path";
  options.defines = {"density=2", "path=a=b", "empty="};
  options.priority = "-3";
  options.float_output = true;
  options.max_workers = "4";
  options.max_units = "100";
  options.memory = "8G";
  options.numeric_class = "armv8-a";

  const auto spec = options.parse();

  ASSERT_TRUE(spec) << spec.error().message;
  EXPECT_EQ(spec->spp, 64u);
  EXPECT_EQ(spec->target_error, 1e-3);
  EXPECT_EQ(spec->time, 2.5);
  EXPECT_EQ(spec->seed, ~std::uint64_t{0});
  EXPECT_EQ(spec->size, (FrameSize{640, 360}));
  EXPECT_EQ(spec->integrator, "path");
  EXPECT_EQ(spec->defines,
            (std::map<std::string, std::string>{{"density", "2"}, {"path", "a=b"}, {"empty", ""}}));
  EXPECT_EQ(spec->priority, -3);
  EXPECT_TRUE(spec->float_output);
  EXPECT_EQ(spec->max_workers, 4u);
  EXPECT_EQ(spec->max_units, 100u);
  EXPECT_EQ(spec->memory, std::uint64_t{8} << 30);
  EXPECT_EQ(spec->numeric_class, "armv8-a");
}

TEST(JobOptions, NamesTheOptionAndWhatIsWrongWithIt) {
  for (const char* spp : {"0", "-1", "1e9", "64x", "", " 64", "99999999999999999999"}) {
    if (!*spp) continue;
    JobOptions options;
    options.spp = spp;
    EXPECT_THAT(error_of(options), testing::AllOf(HasSubstr("--spp"), HasSubstr(spp)));
  }
  for (const char* size :
       {"640", "x", "640x", "x360", "0x360", "640x-1", "640x360x2", "1.5x2", "70000x1", "65536x65536"}) {
    JobOptions options;
    options.size = size;
    EXPECT_THAT(error_of(options), testing::AllOf(HasSubstr("--size"), HasSubstr(size)));
  }
  for (const char* memory : {"0", "G", "8GB", "-1G", "1.5G", "9999999T"}) {
    JobOptions options;
    options.memory = memory;
    EXPECT_THAT(error_of(options), testing::AllOf(HasSubstr("--memory"), HasSubstr(memory)));
  }
  for (const char* time : {"0", "-2", "nan", "inf", "1e400", "2s", "31536001"}) {
    JobOptions options;
    options.time = time;
    EXPECT_THAT(error_of(options), testing::AllOf(HasSubstr("--time"), HasSubstr(time)));
  }
}

TEST(JobOptions, RefusesDefinesWithoutANameOrGivenTwice) {
  EXPECT_FALSE(parse_defines({"density"}));
  EXPECT_FALSE(parse_defines({"=2"}));
  EXPECT_FALSE(parse_defines({"a=1", "a=2"}));
}

TEST(JobOptions, CountsPixelsFromZero) {
  EXPECT_EQ(parse_pixel("0,7"), (std::pair(0, 7)));
  for (const char* wrong : {"1", "1,", ",1", "-1,2", "1,2,3", "a,b", "1 ,2"})
    EXPECT_FALSE(parse_pixel(wrong)) << wrong;
}

}  // namespace
}  // namespace ls::cli

#include "cli/output/job_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace ls::cli {
namespace {

using testing::HasSubstr;

using Command = JobOptions::Command;

// Returns what the command makes of these arguments.
Result<JobSpec> spec_of(std::vector<std::string> arguments, Command command = Command::submit) {
  CLI::App app;
  JobOptions options;
  options.add_to(app, command);
  std::reverse(arguments.begin(), arguments.end());  // as App::parse() wants them
  app.parse(arguments);
  return options.parse();
}

std::string error_of(std::vector<std::string> arguments) {
  const auto spec = spec_of(std::move(arguments));
  return spec ? "" : spec.error().message;
}

TEST(JobOptions, LeavesToTheSceneWhatIsNotGiven) {
  const auto spec = spec_of({});

  ASSERT_TRUE(spec);
  EXPECT_EQ(*spec, JobSpec{});
}

TEST(JobOptions, TakesEveryOption) {
  const auto spec = spec_of({"--spp",
                             "64",
                             "--target-error",
                             "1e-3",
                             "--time",
                             "2.5",
                             "--seed",
                             "18446744073709551615",
                             "--size",
                             "640x360",
                             "--integrator",
                             "path",
                             "-D",
                             "density=2",
                             "-Dpath=a=b",
                             "--define",
                             "empty=",
                             "--priority=-3",
                             "--float",
                             "--aov",
                             "depth,albedo",
                             "--aov=normal",
                             "--denoise",
                             "--max-workers",
                             "4",
                             "--max-units",
                             "100",
                             "--memory",
                             "8G",
                             "--tags",
                             "a,b",
                             "--numeric-class",
                             "armv8-a",
                             "--after",
                             "j-1,j-2",
                             "--frames",
                             "1-9x2",
                             "--target-layer=raw"});

  ASSERT_TRUE(spec) << spec.error().message;
  EXPECT_EQ(*spec, (JobSpec{.spp = 64,
                            .target_error = 1e-3,
                            .time = 2.5,
                            .seed = ~std::uint64_t{0},
                            .size = FrameSize{640, 360},
                            .integrator = "path",
                            .aov = {"depth", "albedo", "normal"},
                            .defines = {{"density", "2"}, {"path", "a=b"}, {"empty", ""}},
                            .priority = -3,
                            .float_output = true,
                            .denoise = true,
                            .tags = {"a", "b"},
                            .frames = FrameRange{1, 9, 2},
                            .max_workers = 4,
                            .max_units = 100,
                            .memory = std::uint64_t{8} << 30,
                            .numeric_class = "armv8-a",
                            .after = {"j-1", "j-2"}}));
}

TEST(JobOptions, CommandsHaveOnlyTheOptionsThatMakeSense) {
  EXPECT_TRUE(spec_of({"--size", "4x4"}, Command::render));
  EXPECT_THROW(spec_of({"--priority", "1"}, Command::render), CLI::ExtrasError);
  EXPECT_TRUE(spec_of({"--priority", "1"}, Command::again));
  EXPECT_THROW(spec_of({"--size", "4x4"}, Command::again), CLI::ExtrasError);
}

TEST(JobOptions, NamesTheOptionAndWhatIsWrongWithIt) {
  const struct {
    std::string option;
    std::vector<std::string> wrong;
  } kCases[] = {
      {"--spp", {"0", "-1", "1e9", "64x", " 64", "99999999999999999999"}},
      {"--size",
       {"640", "x", "640x", "x360", "0x360", "640x-1", "640x360x2", "1.5x2", "70000x1", "65536x65536"}},
      {"--memory", {"0", "G", "8GB", "-1G", "1.5G", "9999999T"}},
      {"--time", {"0", "-2", "nan", "inf", "1e400", "2s", "31536001"}},
      {"--frames", {"10-1", "a", "1-20000"}},
      {"--target-layer", {"clean"}},
      {"--aov", {"radiosity"}},
  };
  for (const auto& [option, wrong] : kCases)
    for (const std::string& text : wrong)
      EXPECT_THAT(error_of({option + "=" + text}), testing::AllOf(HasSubstr(option), HasSubstr(text)));
  EXPECT_THAT(error_of({"--frames=1-2", "-Dframe=3"}), HasSubstr("-D,--define"));
  EXPECT_THAT(error_of({"--target-layer=denoised"}), HasSubstr("--target-layer"));
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

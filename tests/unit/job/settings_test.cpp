#include "core/job/settings.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/job/limits.h"
#include "core/job/spec_draft.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

std::string spec_error(std::string_view json) {
  const auto got = parse_job_spec(json);
  return got ? "accepted" : got.error().message;
}

RenderSettings some_settings() {
  return {.size = {640, 480},
          .tile = 16,
          .seed = 18446744073709551615ull,
          .integrator = "volpath",
          .max_depth = 12,
          .rr_depth = 5,
          .aov = {"albedo", "depth"}};
}

TEST(RenderSettings, CanonicalJsonIsSortedAndWithoutSpaces) {
  EXPECT_EQ(
      canonical_json(some_settings()),
      R"({"aov":["albedo","depth"],"integrator":"volpath","max_depth":12,"rr_depth":5,"seed":18446744073709551615,)"
      R"("size":[640,480],"tile":16})");
}

TEST(RenderSettings, ParsesWhatItWrites) {
  EXPECT_EQ(parse_render_settings(canonical_json(some_settings())).value(), some_settings());
  EXPECT_EQ(digest_of(some_settings()), sha256(canonical_json(some_settings())));
}

TEST(RenderSettings, EveryFieldChangesTheDigest) {
  const auto changed = [](auto change) {
    RenderSettings s = some_settings();
    change(s);
    return digest_of(s) != digest_of(some_settings());
  };
  EXPECT_TRUE(changed([](RenderSettings& s) { s.size.width = 641; }));
  EXPECT_TRUE(changed([](RenderSettings& s) { s.tile = 32; }));
  EXPECT_TRUE(changed([](RenderSettings& s) { s.seed = 1; }));
  EXPECT_TRUE(changed([](RenderSettings& s) { s.integrator = "path"; }));
  EXPECT_TRUE(changed([](RenderSettings& s) { s.max_depth = -1; }));
  EXPECT_TRUE(changed([](RenderSettings& s) { s.rr_depth = 6; }));
  EXPECT_TRUE(changed([](RenderSettings& s) { s.aov.pop_back(); }));
  EXPECT_TRUE(changed([](RenderSettings& s) { s.light_groups = {"key"}; }));
}

TEST(RenderSettings, RefusesMissingUnknownAndOutOfRangeKeysByName) {
  const std::string good = canonical_json(some_settings());
  const auto with = [&](std::string_view from, std::string_view to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    const auto got = parse_render_settings(text);
    return got ? "accepted" : got.error().message;
  };
  EXPECT_THAT(with("\"seed\":18446744073709551615,", ""), HasSubstr("'seed' is missing"));
  EXPECT_THAT(with("\"tile\":16", "\"tile\":7"),
              HasSubstr("'tile' must be a whole number from 8 to 256, not 7"));
  EXPECT_THAT(with("\"tile\":16", "\"tile\":257"), HasSubstr("'tile'"));
  EXPECT_THAT(with("\"max_depth\":12", "\"max_depth\":-2"), HasSubstr("'max_depth'"));
  EXPECT_THAT(with("\"max_depth\"", "\"maxdepth\""),
              HasSubstr("'maxdepth' is not known; did you mean 'max_depth'"));
  EXPECT_THAT(with("[\"albedo\",\"depth\"]", "[\"depth\",\"albedo\"]"), HasSubstr("'aov' must be sorted"));
  EXPECT_THAT(with("[640,480]", "[0,480]"), HasSubstr("'size'"));
}

TEST(RenderSettings, HaveLightGroupsWithTheirLayersOnly) {
  RenderSettings s = some_settings();
  EXPECT_EQ(canonical_json(s).find("light_groups"), std::string::npos) << "digests of other jobs stay";
  const auto error = [&](std::vector<std::string> aov, std::vector<std::string> groups) {
    s.aov = std::move(aov);
    s.light_groups = std::move(groups);
    const auto got = parse_render_settings(canonical_json(s));
    if (got) EXPECT_EQ(*got, s);
    return got ? "" : got.error().message;
  };
  EXPECT_EQ(error({"depth", "light_groups"}, {"fill", "key", "other"}), "");
  EXPECT_EQ(aovs_of(s).groups(), 3u);
  EXPECT_THAT(error({"light_groups"}, {}),
              HasSubstr("'light_groups' must be given with AOVs of light groups"));
  EXPECT_THAT(error({"depth"}, {"key"}), HasSubstr("and only then"));
  EXPECT_THAT(error({"light_groups"}, {"key", "fill"}), HasSubstr("must be sorted"));
  EXPECT_THAT(error({"light_groups"}, {"key", "key"}), HasSubstr("each name once"));
  EXPECT_THAT(error({"light_groups"}, {"a.b"}), HasSubstr("a light group's name has"));
  std::vector<std::string> many;
  for (std::size_t i = 0; i <= kMostLightGroups; ++i) many.push_back(fmt::format("g{:02}", i));
  EXPECT_THAT(error({"light_groups"}, many), HasSubstr("at most 32 names"));
}

TEST(JobSpec, RefusesALossyCompressionOfAllLayersTogether) {
  for (const ExrCompression c : exr_compressions()) {
    EXPECT_EQ(job::check_spec({.exr_compression = c}).has_value(), !is_lossy(c)) << to_string(c);
    EXPECT_TRUE(job::check_spec({.exr_compression = c, .exr_parts = ExrParts::layers})) << to_string(c);
  }
  EXPECT_THAT(job::check_spec({.exr_compression = ExrCompression::dwaa}).error().message,
              HasSubstr("'exr_compression' is dwaa, which in one part would also change standard errors"));
}

TEST(JobSpec, EmptyObjectRequestsNothing) { EXPECT_EQ(parse_job_spec("{}").value(), JobSpec{}); }

TEST(JobSpec, ReadsEveryKeyOfTheContract) {
  const auto spec =
      parse_job_spec(R"({"spp": 128, "target_error": 0.001, "time": 60, "seed": 7, "size": [320, 200],
    "integrator": "volpath", "aov": ["depth"], "defines": {"density": "2.5", "n": 3, "on": true}, "priority": -2, "float": true,
    "color_space": "aces2065-1", "exr_compression": "dwab", "exr_parts": "layers", "fps": 23.976,
    "tags": ["gpu", "big-memory"], "max_workers": 4, "max_units": 100, "memory": 8589934592, "numeric_class": "armv8-a",
    "after": ["j-1", "j-2-frame3"]})");

  ASSERT_TRUE(spec) << spec.error().message;
  EXPECT_EQ(*spec, (JobSpec{.spp = 128,
                            .target_error = 0.001,
                            .time = 60,
                            .seed = 7,
                            .size = FrameSize{320, 200},
                            .integrator = "volpath",
                            .aov = {"depth"},
                            .defines = {{"density", "2.5"}, {"n", "3"}, {"on", "true"}},
                            .priority = -2,
                            .float_output = true,
                            .colour_space = ColourSpace::aces2065_1,
                            .exr_compression = ExrCompression::dwab,
                            .exr_parts = ExrParts::layers,
                            .tags = {"gpu", "big-memory"},
                            .fps = 23.976,
                            .max_workers = 4,
                            .max_units = 100,
                            .memory = 8589934592,
                            .numeric_class = "armv8-a",
                            .after = {"j-1", "j-2-frame3"}}));
  EXPECT_EQ(parse_job_spec(canonical_json(*spec)).value(), *spec);
}

// Stored jobs and digests depend on each byte of this text.
TEST(JobSpec, CanonicalJsonHasFiveKeysAndThoseThatAreSet) {
  EXPECT_EQ(canonical_json(JobSpec{}), R"({"aov":[],"defines":{},"float":false,"priority":0,"tags":[]})");
  const std::string digest(64, 'a');
  const JobSpec all{.spp = 8,
                    .target_error = 0.1,
                    .target_layer = TargetLayer::denoised,
                    .time = 2,
                    .seed = 18446744073709551615ull,
                    .size = FrameSize{320, 200},
                    .integrator = "path",
                    .aov = {"depth"},
                    .defines = {{"a", "1"}},
                    .priority = -2,
                    .float_output = true,
                    .denoise = true,
                    .tags = {"gpu"},
                    .frames = FrameRange{1, 1, 1},
                    .max_workers = 4,
                    .max_units = 5,
                    .memory = 6,
                    .numeric_class = "armv8-a",
                    .after = {"j-1"},
                    .reference = Digest::parse(digest)};
  EXPECT_EQ(
      canonical_json(all),
      R"({"after":["j-1"],"aov":["depth"],"defines":{"a":"1"},"denoise":true,"float":true,"frames":"1",)"
      R"("integrator":"path","max_units":5,"max_workers":4,"memory":6,"numeric_class":"armv8-a",)"
      R"("priority":-2,"reference":")" +
          digest +
          R"(","seed":18446744073709551615,"size":[320,200],"spp":8,"tags":["gpu"],"target_error":0.1,)"
          R"("target_layer":"denoised","time":2.0})");
}

TEST(JobSpec, TargetOfTheDenoisedLayersTurnsOnDenoise) {
  const JobSpec spec = parse_job_spec(R"({"target_error":0.1,"target_layer":"denoised"})").value();
  EXPECT_EQ(spec.target_layer, TargetLayer::denoised);
  EXPECT_TRUE(spec.denoise);
  EXPECT_EQ(parse_job_spec(canonical_json(spec)).value(), spec);
  const JobSpec raw = parse_job_spec(R"({"target_error":0.1,"target_layer":"raw"})").value();
  EXPECT_EQ(raw, parse_job_spec(R"({"target_error":0.1})").value());
  EXPECT_FALSE(raw.denoise);
  EXPECT_THAT(spec_error(R"({"target_layer":"clean"})"), HasSubstr("'target_layer' must be \"raw\" or"));
  EXPECT_THAT(spec_error(R"({"target_layer":"denoised","denoise":false})"), HasSubstr("'denoise' is false"));
}

TEST(JobSpec, AcceptsTheSizeInBothForms) {
  EXPECT_EQ(parse_job_spec(R"({"size": "1920x1080"})")->size, (FrameSize{1920, 1080}));
  EXPECT_EQ(parse_job_spec(R"({"size": [1920, 1080]})")->size, (FrameSize{1920, 1080}));
  for (const char* bad :
       {R"({"size": "1920"})", R"({"size": "1920x"})", R"({"size": "x1080"})", R"({"size": "1920x1080x3"})",
        R"({"size": "1920 x 1080"})", R"({"size": [1920]})", R"({"size": [1920.5, 3]})", R"({"size": {}})"})
    EXPECT_THAT(spec_error(bad), HasSubstr("'size' must be [width, height]")) << bad;
}

TEST(JobSpec, RefusesImpossibleSizesNamingTheLimit) {
  for (const char* bad : {R"({"size": [0, 10]})", R"({"size": "10x-1"})", R"({"size": [32769, 1]})",
                          R"({"size": "32768x32768"})", R"({"size": [18446744073709551615, 2]})"})
    EXPECT_THAT(spec_error(bad), HasSubstr("32768")) << bad;
  EXPECT_EQ(spec_error(R"({"size": [32768, 2048]})"), "accepted");  // 2^26 pixels
}

TEST(JobSpec, NamesTheKeyThatIsWrong) {
  EXPECT_THAT(spec_error(R"({"sp": 1})"), HasSubstr("spec: 'sp' is not known; did you mean 'spp'"));
  EXPECT_THAT(spec_error(R"({"spp": 0})"),
              HasSubstr("'spp' must be a whole number from 1 to 16777216, not 0"));
  EXPECT_THAT(spec_error(R"({"spp": 2147483649})"), HasSubstr("'spp'"));
  EXPECT_THAT(spec_error(R"({"spp": -1})"), HasSubstr("'spp'"));
  EXPECT_THAT(spec_error(R"({"spp": 1.5})"), HasSubstr("'spp'"));
  EXPECT_THAT(spec_error(R"({"spp": "64"})"), HasSubstr("not \"64\""));
  EXPECT_THAT(spec_error(R"({"spp": null})"), HasSubstr("'spp'"));
  EXPECT_THAT(spec_error(R"({"target_error": 0})"), HasSubstr("'target_error'"));
  EXPECT_THAT(spec_error(R"({"time": -3})"), HasSubstr("'time'"));
  EXPECT_EQ(spec_error(R"({"time": 31536000})"), "accepted");  // a year
  EXPECT_THAT(spec_error(R"({"time": 31536001})"), HasSubstr("'time'"));
  EXPECT_THAT(spec_error(R"({"seed": 18446744073709551616})"), HasSubstr("'seed'"));
  EXPECT_THAT(spec_error(R"({"integrator": ""})"), HasSubstr("'integrator'"));
  EXPECT_THAT(spec_error(R"({"integrator": "../x"})"), HasSubstr("'integrator'"));
  EXPECT_THAT(spec_error(R"({"aov": "depth"})"), HasSubstr("'aov'"));
  EXPECT_THAT(spec_error(R"({"defines": {"a": []}})"), HasSubstr("'a'"));
  EXPECT_THAT(spec_error(R"({"priority": 1e3})"), HasSubstr("'priority'"));
  EXPECT_THAT(spec_error(R"({"priority": 18446744073709551615})"), HasSubstr("'priority'"));
  EXPECT_THAT(spec_error(R"({"float": 1})"), HasSubstr("'float'"));
  EXPECT_THAT(spec_error(R"({"tags": [1]})"), HasSubstr("'tags'"));
  EXPECT_THAT(spec_error(R"({"max_workers": 0})"),
              HasSubstr("'max_workers' must be a whole number from 1 to"));
  EXPECT_THAT(spec_error(R"({"max_units": 1000001})"), HasSubstr("'max_units'"));
  EXPECT_THAT(spec_error(R"({"memory": "8G"})"), HasSubstr("'memory'"));
}

TEST(JobSpec, RefusesAnythingButOneObject) {
  EXPECT_THAT(spec_error(""), HasSubstr("not valid JSON"));
  EXPECT_THAT(spec_error("[]"), HasSubstr("must be a JSON object"));
  EXPECT_THAT(spec_error(R"({"spp": 1, "spp": 2})"), HasSubstr("'spp' is given twice"));
  EXPECT_THAT(spec_error(R"({"defines": {"a": 1, "a": 2}})"), HasSubstr("'a' is given twice"));
  EXPECT_THAT(spec_error(R"({"spp": 1} x)"), HasSubstr("not valid JSON"));
  EXPECT_THAT(spec_error("{\"tags\": [\"\xff\"]}"), HasSubstr("not valid JSON"));
  EXPECT_THAT(spec_error(std::string(kMaxSpecBytes, '[')), HasSubstr("not valid JSON"));
  const std::string deep = std::string(400'000, '[') + std::string(400'000, ']');
  EXPECT_THAT(spec_error("{\"spp\": " + deep + "}"), HasSubstr("nested deeper"));
  EXPECT_THAT(spec_error(std::string(kMaxSpecBytes + 1, ' ')), HasSubstr("limit"));
}

TEST(JobSpec, MessagesStayShortAndPrintable) {
  const std::string longest(100'000, 'x');
  for (const std::string& bad :
       {"{\"" + longest + "\": 1}", "{\"spp\": \"" + longest + "\"}", "{\"spp\": \"" + longest,
        std::string("{\"\xc3\xa9\x01\": 1}"), std::string("{\"\xc3\xa9\": 1}")}) {
    const std::string message = spec_error(bad);
    EXPECT_LT(message.size(), 500u);
    for (const char c : message) EXPECT_TRUE(c >= ' ' && c <= '~');
  }
}

TEST(JobSpec, HasOneCheckOfARangeForAllFormsOfAValue) {
  const auto query_error = [](std::string_view key, std::string_view text) {
    job::SpecDraft draft(job::Form::query);
    const auto done = draft.add(key, text);
    return done ? "accepted" : done.error().message;
  };
  const auto option_error = [](std::string_view key, std::string_view text) {
    job::SpecDraft draft(job::Form::option);
    const auto done = draft.add(key, text);
    return done ? "accepted" : done.error().message;
  };
  const std::string rule = " must be a whole number from -1000000 to 1000000, not 1000001";

  EXPECT_EQ(spec_error(R"({"priority": 1000001})"), "spec: 'priority'" + rule);
  EXPECT_EQ(query_error("priority", "1000001"), "query parameter 'priority'" + rule);
  EXPECT_EQ(option_error("priority", "1000001"), "--priority" + rule);
  EXPECT_EQ(job::check_spec(JobSpec{.priority = 1000001}).error().message, "spec: 'priority'" + rule);
  EXPECT_TRUE(job::check_spec(JobSpec{.priority = -1000000}));
}

TEST(SpecDraft, TakesASettingOnceAndDefinitionsOneByOne) {
  job::SpecDraft draft(job::Form::query);

  EXPECT_EQ(draft.add("define", "a=1"), true);
  EXPECT_EQ(draft.add("define", "b="), true);
  EXPECT_FALSE(draft.add("define", "a=2"));
  EXPECT_EQ(draft.add("spp", "4"), true);
  EXPECT_FALSE(draft.add("spp", "4"));
  EXPECT_EQ(draft.add("sp", "4"), false) << "there is no such parameter";
  EXPECT_EQ(draft.add("defines", "c=1"), false) << "the name in JSON";
}

TEST(SpecDraft, TakesUnitsOfBytesFromOptionsOnly) {
  job::SpecDraft option(job::Form::option), query(job::Form::query);

  EXPECT_EQ(option.add("memory", "8G"), true);
  EXPECT_EQ(option.finish()->memory, std::uint64_t{8} << 30);
  EXPECT_FALSE(query.add("memory", "8G"));
  for (const char* wrong : {"0", "G", "", "8GB", "-1G", "1.5G", "9999999T", "18014398509481984K"})
    EXPECT_FALSE(job::SpecDraft(job::Form::option).add("memory", wrong)) << wrong;
}

TEST(JobSize, IsBoundedWithAdvice) {
  const RenderSettings small{.size = {32, 32}, .tile = 32, .integrator = "volpath"};
  RenderSettings large = small;
  large.size = {1920, 1080};

  EXPECT_TRUE(check_job_size(small, kMaxSpp));
  EXPECT_THAT(check_job_size(large, kMaxSpp).error().message, HasSubstr("ask for fewer samples"));
  EXPECT_FALSE(check_job_size(small, 0));
  EXPECT_FALSE(check_job_size(small, kMaxSpp + 1));
  large.size = {32768, 32768};
  EXPECT_FALSE(check_job_size(large, 1));
  large.size = {0, 7};
  EXPECT_FALSE(check_job_size(large, 1));
  large.size = {8192, 8192};
  large.tile = 8;
  EXPECT_THAT(check_job_size(large, 8192).error().message, HasSubstr("larger tiles"));
}

TEST(SpecDraft, QueryTextMustBeUtf8) {
  job::SpecDraft draft(job::Form::query);
  const auto added = draft.add("define", "a\xFF=1");
  ASSERT_FALSE(added);
  EXPECT_THAT(added.error().message, HasSubstr("UTF-8"));
}

TEST(SpecDraft, LimitsHoldForQueryAndArchiveTogether) {
  nlohmann::json defines = nlohmann::json::object();
  for (std::size_t i = 0; i < kMaxDefines; ++i) defines["n" + std::to_string(i)] = "1";
  job::SpecDraft many(job::Form::query);
  ASSERT_TRUE(many.add("define", "x=1"));
  ASSERT_TRUE(many.add(nlohmann::json{{"defines", defines}}));
  EXPECT_FALSE(many.finish());

  job::SpecDraft large(job::Form::query);
  const std::string value(kMaxDefineBytes, 'a');
  for (std::size_t i = 0; i * kMaxDefineBytes <= kMaxSpecBytes; ++i)
    ASSERT_TRUE(large.add("define", "n" + std::to_string(i) + "=" + value));
  EXPECT_FALSE(large.finish());
}

}  // namespace
}  // namespace ls

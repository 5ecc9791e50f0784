// Jobs that ask for a deep image.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/admission/admission.h"
#include "core/image/film/partial_size.h"
#include "core/job/settings.h"
#include "formats/read.h"
#include "tests/unit/service/fake_farm.h"
#include "util/protocol/limits.h"

namespace ls::coordinator {
namespace {

using testing::HasSubstr;

constexpr const char* kDeepScene =
    "<scene version=\"3.0.0\"><integrator type=\"volpath\"/><sensor type=\"perspective\"/>"
    "<shape type=\"sphere\"/></scene>";
constexpr const char* kMeasuringScene =
    "<scene version=\"3.0.0\"><integrator type=\"volpath\"/><emitter type=\"constant\"/>"
    "<sensor type=\"irradiancemeter\"><string name=\"points\" value=\"0 0 0 0 0 1\"/></sensor></scene>";

class DeepJobs : public testing::Test {
 protected:
  Result<StoredJob> job(const JobSpec& spec, const char* scene = kDeepScene) {
    auto taken = admit({"a.xml", scene, {}, spec}, coordinator_->blobs(), scenes_in_this_process());
    if (!taken) return tl::unexpected(taken.error().error);
    return taken->job;
  }
  decltype(open_at({})) coordinator_ = open_at({});
};

TEST_F(DeepJobs, HaveTheSlicesThatAreAskedFor) {
  const auto deep = job({.spp = 4, .deep = 16, .deep_alpha = true});
  ASSERT_TRUE(deep) << deep.error().message;
  EXPECT_EQ(deep->settings.deep, 16);
  EXPECT_EQ(aovs_of(deep->settings).deep(), (DeepSlices{16, false}));
  const auto back = parse_render_settings(canonical_json(deep->settings));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(*back, deep->settings);
}

TEST_F(DeepJobs, WithoutSlicesHaveTheSettingsThatTheyHad) {
  const auto plain = job({.spp = 4});
  EXPECT_EQ(canonical_json(plain->settings).find("deep"), std::string::npos);
  EXPECT_EQ(canonical_json(plain->spec).find("deep"), std::string::npos);
}

TEST_F(DeepJobs, HaveTilesWhoseResultsFitIntoAMessage) {
  std::vector<std::string> all;
  for (const AovRow& row : aov_rows()) all.emplace_back(row.name);
  const auto large = job({.spp = 4, .aov = all, .deep = static_cast<int>(kMostDeepSlices)});
  ASSERT_TRUE(large) << large.error().message;
  EXPECT_LE(most_partial_file_bytes(static_cast<std::uint64_t>(large->settings.tile * large->settings.tile),
                                    aovs_of(large->settings)),
            ls::limits::kPartialBytes);
}

// Answers about images wait for their memory (coordinator/base/gate.h), of which a deep film takes most: 40
// bytes for each slice and pixel.
TEST_F(DeepJobs, CountTheirSlicesAsMemoryOfAnswers) {
  const auto bytes = [&](const JobSpec& spec, std::uint64_t more) {
    const auto id = coordinator_->submit({"a.xml", kDeepScene, {}, spec});
    return id ? coordinator_->picture_bytes(*id, more) : 0;
  };
  const FrameSize size{64, 32};
  const std::uint64_t plain = bytes({.spp = 4, .size = size}, 32),
                      deep = bytes({.spp = 4, .size = size, .deep = 16}, 32);

  EXPECT_GE(plain, 32 * size.pixels());
  EXPECT_GE(deep, plain + 16 * 40 * size.pixels());
  EXPECT_EQ(bytes({.spp = 4, .size = size}, 33), plain + size.pixels());
  EXPECT_EQ(coordinator_->picture_bytes(JobId{"j-none"}, 32), 0u);
}

TEST_F(DeepJobs, AreRefusedIfTheirFilmIsTooLarge) {
  const auto large = job({.spp = 4, .size = FrameSize{3840, 2160}, .deep = 64});
  ASSERT_FALSE(large);
  EXPECT_THAT(large.error().message, HasSubstr("64 slices of a deep image"));
  EXPECT_THAT(large.error().message, HasSubstr("fewer slices or a smaller frame"));
  EXPECT_TRUE(job({.spp = 4, .size = FrameSize{1920, 1080}, .deep = 64}));
}

TEST_F(DeepJobs, AreRefusedWithNumbersThatCannotBe) {
  for (const int slices : {-1, 65})
    EXPECT_THAT(job({.spp = 4, .deep = slices}).error().message, HasSubstr("deep")) << slices;
  EXPECT_THAT(job({.spp = 4, .deep_alpha = true}).error().message, HasSubstr("give deep, too"));
  for (const char* json :
       {R"("deep":65)", R"("deep":-1)", R"("deep_alpha":true)", R"("deep":8,"meters":2)"}) {
    std::string text = canonical_json(job({.spp = 4})->settings);
    text.insert(1, std::string(json) + ",");
    EXPECT_FALSE(parse_render_settings(text)) << json;
  }
}

TEST_F(DeepJobs, MeasureNothing) {
  const auto measuring = job({.spp = 4, .deep = 4}, kMeasuringScene);
  ASSERT_FALSE(measuring);
  EXPECT_THAT(measuring.error().message, HasSubstr("no deep image: leave deep out"));
  EXPECT_TRUE(job({.spp = 4}, kMeasuringScene));
}

TEST_F(DeepJobs, CanBeMadeOfJobsThatHadNone) {
  const auto first =
      admit({"a.xml", kDeepScene, {}, {.spp = 4}}, coordinator_->blobs(), scenes_in_this_process());
  ASSERT_TRUE(first);
  ASSERT_TRUE(coordinator_->blobs().put(first->job.scene, std::as_bytes(std::span(first->scene_json))));
  const auto again = admit_again(first->job, {.deep = 8}, coordinator_->blobs());
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->job.settings.deep, 8);
  EXPECT_EQ(again->job.spec.deep, 8u);
  const auto without = admit_again(again->job, {.deep = 0}, coordinator_->blobs());
  ASSERT_TRUE(without) << without.error().message;
  EXPECT_EQ(without->job.settings.deep, 0);
  EXPECT_EQ(aovs_of(without->job.settings).deep().count, 0u);
}

}  // namespace
}  // namespace ls::coordinator

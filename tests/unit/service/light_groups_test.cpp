// A job that asks for light groups gets those of its scene.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/admission/admission.h"
#include "core/image/film/partial_size.h"
#include "core/scene/json/serialize.h"
#include "formats/read.h"
#include "tests/unit/service/fake_farm.h"
#include "util/protocol/limits.h"

namespace ls::coordinator {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string lamp(const std::string& group) {
  return "<emitter type=\"point\">" +
         (group.empty() ? "" : "<string name=\"light_group\" value=\"" + group + "\"/>") + "</emitter>";
}
std::string scene_of(const std::string& lights) {
  return "<scene version=\"3.0.0\"><integrator type=\"volpath\"/><sensor type=\"perspective\"/>"
         "<shape type=\"sphere\"/>" +
         lights + "</scene>";
}

class LightGroupJobs : public testing::Test {
 protected:
  Result<RenderSettings> settings(const std::string& lights, std::vector<std::string> aov,
                                  const std::string& scene = "") {
    JobSpec spec;
    spec.spp = 4;
    spec.aov = std::move(aov);
    auto taken = admit({"a.xml", scene.empty() ? scene_of(lights) : scene, {}, spec}, coordinator_->blobs(),
                       scenes_in_this_process());
    if (!taken) return tl::unexpected(taken.error().error);
    return taken->job.settings;
  }
  decltype(open_at({})) coordinator_ = open_at({});
};

TEST_F(LightGroupJobs, HaveTheGroupsOfTheScene) {
  EXPECT_THAT(settings(lamp("key") + lamp("fill") + lamp("key"), {"light_groups"})->light_groups,
              ElementsAre("fill", "key"));
  EXPECT_THAT(settings(lamp("key") + lamp("") + lamp("other"), {"light_groups"})->light_groups,
              ElementsAre("key", "other"));
  EXPECT_THAT(settings("", {"light_groups"})->light_groups, ElementsAre("other"));
  EXPECT_THAT(settings(lamp("key"), {"depth"})->light_groups, IsEmpty());
}

TEST_F(LightGroupJobs, HaveTheWholeOfAGroupWithItsVolumes) {
  EXPECT_THAT(settings(lamp("key"), {"volume_light_groups"})->aov,
              ElementsAre("light_groups", "volume_light_groups"));
}

TEST_F(LightGroupJobs, OfMediaCountWhereTheyGlow) {
  const auto fog = [](const std::string& light) {
    return scene_of(
        lamp("key") +
        "<shape type=\"cube\"><bsdf type=\"null\"/><medium name=\"interior\" type=\"homogeneous\">"
        "<string name=\"light_group\" value=\"fire\"/>" +
        light + "</medium></shape>");
  };
  EXPECT_THAT(settings("", {"light_groups"}, fog(""))->light_groups, ElementsAre("key"));
  EXPECT_THAT(settings("", {"light_groups"}, fog("<rgb name=\"emission\" value=\"1\"/>"))->light_groups,
              ElementsAre("fire", "key"));
}

TEST_F(LightGroupJobs, WithLargeResultsHaveSmallerTiles) {
  std::string lights;
  for (std::size_t i = 0; i < kMostLightGroups; ++i) lights += lamp("g" + std::to_string(i));
  std::vector<std::string> all;
  for (const AovRow& row : aov_rows()) all.emplace_back(row.name);
  const auto fits = [](const RenderSettings& s) {
    return most_partial_file_bytes(static_cast<std::uint64_t>(s.tile * s.tile), aovs_of(s)) <=
           ls::limits::kPartialBytes;
  };
  EXPECT_EQ(settings(lights, {"light_groups"})->tile, 32) << "as of jobs without groups";
  for (const auto& aov : {std::vector<std::string>{"volume_light_groups"}, all}) {
    const RenderSettings large = settings(lights, aov).value();
    EXPECT_EQ(large.tile, 16);
    EXPECT_TRUE(fits(large));
  }
}

TEST_F(LightGroupJobs, AreRefusedBeyondTheLimit) {
  std::string lights;
  for (std::size_t i = 0; i < kMostLightGroups; ++i) lights += lamp("g" + std::to_string(i));
  EXPECT_EQ(settings(lights, {"light_groups"})->light_groups.size(), kMostLightGroups);
  lights += lamp("");
  EXPECT_THAT(settings(lights, {"light_groups"}).error().message,
              HasSubstr("the scene has 33 light groups; layers can have at most 32"));
  EXPECT_TRUE(settings(lights, {})) << "without layers";
}

TEST_F(LightGroupJobs, MayHaveOtherFactors) {
  const auto scene = [&](std::optional<std::string> mix) {
    JobSpec spec;
    spec.spp = 4;
    if (mix) spec.mix = parse_light_mix(*mix).value();
    auto taken = admit({"a.xml", scene_of(lamp("key") + lamp("")), {}, spec}, coordinator_->blobs(),
                       scenes_in_this_process());
    if (!taken) return taken.error().error.message;
    const auto read = deserialize_scene(taken->scene_json).value();
    std::string all;
    for (const Emitter& e : read.emitters)
      all += fmt::format("{};", fmt::join(std::get<PointEmitter>(e).intensity, " "));
    return all;
  };
  EXPECT_EQ(scene({}), "1 1 1;1 1 1;");
  EXPECT_EQ(scene("key=2,other=0.5:1:4"), "2 2 2;0.5 1 4;");
  EXPECT_EQ(scene("key=0"), "1 1 1;") << "a lamp that is off is left out";
  EXPECT_THAT(scene("rim=2"), HasSubstr("the scene has no light group \"rim\"; it has key, other"));
  EXPECT_THAT(scene("key.volume=2"), HasSubstr("only a finished image can be mixed so"));
}

TEST_F(LightGroupJobs, AreMixedAgainOnTopOfTheirMix) {
  JobSpec spec;
  spec.spp = 4;
  spec.aov = {"light_groups"};
  spec.mix = parse_light_mix("key=2").value();
  auto first = admit({"a.xml", scene_of(lamp("key") + lamp("")), {}, spec}, coordinator_->blobs(),
                     scenes_in_this_process());
  ASSERT_TRUE(first);
  ASSERT_TRUE(coordinator_->blobs().put(first->job.scene, std::as_bytes(std::span(first->scene_json))));
  JobSpec changes;
  EXPECT_TRUE(admit_again(first->job, changes, coordinator_->blobs())->scene_json.empty());
  changes.mix = parse_light_mix("key=3,other=4").value();

  const auto again = admit_again(first->job, changes, coordinator_->blobs());

  ASSERT_TRUE(again) << again.error().message;
  const auto scene = deserialize_scene(again->scene_json).value();
  EXPECT_EQ(std::get<PointEmitter>(scene.emitters[0]).intensity, (Rgb{6, 6, 6}));
  EXPECT_EQ(std::get<PointEmitter>(scene.emitters[1]).intensity, (Rgb{4, 4, 4}));
  EXPECT_EQ(to_string(*again->job.spec.mix), "key=6,other=4") << "as `submit --mix` would make it";
  EXPECT_EQ(again->job.scene, sha256(again->scene_json));
  EXPECT_NE(again->job.scene, first->job.scene);
  changes.mix = parse_light_mix("rim=3").value();
  EXPECT_THAT(admit_again(first->job, changes, coordinator_->blobs()).error().message,
              HasSubstr("no light group \"rim\""));
}

}  // namespace
}  // namespace ls::coordinator

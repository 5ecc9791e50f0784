// A job that asks for light groups gets those of its scene.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/admission/admission.h"
#include "formats/read.h"
#include "tests/unit/service/fake_farm.h"

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
    return scene_of(lamp("key") +
                    "<shape type=\"cube\"><bsdf type=\"null\"/><medium name=\"interior\" type=\"homogeneous\">"
                    "<string name=\"light_group\" value=\"fire\"/>" +
                    light + "</medium></shape>");
  };
  EXPECT_THAT(settings("", {"light_groups"}, fog(""))->light_groups, ElementsAre("key"));
  EXPECT_THAT(settings("", {"light_groups"}, fog("<rgb name=\"emission\" value=\"1\"/>"))->light_groups,
              ElementsAre("fire", "key"));
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

}  // namespace
}  // namespace ls::coordinator

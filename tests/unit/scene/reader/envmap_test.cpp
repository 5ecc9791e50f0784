// Environment maps in scene files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

std::string sky(const std::string& inside, const std::string& file = "wood.png") {
  return "<emitter type=\"envmap\"><string name=\"filename\" value=\"" + file + "\"/>" + inside +
         "</emitter>";
}

TEST(EnvmapScenes, AreReadWithFileScaleAndTransform) {
  const Scene s = must_read(
      with_sensor(sky("<float name=\"scale\" value=\"0.4\"/><transform name=\"to_world\"><rotate y=\"1\" "
                      "angle=\"90\"/></transform>")));

  ASSERT_EQ(s.emitters.size(), 1u);
  const auto& e = std::get<EnvmapEmitter>(s.emitters[0]);
  EXPECT_EQ(s.assets.at(e.file.value).name, "wood.png");
  EXPECT_EQ(e.scale, .4);
  EXPECT_NEAR(e.to_world.m[2], 1, 1e-15) << "z becomes x";
  EXPECT_EQ(deserialize_scene(serialize(s)).value(), s);
}

TEST(EnvmapScenes, DefaultsAreScaleOneAndNoTurn) {
  const Scene s = must_read(with_sensor(sky("")));
  const auto& e = std::get<EnvmapEmitter>(s.emitters.at(0));
  EXPECT_EQ(e.scale, 1);
  EXPECT_EQ(e.to_world, Transform{});
}

TEST(EnvmapScenes, AMapMayBeASquareOfEqualAreas) {
  const Scene s = must_read(with_sensor(sky("<string name=\"mapping\" value=\"equal_area\"/>")));
  EXPECT_EQ(std::get<EnvmapEmitter>(s.emitters.at(0)).mapping, SkyMapping::equal_area);
  EXPECT_EQ(deserialize_scene(serialize(s)).value(), s);
  const auto wrong = read(with_sensor(sky("<string name=\"mapping\" value=\"cube\"/>")));
  EXPECT_FALSE(wrong.scene);
  EXPECT_THAT(messages(wrong), HasSubstr("latlong"));
}

TEST(EnvmapScenes, OldFilesMayTurnThemByToWorld) {
  const Scene s = must_read(
      "<scene version=\"0.6.0\"><emitter type=\"envmap\"><transform name=\"toWorld\"><matrix "
      "value=\"-4.37114e-008 "
      "0 1 0 0 1 0 0 -1 0 -4.37114e-008 0 0 0 0 1\"/></transform><string name=\"filename\" "
      "value=\"wood.png\"/></emitter>" +
      kSensor + "</scene>");
  EXPECT_EQ(std::get<EnvmapEmitter>(s.emitters.at(0)).to_world.m[2], 1);
}

TEST(EnvmapScenes, WhatSteersOnlySamplingIsAWarning) {
  const auto r = read(with_sensor(sky("<boolean name=\"mis_compensation\" value=\"true\"/>")));
  ASSERT_TRUE(r.scene);
  EXPECT_THAT(messages(r), HasSubstr("'mis_compensation' of emitter \"envmap\" has no effect here"));
}

TEST(EnvmapScenes, WhatIsWrongIsTold) {
  const auto said = [](const std::string& objects) {
    const auto r = read(with_sensor(objects));
    return r.scene ? "accepted" : messages(r);
  };
  EXPECT_THAT(said("<emitter type=\"envmap\"/>"), HasSubstr("filename"));
  EXPECT_THAT(said(sky("", "nowhere.exr")), HasSubstr("nowhere.exr"));
  EXPECT_THAT(said(sky("<float name=\"scale\" value=\"-1\"/>")), HasSubstr("scale"));
  EXPECT_THAT(said(sky("<float name=\"scael\" value=\"1\"/>")), HasSubstr("did you mean 'scale'?"));
  EXPECT_THAT(said(sky("<transform name=\"to_world\"><scale x=\"2\"/></transform>")),
              HasSubstr("may turn and mirror"));
  EXPECT_THAT(said(sky("<transform name=\"to_world\"><scale value=\"0\"/></transform>")),
              HasSubstr("may turn and mirror"));
  EXPECT_EQ(said(sky("<transform name=\"to_world\"><scale x=\"-1\"/></transform>")), "accepted");
}

TEST(EnvmapScenes, ASceneHasOneEnvironmentAtMost) {
  for (const std::string& two : {sky("") + sky(""), sky("") + "<emitter type=\"constant\"/>",
                                 "<emitter type=\"constant\"/>" + sky("")}) {
    const auto r = read(with_sensor(two));
    EXPECT_FALSE(r.scene);
    EXPECT_THAT(messages(r),
                HasSubstr("a second environment: a scene has one emitter \"constant\" or \"envmap\""));
  }
}

}  // namespace
}  // namespace ls

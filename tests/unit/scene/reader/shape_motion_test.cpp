// Shapes and instances that move: the animations of their files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/analysis/needs.h"
#include "core/scene/analysis/prune.h"
#include "core/scene/json/serialize.h"
#include "core/scene/limits.h"
#include "core/scene/motion.h"
#include "core/scene/transform.h"
#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

const std::string kShutter =
    R"(<float name="shutter_open" value="0.25"/><float name="shutter_close" value="0.75"/>)";
// The content begins in line 2, and the sensor is last: what moves is placed when it has been read.
std::string scene_with(const std::string& content, const std::string& shutter = kShutter) {
  return "<scene version=\"3.0.0\">\n" + content + "\n<sensor type=\"perspective\">" + shutter +
         "</sensor>\n</scene>\n";
}
std::string key(std::string_view time, std::string_view steps) {
  return fmt::format("<transform time=\"{}\">{}</transform>\n", time, steps);
}
std::string animation(const std::string& keys) {
  return "<animation name=\"to_world\">\n" + keys + "</animation>\n";
}
const std::string kAside = animation(key("0", "") + key("1", "<translate x=\"2\"/>"));
std::string shape(std::string_view type, const std::string& inner) {
  return fmt::format("<shape type=\"{}\">\n{}</shape>", type, inner);
}

TEST(ShapeAnimation, IsCutToTheExposureOfTheCamera) {
  for (const char* type : {"rectangle", "cube", "sphere", "disk", "cylinder"}) {
    const Scene s = must_read(scene_with(shape(type, kAside)));

    const Shape& moving = s.shapes.at(0);
    ASSERT_EQ(moving.motion.size(), 2u) << type;
    EXPECT_EQ(moving.motion[0].time, 0);
    EXPECT_EQ(origin_of(moving.motion[0].to_world), (Vec3{{.5, 0, 0}}));
    EXPECT_EQ(moving.motion[1].time, 1);
    EXPECT_EQ(origin_of(moving.motion[1].to_world), (Vec3{{1.5, 0, 0}}));
    EXPECT_EQ(moving.to_world.m[3], 1);  // in the middle of the exposure
    EXPECT_EQ(s.sensor.shutter_open, 0);
    EXPECT_EQ(s.sensor.shutter_close, 1);
    EXPECT_TRUE(s.sensor.motion.empty());
    EXPECT_EQ(scene::needs_of(s, true).moving_shapes, 1u);
  }
}

TEST(ShapeAnimation, OfInstancesIsRead) {
  const std::string group = R"(<shape type="shapegroup" id="g"><shape type="cube"/></shape>)";
  const Scene s = must_read(scene_with(group + shape("instance", "<ref id=\"g\"/>" + kAside)));
  EXPECT_EQ(s.instances.at(0).motion.size(), 2u);
  EXPECT_EQ(s.instances.at(0).to_world.m[3], 1);
  EXPECT_EQ(s.sensor.shutter_close, 1);
}

TEST(ShapeAnimation, ThatHoldsDuringTheExposureIsThatOfAStillShape) {
  const std::string still = "<transform name=\"to_world\"><translate x=\"1\"/></transform>";
  const Scene wanted = must_read(scene_with(shape("cube", still)));
  const std::string pose = "<translate x=\"1\"/>";
  EXPECT_EQ(must_read(scene_with(shape("cube", animation(key("0", pose) + key("1", pose) + key("2", ""))))),
            wanted);
  EXPECT_EQ(must_read(scene_with(shape("cube", animation(key("5", pose))))), wanted);
  EXPECT_EQ(must_read(scene_with(shape("cube", animation(key("5", pose) + key("6", ""))))), wanted);
}

TEST(ShapeAnimation, StandsWhereItIsWhileTheShutterIsClosed) {
  const auto closed = read(scene_with(shape("cube", kAside), ""));
  ASSERT_TRUE(closed.scene);
  EXPECT_TRUE(closed.scene->shapes[0].motion.empty());
  EXPECT_EQ(closed.scene->shapes[0].to_world.m[3], 0);
  EXPECT_EQ(closed.scene->sensor.shutter_close, 0);
  EXPECT_THAT(messages(closed), HasSubstr("what moves stands where it is at 0, since the shutter opens and "
                                          "closes then: give shutter_open and shutter_close"));
  EXPECT_EQ(closed.diagnostics.at(0).place.line, 3);
}

TEST(ShapeAnimation, SurvivesWritingAndJson) {
  const std::string turns = animation(
      key("0", "") + key("0.6", "<rotate x=\"0.6\" y=\"0.8\" angle=\"77.7\"/><scale value=\"0.3\"/>") +
      key("1", "<rotate z=\"1\" angle=\"33.3\"/>"));
  const std::string group = R"(<shape type="shapegroup" id="g"><shape type="cube"/></shape>)";
  const Scene s = must_read(scene_with(shape("sphere", turns) + shape("cube", "") + group +
                                       shape("instance", "<ref id=\"g\"/>" + turns)));
  EXPECT_EQ(s.shapes[0].motion.size(), 3u);
  const auto json = deserialize_scene(serialize(s));
  ASSERT_TRUE(json);
  EXPECT_EQ(*json, s);
  EXPECT_EQ(must_read(write_xml(s)), s);
}

TEST(ShapeAnimation, OfAShapeThatIsLeftOutLeavesAClosedShutter) {
  const Scene s = must_read(scene_with(shape("cube", kAside + "<bsdf type=\"null\"/>")));
  ASSERT_EQ(s.sensor.shutter_close, 1);
  const Scene left = scene::pruned(s, scene::pruned_for("volpath", -1)).scene;
  EXPECT_TRUE(left.shapes.empty());
  EXPECT_EQ(left.sensor.shutter_close, 0);
  EXPECT_TRUE(deserialize_scene(serialize(left)));
}

TEST(ShapeAnimation, IsRefusedWithThePlaceOfWhatIsWrong) {
  const std::string a = key("0", "");
  const auto keys = [&](const std::string& more, std::string_view type = "cube") {
    return shape(type, animation(a + more));
  };
  const struct {
    std::string content;
    int line;
    std::string_view said;
  } rows[] = {
      {keys(a), 5, "must ascend: 0 comes after 0"},
      {keys(key("nan", "")), 5, "'time' wants a number of at most 1e+09 in size, not \"nan\""},
      {shape("cube", animation("")), 3, "needs a <transform time="},
      {keys(key("1", "<matrix value=\"1 0.5 0 0 1 0 0 0 1\"/>")), 5, "this transform shears"},
      {keys(key("1", "<matrix value=\"1 0 0 0 nan 0 0 0 1\"/>")), 5, "nan"},
      {keys(key("1", "<scale x=\"0\"/>")), 5, "it can't be inverted"},
      {keys(key("1", "<scale x=\"-1\"/>")), 5, "this transform mirrors and the first one does not"},
      {keys(key("1", "<scale x=\"2\"/>"), "sphere"), 5, "stretches this sphere"},
      {keys(key("1", "<scale x=\"2\"/>"), "cylinder"), 5, "stretches this cylinder"},
      {shape("cube", animation(a + key("1", "<scale x=\"2\"/>")) + "<emitter type=\"area\"/>"), 5,
       "stretches a shape that emits light and moves"},
      {"<shape type=\"shapegroup\">" + shape("cube", kAside) + "</shape>", 3,
       "this cube is in a group, and such shapes can't move: give it a <transform>, or let instances of its "
       "group move"},
      {keys(""), 0, ""},
      {keys(key("1", "<scale x=\"2\"/>")), 0, ""},
  };
  for (const auto& row : rows) {
    const auto r = read(scene_with(row.content));
    if (row.said.empty()) {
      EXPECT_TRUE(r.scene) << messages(r);
      continue;
    }
    ASSERT_FALSE(r.scene) << row.content;
    EXPECT_THAT(messages(r), HasSubstr(std::string(row.said)));
    EXPECT_EQ(r.diagnostics[0].place.line, row.line) << messages(r);
  }
  const auto backwards =
      read(scene_with(shape("cube", kAside),
                      R"(<float name="shutter_open" value="1"/><float name="shutter_close" value="0"/>)"));
  EXPECT_THAT(messages(backwards), HasSubstr("the shutter closes at 0 and opens at 1: let it close later"));
}

TEST(ShapeAnimation, HostileJsonIsRefused) {
  const Scene good = must_read(scene_with(shape("sphere", kAside)));
  const auto refused = [&](const std::function<void(Scene&, Shape&)>& change) {
    Scene s = good;
    change(s, s.shapes[0]);
    const auto r = deserialize_scene(serialize(s));
    return r ? std::string() : r.error().message;
  };
  EXPECT_EQ(refused([](Scene&, Shape&) {}), "");
  EXPECT_THAT(refused([](Scene&, Shape& s) { s.motion.pop_back(); }),
              HasSubstr("scene.shapes[0].motion must have 2 to 1000 keys"));
  EXPECT_THAT(refused([](Scene&, Shape& s) { s.motion[1].to_world.m[1] = 2; }),
              HasSubstr("scene.shapes[0].motion[1] shears"));
  EXPECT_THAT(refused([](Scene&, Shape& s) { s.to_world.m[3] = 7; }),
              HasSubstr("scene.shapes[0].to_world is not the pose in the middle"));
  EXPECT_THAT(refused([](Scene& s, Shape&) { s.sensor.shutter_close = 0; }),
              HasSubstr("a shutter that is not that of what moves"));
  EXPECT_THAT(refused([](Scene& s, Shape& moving) {
                s.groups.emplace_back();
                moving.group = GroupIndex{0};
                s.instances.push_back({GroupIndex{0}, {}, {}});
              }),
              HasSubstr("scene.shapes[0] moves, but is in a group"));
  EXPECT_THAT(refused([](Scene& s, Shape& moving) {
                s.textures.emplace_back(ConstantTexture{{1, 1, 1}});
                moving.emitter = AreaEmitter{{static_cast<std::uint32_t>(s.textures.size() - 1)}};
                moving.motion[1].to_world.m[0] = 2;
                moving.to_world = scene::Motion(moving.motion).at(.5);
              }),
              HasSubstr("scene.shapes[0] emits light, and its motion stretches it"));
}

}  // namespace
}  // namespace ls

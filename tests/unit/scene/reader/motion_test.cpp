// Cameras that move: the animations of their files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/json/serialize.h"
#include "core/scene/limits.h"
#include "core/scene/transform.h"
#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

// The sensor begins in line 2, and each line of `inner` is one further.
std::string camera(std::string_view inner, std::string_view type = "perspective") {
  return fmt::format("<scene version=\"3.0.0\">\n<sensor type=\"{}\">\n{}\n</sensor>\n</scene>\n", type,
                     inner);
}
std::string shutter(std::string_view open, std::string_view close) {
  return fmt::format(
      "<float name=\"shutter_open\" value=\"{}\"/><float name=\"shutter_close\" value=\"{}\"/>\n", open,
      close);
}
const std::string kAside = R"(<animation name="to_world">
<transform time="0"><lookat origin="0, 0, -5" target="0, 0, 0" up="0, 1, 0"/></transform>
<transform time="1"><lookat origin="2, 0, -5" target="2, 0, 0" up="0, 1, 0"/></transform>
</animation>)";

TEST(CameraAnimation, IsCutToTheExposure) {
  const Scene s = must_read(camera(shutter("0.25", "0.75") + kAside));

  ASSERT_EQ(s.sensor.motion.size(), 2u);
  EXPECT_EQ(s.sensor.motion[0].time, 0);
  EXPECT_EQ(origin_of(s.sensor.motion[0].to_world), (Vec3{{.5, 0, -5}}));
  EXPECT_EQ(s.sensor.motion[1].time, 1);
  EXPECT_EQ(origin_of(s.sensor.motion[1].to_world), (Vec3{{1.5, 0, -5}}));
  EXPECT_EQ(s.sensor.to_world.m[3], 1);  // in the middle of the exposure
  EXPECT_EQ(s.sensor.shutter_open, 0);
  EXPECT_EQ(s.sensor.shutter_close, 1);
}

TEST(CameraAnimation, ManyKeysOfOldFilesAreRead) {
  std::string keys = "<animation name=\"toWorld\">\n";
  for (int i = 0; i <= 24; ++i)
    keys +=
        fmt::format("<transform time=\"{}\"><rotate y=\"1\" angle=\"{}\"/></transform>\n", i / 24., 15 * i);
  std::string text =
      camera("<float name=\"shutterOpen\" value=\"0\"/><float name=\"shutterClose\" value=\"1\"/>" + keys +
             "</animation>");
  text.replace(text.find("3.0.0"), 5, "0.6.0");

  EXPECT_EQ(must_read(text).sensor.motion.size(), 25u);
}

TEST(CameraAnimation, OfEveryCameraIsRead) {
  for (const char* type : {"perspective", "orthographic", "spherical"})
    EXPECT_EQ(must_read(camera(shutter("0", "1") + kAside, type)).sensor.motion.size(), 2u) << type;
  const std::string lens = "<float name=\"aperture_radius\" value=\"0.1\"/>";
  EXPECT_EQ(must_read(camera(shutter("0", "1") + lens + kAside, "thinlens")).sensor.motion.size(), 2u);
}

TEST(CameraAnimation, IsNoneWithAClosedShutterAndOfOnePose) {
  const auto closed = read(camera(kAside)), half = read(camera(shutter("0.5", "0.5") + kAside));
  ASSERT_TRUE(closed.scene && half.scene);
  EXPECT_TRUE(closed.scene->sensor.motion.empty());
  EXPECT_EQ(closed.scene->sensor.shutter_close, 0);
  EXPECT_EQ(closed.scene->sensor.to_world.m[3], 0);
  EXPECT_EQ(half.scene->sensor.to_world.m[3], 1);
  EXPECT_THAT(messages(half),
              HasSubstr("the shutter opens and closes then: give shutter_open and shutter_close"));
  // before the first key nothing moves
  const Scene before = must_read(camera(shutter("-2", "-1") + kAside));
  EXPECT_TRUE(before.sensor.motion.empty());
  EXPECT_EQ(before.sensor.to_world.m[3], 0);
}

TEST(CameraAnimation, AShutterWithoutMotionLeavesTheSceneAsItIs) {
  const std::string still = "<transform name=\"to_world\"><translate x=\"1\"/></transform>";
  EXPECT_EQ(must_read(camera(shutter("0", "1") + still)), must_read(camera(still)));
}

TEST(CameraAnimation, SurvivesWritingAndJson) {
  const Scene s = must_read(camera(shutter("0.1", "0.9") + kAside));
  const auto json = deserialize_scene(serialize(s));
  ASSERT_TRUE(json);
  EXPECT_EQ(*json, s);
  EXPECT_EQ(must_read(write_xml(s)), s);
  const Scene turns =
      must_read(camera(shutter("0.1", "0.9") +
                       "<animation name=\"to_world\"><transform time=\"0\"/>"
                       "<transform time=\"0.7\"><rotate x=\"0.6\" y=\"0.8\" angle=\"77.7\"/></transform>"
                       "<transform time=\"1\"><rotate z=\"1\" angle=\"33.3\"/></transform></animation>"));
  EXPECT_EQ(turns.sensor.motion.size(), 3u);
  EXPECT_EQ(must_read(write_xml(turns)), turns);
}

TEST(CameraAnimation, OfOneTransformStandsStill) {
  const std::string one =
      R"(<animation name="to_world"><transform time="3"><translate x="1"/></transform></animation>)";
  const std::string still = "<transform name=\"to_world\"><translate x=\"1\"/></transform>";
  for (const std::string& opened : {std::string(), shutter("0", "1")})
    EXPECT_EQ(must_read(camera(opened + one)), must_read(camera(still)));
}

TEST(CameraAnimation, ThatHoldsDuringTheExposureIsThatOfAStillCamera) {
  const std::string pose = "<lookat origin=\"1, 2, 3\" target=\"-.3, .2, .1\" up=\"0, 1, 0\"/>";
  const auto held =
      must_read(camera(shutter("0.3", "0.7") + "<animation name=\"to_world\"><transform time=\"0\">" + pose +
                       "</transform><transform time=\"1\">" + pose +
                       "</transform><transform time=\"2\"/>"
                       "</animation>"));
  EXPECT_EQ(held, must_read(camera("<transform name=\"to_world\">" + pose + "</transform>")));
}

TEST(CameraAnimation, AtMostAThousandTransformsAreWithinTheExposure) {
  std::string keys = "<animation name=\"to_world\">";
  for (std::size_t i = 0; i < scene::kMaxMotionKeys; ++i)
    keys += fmt::format("<transform time=\"{}\"><translate x=\"{}\"/></transform>", i, i);
  keys += "</animation>";
  EXPECT_EQ(must_read(camera(shutter("0", "999") + keys)).sensor.motion.size(), scene::kMaxMotionKeys);
  EXPECT_THAT(messages(read(camera(shutter("-1", "1000") + keys))),
              HasSubstr("more than 1000 transforms are within"));
}

TEST(CameraAnimation, IsRefusedWithThePlaceOfWhatIsWrong) {
  const auto key = [](std::string_view time, std::string_view steps) {
    return fmt::format("<transform time=\"{}\">{}</transform>\n", time, steps);
  };
  const auto keys = [&](const std::string& inner) {
    return camera(shutter("0", "1") + "<animation name=\"to_world\">\n" + inner + "</animation>");
  };
  const std::string a = key("0", ""), b = key("1", "<translate x=\"1\"/>");
  std::string many;
  for (std::size_t i = 0; i <= scene::kMaxMotionKeys; ++i) many += key(std::to_string(i), "");
  const struct {
    std::string text;
    int line;
    std::string_view said;
  } rows[] = {
      {keys(b + a), 6, "the times of an <animation> must ascend: 0 comes after 1"},
      {keys(a + key("0", "")), 6, "must ascend: 0 comes after 0"},
      {keys(a + key("nan", "")), 6, "'time' wants a number of at most 1e+09 in size, not \"nan\""},
      {keys(a + key("soon", "")), 6, "'time' wants a number of at most 1e+09 in size, not \"soon\""},
      {keys(""), 4, "needs a <transform time="},
      {keys(a + "<transform><translate x=\"1\"/></transform>"), 6, "<transform> needs the attribute 'time'"},
      {keys(a + "<transform name=\"x\" time=\"1\"/>"), 6, "<transform> has no attribute 'name'"},
      {keys(a + "<translate x=\"1\"/>"), 6, "<translate> can't stand in <animation>"},
      {keys(a + "<float name=\"time\" value=\"1\"/>"), 6, "<float> can't stand in <animation>"},
      {keys(a + key("1", "<scale value=\"2\"/>")), 6, "may only move, turn and mirror"},
      {keys(a + key("1", "<matrix value=\"1 0.0005 0 0 1 0 0 0 1\"/>")), 0, ""},
      {keys(a + key("1", "<scale x=\"-1\"/>")), 6, "this transform mirrors and the first one does not"},
      {keys(a + key("1", "<matrix value=\"1 2\"/>")), 6, "<matrix> wants 9 or 16 numbers"},
      {keys(a + key("1e400", "")), 6, "'time' wants a number"},
      {keys(a + key("1e10", "")), 6, "'time' wants a number of at most 1e+09 in size, not \"1e10\""},
      {camera(shutter("-1e300", "1") + kAside), 3, "shutter_open"},
      {keys(many), 1005, "of more than 1000 transforms"},
      {camera(shutter("1", "0") + kAside), 2, "the shutter closes at 0 and opens at 1: let it close later"},
      {camera(shutter("0", "nan") + kAside), 3, "shutter_close"},
      {camera("<transform name=\"to_world\"/>\n" + kAside), 4, "is given 'to_world' twice"},
      {with_sensor("<emitter type=\"spot\">\n" + kAside + "</emitter>"), 3,
       "'to_world' of emitter \"spot\" is an <animation>: only cameras, shapes and instances can move"},
      {with_sensor(kAside), 2, "stands in no object"},
      {camera("<animation name=\"elsewhere\"/>"), 3, "elsewhere"},
  };
  for (const auto& row : rows) {
    const auto r = read(row.text);
    if (row.said.empty()) {
      EXPECT_TRUE(r.scene) << messages(r);
      continue;
    }
    ASSERT_FALSE(r.scene) << row.text;
    EXPECT_THAT(messages(r), HasSubstr(std::string(row.said)));
    EXPECT_EQ(r.diagnostics[0].place.line, row.line) << messages(r);
  }
}

TEST(CameraAnimation, OrthographicCamerasMayScaleAndNotShear) {
  const auto scaled = [](std::string_view matrix) {
    return read(camera(
        shutter("0", "1") + "<animation name=\"to_world\">\n<transform time=\"0\"/>\n" +
            fmt::format("<transform time=\"1\"><matrix value=\"{}\"/></transform></animation>", matrix),
        "orthographic"));
  };
  const auto grown = scaled("2 0 0 0 3 0 0 0 1");
  ASSERT_TRUE(grown.scene);
  EXPECT_EQ(grown.scene->sensor.motion[1].to_world.m[5], 3);
  EXPECT_THAT(messages(scaled("1 0.5 0 0 1 0 0 0 1")), HasSubstr("this transform shears"));
  EXPECT_THAT(messages(scaled("1 0 0 0 1 0 0 0 0")), HasSubstr("can't be inverted"));
}

TEST(CameraAnimation, HostileJsonIsRefused) {
  const Scene good = must_read(camera(shutter("0", "1") + kAside));
  const auto refused = [&](const std::function<void(Sensor&)>& change) {
    Scene s = good;
    change(s.sensor);
    const auto r = deserialize_scene(serialize(s));
    return r ? std::string() : r.error().message;
  };
  EXPECT_EQ(refused([](Sensor&) {}), "");
  EXPECT_THAT(refused([](Sensor& s) { s.motion.pop_back(); }),
              HasSubstr("must have 2 to 1000 keys, the first at time 0"));
  EXPECT_THAT(refused([](Sensor& s) { s.motion[1].time = .5; }), HasSubstr("the last at 1"));
  EXPECT_THAT(refused([](Sensor& s) { s.motion.insert(s.motion.begin() + 1, s.motion[0]); }),
              HasSubstr("[1] is not later"));
  EXPECT_THAT(refused([](Sensor& s) { s.motion[1].to_world.m[1] = 2; }),
              HasSubstr("[1] shears, or can't be inverted"));
  EXPECT_THAT(refused([](Sensor& s) { s.motion[1].to_world.m[0] = 0; }), HasSubstr("can't be inverted"));
  EXPECT_THAT(refused([](Sensor& s) { s.motion[1].to_world.m[5] = -1; }),
              HasSubstr("[1] mirrors unlike the first"));
  EXPECT_THAT(refused([](Sensor& s) { s.to_world.m[3] = 7; }), HasSubstr("is not the pose in the middle"));
  EXPECT_THAT(refused([](Sensor& s) { s.shutter_close = 2; }),
              HasSubstr("a shutter that is not that of what moves"));
  EXPECT_THAT(refused([](Sensor& s) { s.motion.clear(); }),
              HasSubstr("a shutter that is not that of what moves"));
}

}  // namespace
}  // namespace ls

// Reading of emitters: extensions of Mitsuba's, derived parameters, and errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

template <class T>
T emitter(const std::string& parameters, const std::string& type) {
  const Scene s = must_read(with_sensor("<emitter type=\"" + type + "\">" + parameters + "</emitter>"));
  return std::get<T>(s.emitters.at(0));
}
AreaEmitter area(const std::string& parameters) {
  return *must_read(
              with_sensor("<shape type=\"disk\"><emitter type=\"area\">" + parameters + "</emitter></shape>"))
              .shapes.at(0)
              .emitter;
}
std::string refusal(const std::string& objects) {
  const ReadResult r = read(with_sensor(objects));
  return r.scene ? "" : messages(r);
}
std::string float_named(const std::string& name, const std::string& value) {
  return "<float name=\"" + name + "\" value=\"" + value + "\"/>";
}

TEST(Emitters, DirectionalLightMayHaveAnAngularRadius) {
  EXPECT_EQ(emitter<DirectionalEmitter>("", "directional").angular_radius, 0);
  EXPECT_EQ(emitter<DirectionalEmitter>(float_named("angular_radius", ".267"), "directional").angular_radius,
            .267);
  EXPECT_THAT(refusal("<emitter type=\"directional\">" + float_named("angular_radius", "91") + "</emitter>"),
              HasSubstr("out of its range 0 <= angular_radius <= 90"));
}

TEST(Emitters, AndGlowingMediaMayBelongToALightGroup) {
  const std::string group = R"(<string name="light_group" value="key-1_B"/>)";
  EXPECT_EQ(emitter<DirectionalEmitter>("", "directional").light_group, "");
  EXPECT_EQ(emitter<ConstantEmitter>(group, "constant").light_group, "key-1_B");
  EXPECT_EQ(emitter<DirectionalEmitter>(group, "directional").light_group, "key-1_B");
  EXPECT_EQ(emitter<PointEmitter>(group, "point").light_group, "key-1_B");
  EXPECT_EQ(emitter<SpotEmitter>(group, "spot").light_group, "key-1_B");
  EXPECT_EQ(area(group).light_group, "key-1_B");
  const Scene s = must_read(with_sensor(R"(<shape type="cube"><medium name="interior" type="homogeneous">)" +
                                        group + "</medium></shape>"));
  EXPECT_EQ(std::get<HomogeneousMedium>(s.media.at(0)).light_group, "key-1_B");
  EXPECT_EQ(must_read(write_xml(s)), s);
  for (const char* wrong : {"", "a.b", "a b", "\xc3\xa9"})
    EXPECT_THAT(refusal("<emitter type=\"constant\">\n<string name=\"light_group\" value=\"" +
                        std::string(wrong) + "\"/></emitter>"),
                HasSubstr("a light group's name has 1 to 63 ASCII letters"))
        << wrong;
}

TEST(Emitters, AreaLightMayBeABeam) {
  const AreaEmitter plain = area("");
  EXPECT_EQ(plain.cutoff_angle, 90);
  EXPECT_EQ(plain.beam_width, 90);
  const AreaEmitter cut = area(float_named("cutoff_angle", "40")),
                    both = area(float_named("cutoff_angle", "40") + float_named("beam_width", "10") +
                                float_named("falloff", "2.5"));
  EXPECT_EQ(cut.beam_width, 30);
  EXPECT_EQ(both.beam_width, 10);
  EXPECT_EQ(both.falloff, 2.5);
  EXPECT_EQ(area(float_named("beam_width", "10")).cutoff_angle, 90);
  const auto refused = [](const std::string& p) {
    return refusal("<shape type=\"disk\"><emitter type=\"area\">" + p + "</emitter></shape>");
  };
  EXPECT_THAT(refused(float_named("cutoff_angle", "40") + float_named("beam_width", "50")),
              HasSubstr("beam_width 50 is wider than cutoff_angle 40"));
  EXPECT_THAT(refused(float_named("falloff", "2")), HasSubstr("'falloff' of emitter \"area\" lies between"));
  EXPECT_THAT(refused(float_named("cutoff_angle", "120")), HasSubstr("out of its range"));
}

TEST(Emitters, AreaLightMayEmitOnBothSides) {
  const std::string on = "<boolean name=\"two_sided\" value=\"true\"/>",
                    shape = "<shape type=\"disk\"><emitter type=\"area\">";
  const Scene plain = must_read(with_sensor(shape + "</emitter></shape>")),
              both = must_read(with_sensor(shape + on + "</emitter></shape>"));

  EXPECT_FALSE(plain.shapes.at(0).emitter->two_sided);
  EXPECT_TRUE(both.shapes.at(0).emitter->two_sided);
  EXPECT_EQ(serialize(plain).find("two_sided"), std::string::npos);
  EXPECT_EQ(deserialize_scene(serialize(both)).value(), both);
  EXPECT_EQ(must_read(write_xml(both)), both);
}

TEST(Emitters, LightshaftsOwnParametersAreWrittenOnlyIfNotDefault) {
  const std::string disk = "<shape type=\"disk\"><emitter type=\"area\">", end = "</emitter></shape>";
  const auto written = [](const std::string& objects) { return write_xml(must_read(with_sensor(objects))); };
  const std::string plain = written(disk + end + "<emitter type=\"directional\"/>");
  for (const char* name : {"angular_radius", "cutoff_angle", "beam_width", "falloff"})
    EXPECT_THAT(plain, Not(HasSubstr(name)));
  const std::string own =
      written(disk + float_named("cutoff_angle", "30") + float_named("falloff", "3") + end +
              "<emitter type=\"directional\">" + float_named("angular_radius", "5") + "</emitter>");
  for (const char* name : {"angular_radius", "cutoff_angle", "beam_width", "falloff"})
    EXPECT_THAT(own, HasSubstr(name));
  EXPECT_EQ(must_read(own),
            must_read(written(disk + float_named("cutoff_angle", "30") + float_named("falloff", "3") + end +
                              "<emitter type=\"directional\">" + float_named("angular_radius", "5") +
                              "</emitter>")));
}

const std::string kImage =
    "<texture type=\"bitmap\" name=\"irradiance\"><string name=\"filename\" value=\"wood.png\"/></texture>";

TEST(Emitters, ProjectorIsDescribedLikeACamera) {
  const auto plain = emitter<ProjectorEmitter>(kImage, "projector");
  EXPECT_EQ(plain.scale, 1);
  EXPECT_EQ(plain.fov_axis, FovAxis::diagonal) << "50 mm, over the diagonal of 36 mm x 24 mm";
  EXPECT_NEAR(plain.fov, 46.7930, 1e-3);
  const auto given =
      emitter<ProjectorEmitter>(kImage + float_named("fov", "30") + float_named("scale", "15") +
                                    "<string name=\"fov_axis\" value=\"smaller\"/>",
                                "projector");
  EXPECT_EQ(given.fov, 30);
  EXPECT_EQ(given.fov_axis, FovAxis::smaller);
  EXPECT_EQ(given.scale, 15);
  const Scene s = must_read(
      with_sensor("<emitter type=\"projector\">" + kImage + float_named("fov", "30") + "</emitter>"));
  EXPECT_EQ(must_read(write_xml(s)), s);
  EXPECT_EQ(deserialize_scene(serialize(s)).value(), s);
}

TEST(Emitters, ProjectorNeedsAnImageAndNoStretchingTransform) {
  EXPECT_THAT(refusal("<emitter type=\"projector\"/>"), HasSubstr("needs 'irradiance'"));
  EXPECT_THAT(refusal("<emitter type=\"projector\">" + kImage +
                      "<transform name=\"to_world\"><scale value=\"2\"/></transform></emitter>"),
              HasSubstr("to_world of a projector may only move, turn and mirror"));
  EXPECT_THAT(refusal("<emitter type=\"projector\">" + kImage + float_named("fov", "30") +
                      "<string name=\"focal_length\" value=\"50mm\"/></emitter>"),
              HasSubstr("gives both fov and focal_length"));
}

TEST(Emitters, GoniometricLightNeedsAnImageAndNoStretchingTransform) {
  const std::string image =
      "<texture type=\"bitmap\" name=\"texture\"><string name=\"filename\" value=\"wood.png\"/></texture>";
  const auto plain = emitter<GoniometricEmitter>(image, "goniometric");
  EXPECT_EQ(plain.intensity, (Rgb{1, 1, 1}));
  const std::string larger =
      "<transform name=\"to_world\"><scale value=\"-2\"/><translate x=\"1\"/></transform>";
  EXPECT_EQ(emitter<GoniometricEmitter>(image + larger, "goniometric").to_world.m[3], 1);
  const Scene s = must_read(with_sensor("<emitter type=\"goniometric\">" + image +
                                        "<rgb name=\"intensity\" "
                                        "value=\"1 2 3\"/>" +
                                        larger + "</emitter>"));
  EXPECT_EQ(must_read(write_xml(s)), s);
  EXPECT_EQ(deserialize_scene(serialize(s)).value(), s);

  // A file alone is an image that does not repeat
  const std::string file = "<string name=\"filename\" value=\"wood.png\"/>";
  const Scene by_file = must_read(with_sensor("<emitter type=\"goniometric\">" + file + "</emitter>"));
  const auto& light = std::get<GoniometricEmitter>(by_file.emitters.at(0));
  const auto& bitmap = std::get<BitmapTexture>(by_file.textures.at(light.texture.value));
  EXPECT_EQ(by_file.assets.at(bitmap.file.value).name, "wood.png");
  EXPECT_TRUE(bitmap.raw);
  EXPECT_EQ(bitmap.wrap, Wrap::clamp);
  EXPECT_EQ(must_read(write_xml(by_file)), by_file);

  EXPECT_THAT(refusal("<emitter type=\"goniometric\"/>"), HasSubstr("needs 'filename'"));
  EXPECT_THAT(refusal("<emitter type=\"goniometric\">" + image + file + "</emitter>"),
              HasSubstr("leave one out"));
  EXPECT_THAT(
      refusal("<emitter type=\"goniometric\"><string name=\"filename\" value=\"none.ies\"/></emitter>"),
      HasSubstr("none.ies"));
  EXPECT_THAT(refusal("<emitter type=\"goniometric\">" + image +
                      "<transform name=\"to_world\"><scale x=\"2\"/></transform></emitter>"),
              HasSubstr("not stretch or flatten it"));
  EXPECT_THAT(refusal("<emitter type=\"goniometric\">" + image +
                      "<transform name=\"to_world\"><scale value=\"0\"/></transform></emitter>"),
              HasSubstr("not stretch or flatten it"));
}

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

TEST(EnvmapScenes, DefaultsAreScaleOneWithoutRotation) {
  const Scene s = must_read(with_sensor(sky("")));
  const auto& e = std::get<EnvmapEmitter>(s.emitters.at(0));
  EXPECT_EQ(e.scale, 1);
  EXPECT_EQ(e.to_world, Transform{});
}

TEST(EnvmapScenes, EqualAreaSquareMapIsRead) {
  const Scene s = must_read(with_sensor(sky("<string name=\"mapping\" value=\"equal_area\"/>")));
  EXPECT_EQ(std::get<EnvmapEmitter>(s.emitters.at(0)).mapping, SkyMapping::equal_area);
  EXPECT_EQ(deserialize_scene(serialize(s)).value(), s);
  const auto wrong = read(with_sensor(sky("<string name=\"mapping\" value=\"cube\"/>")));
  EXPECT_FALSE(wrong.scene);
  EXPECT_THAT(messages(wrong), HasSubstr("latlong"));
}

TEST(EnvmapScenes, OldFilesMayRotateThemByToWorld) {
  const Scene s = must_read(
      "<scene version=\"0.6.0\"><emitter type=\"envmap\"><transform name=\"toWorld\"><matrix "
      "value=\"-4.37114e-008 "
      "0 1 0 0 1 0 0 -1 0 -4.37114e-008 0 0 0 0 1\"/></transform><string name=\"filename\" "
      "value=\"wood.png\"/></emitter>" +
      kSensor + "</scene>");
  EXPECT_EQ(std::get<EnvmapEmitter>(s.emitters.at(0)).to_world.m[2], 1);
}

TEST(EnvmapScenes, SamplingParametersCauseAWarning) {
  const auto r = read(with_sensor(sky("<boolean name=\"mis_compensation\" value=\"true\"/>")));
  ASSERT_TRUE(r.scene);
  EXPECT_THAT(messages(r), HasSubstr("'mis_compensation' of emitter \"envmap\" has no effect here"));
}

TEST(EnvmapScenes, ErrorsAreReported) {
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

TEST(EnvmapScenes, SecondEnvironmentIsRefused) {
  for (const std::string& two : {sky("") + sky(""), sky("") + "<emitter type=\"constant\"/>",
                                 "<emitter type=\"constant\"/>" + sky("")}) {
    const auto r = read(with_sensor(two));
    EXPECT_FALSE(r.scene);
    EXPECT_THAT(messages(r),
                HasSubstr("a second environment: a scene has one emitter \"constant\" or \"envmap\""));
  }
}

TEST(Emitters, AreaLightMayBeSeparateFromItsShape) {
  const std::string lamp = R"(<emitter type="area" id="lamp"><rgb name="radiance" value="1 2 3"/></emitter>)",
                    ball = R"(<shape type="sphere"><ref id="lamp"/></shape>)";
  for (const std::string& objects : {lamp + ball, ball + lamp}) {
    const Scene s = must_read(with_sensor(objects));

    ASSERT_EQ(s.shapes.size(), 1u);
    EXPECT_TRUE(s.shapes[0].emitter);
    EXPECT_TRUE(s.emitters.empty());
  }
  EXPECT_FALSE(read(with_sensor(lamp)).scene);
}

}  // namespace
}  // namespace ls

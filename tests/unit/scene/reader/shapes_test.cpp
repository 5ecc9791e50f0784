// Reading of shapes, groups, instances, cameras and crops, errors in them, and that scenes of them keep their
// digests when they are written and read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

// Returns all messages about these objects in one text; "" if they are read.
std::string wrong_with(std::string_view objects) {
  const ReadResult r = read(with_sensor(objects));
  return r.scene ? "" : messages(r);
}
void expect_kept(const Scene& s) {
  const std::string text = write_xml(s);
  const ReadResult again = read(text);
  ASSERT_TRUE(again.scene) << messages(again) << text;
  EXPECT_EQ(serialize(*again.scene), serialize(s)) << text;
  const auto from_json = deserialize_scene(serialize(s));
  ASSERT_TRUE(from_json) << from_json.error().message;
  EXPECT_EQ(*from_json, s);
}
std::string sensor(std::string_view type, std::string_view inside, std::string_view film = "") {
  return fmt::format(
      "<scene version=\"3.0.0\">\n<sensor type=\"{}\">{}<film type=\"hdrfilm\"><integer name=\"width\" "
      "value=\"20\"/><integer name=\"height\" value=\"10\"/>{}</film></sensor></scene>",
      type, inside, film);
}

TEST(ReadCylinder, HasMitsubasParametersAndDefaults) {
  const Scene s = must_read(with_sensor(
      R"(<shape type="cylinder"/><shape type="cylinder"><point name="p0" x="1" y="2" z="3"/><point name="p1" x="4" y="5" z="6"/><float name="radius" value="0.25"/><boolean name="flip_normals" value="true"/></shape>)"));

  EXPECT_EQ(std::get<CylinderShape>(s.shapes[0].geometry), (CylinderShape{{0, 0, 0}, {0, 0, 1}, 1}));
  EXPECT_EQ(std::get<CylinderShape>(s.shapes[1].geometry), (CylinderShape{{1, 2, 3}, {4, 5, 6}, .25}));
  EXPECT_TRUE(s.shapes[1].flip_normals);
  expect_kept(s);
}

TEST(ReadCylinder, MayBeStretchedAlongItsAxisOnly) {
  const auto with = [](std::string_view transform, std::string_view p1 = "0 0 1") {
    return wrong_with(
        fmt::format("<shape type=\"cylinder\"><point name=\"p1\" value=\"{}\"/><transform "
                    "name=\"to_world\">{}</transform></shape>",
                    p1, transform));
  };
  EXPECT_EQ(with("<scale z=\"5\"/><rotate x=\"1\" angle=\"40\"/><scale value=\"3\"/>"), "");
  EXPECT_EQ(with("<scale x=\"-1\"/>"), "");
  EXPECT_EQ(with("<scale x=\"4\"/>", "1 0 0"), "");
  EXPECT_THAT(with("<scale x=\"2\"/>"), HasSubstr("stretches this cylinder across its axis"));
  EXPECT_THAT(with("<scale z=\"2\"/>", "0 1 1"), HasSubstr("stretches this cylinder"));
  EXPECT_THAT(with("<scale z=\"0\"/>"), HasSubstr("flattens"));
  EXPECT_THAT(with("", "0 0 0"), HasSubstr("the same point"));
}

TEST(ReadVisibility, IsKeptAndLeavesOtherScenesAsTheyAre) {
  const auto flag = [](std::string_view name, std::string_view value) {
    return fmt::format("<boolean name=\"{}\" value=\"{}\"/>", name, value);
  };
  const Scene plain = must_read(with_sensor(R"(<shape type="sphere"/><emitter type="constant"/>)"));
  EXPECT_TRUE(plain.shapes[0].visible_camera);
  for (const char* name : {"visible_", "holdout", "transparent"})
    EXPECT_EQ(serialize(plain).find(name), std::string::npos) << name;

  const Scene s = must_read(with_sensor(
      "<shape type=\"sphere\">" + flag("visible_camera", "false") + "</shape><shape type=\"cube\">" +
      flag("holdout", "true") + flag("visible_camera", "true") + "</shape><emitter type=\"constant\">" +
      flag("visible_camera", "false") + "</emitter><emitter type=\"directional\">" +
      flag("visible_camera", "false") + "</emitter>"));
  EXPECT_FALSE(s.shapes[0].visible_camera);
  EXPECT_TRUE(s.shapes[1].visible_camera && s.shapes[1].holdout);
  EXPECT_FALSE(std::get<ConstantEmitter>(s.emitters[0]).visible_camera);
  EXPECT_FALSE(std::get<DirectionalEmitter>(s.emitters[1]).visible_camera);
  expect_kept(s);

  for (const char* light : {"constant", "directional", "point", "spot"}) {
    const Scene lit = must_read(with_sensor(fmt::format("<emitter type=\"{}\">", light) +
                                            flag("visible_reflection", "false") +
                                            flag("visible_volume", "false") + "</emitter>"));
    std::visit([](const auto& e) { EXPECT_FALSE(e.visible_reflection || e.visible_volume); },
               lit.emitters[0]);
    expect_kept(lit);
  }
  const Scene film = must_read(sensor("perspective", "", flag("transparent", "true")));
  EXPECT_TRUE(film.film.transparent);
  expect_kept(film);
  EXPECT_FALSE(must_read(sensor("perspective", "", "<string name=\"pixel_format\" value=\"rgba\"/>"))
                   .film.transparent);
}

TEST(ReadVisibility, OfAHoldoutThatCatchesShadowsIsRefusedWithItsPlace) {
  const std::string holdout = "<boolean name=\"holdout\" value=\"true\"/>",
                    catcher = "\n  <boolean name=\"shadow_catcher\" value=\"true\"/>";
  const Scene s = must_read(with_sensor("<shape type=\"cube\">" + catcher + "</shape>"));
  EXPECT_TRUE(s.shapes[0].shadow_catcher);
  expect_kept(s);

  const ReadResult r = read(with_sensor("<shape type=\"cube\">" + holdout + catcher + "</shape>"));
  ASSERT_EQ(r.diagnostics.size(), 1u) << messages(r);
  EXPECT_THAT(r.diagnostics[0].text, HasSubstr("is a holdout, which shows no shadow"));
  EXPECT_GT(r.diagnostics[0].place.line, 1);
  EXPECT_EQ(r.diagnostics[0].place.column, 4);
}

TEST(ReadVisibility, OfABoundaryWithoutASurfaceIsRefused) {
  for (const char* name : {"visible_shadow", "visible_reflection", "visible_volume"}) {
    const auto shape = [&](std::string_view value, std::string_view more) {
      return wrong_with(
          fmt::format("<shape type=\"cube\">\n<boolean name=\"{}\" value=\"{}\"/>"
                      "<bsdf type=\"null\"/>{}</shape>",
                      name, value, more));
    };
    const std::string fog = R"(<medium name="interior" type="homogeneous"/>)";
    EXPECT_THAT(shape("false", fog), HasSubstr(fmt::format("'{}' has no effect on shape \"cube\"", name)));
    EXPECT_EQ(shape("true", fog), "");
    EXPECT_EQ(shape("false", R"(<emitter type="area"/>)"), "");
  }
}

constexpr std::string_view kGroup =
    R"(<shape type="shapegroup" id="trees"><shape type="sphere"/><shape type="cylinder"><bsdf type="null"/></shape></shape>)";

TEST(ReadInstance, PlacesTheShapesOfAGroup) {
  const Scene s = must_read(with_sensor(std::string(kGroup) + R"(<shape type="cube"/>
    <shape type="instance"><ref id="trees"/></shape>
    <shape type="instance"><ref id="trees"/><transform name="to_world"><translate x="7"/></transform></shape>)"));

  ASSERT_EQ(s.shapes.size(), 3u);
  EXPECT_EQ(s.shapes[0].group, GroupIndex{0});
  EXPECT_EQ(s.shapes[1].group, GroupIndex{0});
  EXPECT_FALSE(s.shapes[2].group);
  ASSERT_EQ(s.groups.size(), 1u);
  ASSERT_EQ(s.instances.size(), 2u);
  EXPECT_EQ(s.instances[1].to_world.m[3], 7);
  expect_kept(s);
}

TEST(ReadInstance, MayPrecedeOrContainItsGroup) {
  const std::string instance = R"(<shape type="instance"><ref id="trees"/></shape>)";
  const Scene before = must_read(with_sensor(instance + std::string(kGroup)));
  EXPECT_EQ(before, must_read(with_sensor(std::string(kGroup) + instance)));
  EXPECT_EQ(before, must_read(with_sensor("<shape type=\"instance\">" + std::string(kGroup) + "</shape>")));
}

TEST(ReadInstance, KeepsGroupsApartInTheirOrder) {
  const Scene s = must_read(with_sensor(R"(
    <shape type="instance"><ref id="b"/></shape><shape type="disk"/>
    <shape type="shapegroup" id="a"><shape type="sphere"/></shape>
    <shape type="shapegroup" id="b"><shape type="cube"/></shape>
    <shape type="instance"><ref id="a"/></shape>)"));

  ASSERT_EQ(s.groups.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<CubeShape>(s.shapes[0].geometry));
  EXPECT_EQ(s.instances[0].group, *s.shapes[0].group);
  EXPECT_EQ(s.instances[1].group, *s.shapes[2].group);
  expect_kept(s);
}

TEST(ReadInstance, UnusedGroupIsLeftOut) {
  const Scene s = must_read(with_sensor(kGroup));
  EXPECT_TRUE(s.shapes.empty());
  EXPECT_TRUE(s.groups.empty());
  EXPECT_TRUE(s.bsdfs.empty());
}

TEST(ReadInstance, EmptyGroupIsAWarning) {
  const ReadResult r =
      read(with_sensor(R"(<shape type="shapegroup" id="g"/><shape type="instance"><ref id="g"/></shape>)"));
  ASSERT_TRUE(r.scene);
  EXPECT_TRUE(r.scene->instances.empty());
  EXPECT_THAT(messages(r), HasSubstr("holds no shape"));
}

TEST(ReadInstance, RefusesWhatMitsubaRefuses) {
  EXPECT_THAT(
      wrong_with(R"(<shape type="shapegroup"><shape type="sphere"><emitter type="area"/></shape></shape>)"),
      HasSubstr("test.xml:2:48: error: shape \"sphere\" in a shapegroup can't emit light"));
  EXPECT_THAT(
      wrong_with(std::string(kGroup) +
                 R"(<shape type="shapegroup"><shape type="instance"><ref id="trees"/></shape></shape>)"),
      HasSubstr("an instance can't stand in a shapegroup"));
  EXPECT_THAT(wrong_with("<shape type=\"shapegroup\">" + std::string(kGroup) + "</shape>"),
              HasSubstr("a shapegroup can't stand in a shapegroup"));
  EXPECT_THAT(wrong_with(R"(<shape type="instance"/>)"), HasSubstr("an instance needs a shapegroup"));
  EXPECT_THAT(wrong_with(R"(<shape type="sphere" id="s"/><shape type="instance"><ref id="s"/></shape>)"),
              HasSubstr("an instance shows a shapegroup, not a shape \"sphere\""));
  EXPECT_THAT(wrong_with(std::string(kGroup) +
                         R"(<shape type="instance"><ref id="trees"/><ref id="trees"/></shape>)"),
              HasSubstr("a second shapegroup"));
  EXPECT_THAT(
      wrong_with(
          std::string(kGroup) +
          R"(<shape type="instance"><ref id="trees"/><transform name="to_world"><scale z="0"/></transform></shape>)"),
      HasSubstr("flattens this instance"));
  EXPECT_THAT(wrong_with(std::string(kGroup) +
                         R"(<shape type="instance"><ref id="trees"/><bsdf type="null"/></shape>)"),
              HasSubstr("error"));
  EXPECT_THAT(wrong_with(R"(<shape type="shapegroup"><float name="radius" value="1"/></shape>)"),
              HasSubstr("no parameter 'radius'"));
}

// The JSON is one that serialising a scene from the reader never gives.
TEST(SceneJsonOfGroups, ContradictionIsRefused) {
  const Scene s =
      must_read(with_sensor(std::string(kGroup) + R"(<shape type="instance"><ref id="trees"/></shape>)"));
  const auto error = [](const Scene& wrong) {
    const auto read = deserialize_scene(serialize(wrong));
    return read ? "" : read.error().message;
  };
  EXPECT_EQ(error(s), "");
  Scene wrong = s;
  wrong.instances[0].group = {3};
  EXPECT_THAT(error(wrong), HasSubstr("instances[0] refers to object 3"));
  wrong = s;
  wrong.shapes[1].group = {1};
  EXPECT_THAT(error(wrong), HasSubstr("refers to object 1"));
  wrong = s;
  wrong.groups.emplace_back();
  EXPECT_THAT(error(wrong), HasSubstr("a group has no shapes"));
  wrong.shapes[0].group = {1};
  EXPECT_THAT(error(wrong), HasSubstr("out of their order"));
  wrong = s;
  wrong.shapes.push_back(wrong.shapes[0]);
  wrong.shapes[1].group.reset();
  EXPECT_THAT(error(wrong), HasSubstr("mixed"));
  wrong = s;
  wrong.textures.push_back(ConstantTexture{});
  wrong.shapes[0].emitter = AreaEmitter{{static_cast<std::uint32_t>(wrong.textures.size() - 1)}};
  EXPECT_THAT(error(wrong), HasSubstr("a shape in a group emits light"));
  wrong = s;
  wrong.film.crop_size = {3, 0};
  EXPECT_THAT(error(wrong), HasSubstr("the crop is not within the frame"));
  wrong.film.crop_size = {8, 8};
  wrong.film.crop_offset = {1, 0};
  EXPECT_THAT(error(wrong), HasSubstr("the crop is not within the frame"));
}

TEST(ReadSerialized, HasItsIndex) {
  const std::string shape =
      R"(<shape type="serialized"><string name="filename" value="mesh.ply"/><integer name="shape_index" value="3"/></shape>)";
  const Scene s = must_read(with_sensor(shape));
  const auto& mesh = std::get<MeshShape>(s.shapes[0].geometry);
  EXPECT_EQ(mesh.format, MeshFormat::serialized);
  EXPECT_EQ(mesh.shape_index, 3);
  EXPECT_FALSE(mesh.flip_tex_coords);
  expect_kept(s);
  EXPECT_THAT(
      wrong_with(
          R"(<shape type="obj"><string name="filename" value="mesh.obj"/><integer name="shape_index" value="3"/></shape>)"),
      HasSubstr("shape \"obj\" has no parameter 'shape_index'"));
  EXPECT_THAT(
      wrong_with(
          R"(<shape type="serialized"><string name="filename" value="mesh.ply"/><integer name="shape_index" value="-1"/></shape>)"),
      HasSubstr("0 <= shape_index"));
  EXPECT_THAT(
      wrong_with(
          R"(<shape type="serialized"><string name="filename" value="mesh.ply"/><boolean name="flip_tex_coords" value="true"/></shape>)"),
      HasSubstr("shape \"serialized\" has no parameter 'flip_tex_coords'"));
}

TEST(ReadSensor, OrthographicMayScale) {
  const Scene s = must_read(sensor(
      "orthographic",
      R"(<float name="near_clip" value="0.5"/><transform name="to_world"><scale x="10" y="10"/></transform>)"));
  EXPECT_EQ(s.sensor.projection, Projection::orthographic);
  EXPECT_EQ(s.sensor.to_world.m[0], 10);
  EXPECT_EQ(s.sensor.near_clip, .5);
  expect_kept(s);
  const auto wrong = [](std::string_view inside) { return messages(read(sensor("orthographic", inside))); };
  EXPECT_THAT(wrong(R"(<transform name="to_world"><scale x="0"/></transform>)"),
              HasSubstr("flattens this camera"));
  EXPECT_THAT(wrong(R"(<float name="fov" value="30"/>)"), HasSubstr("no parameter 'fov'"));
}

TEST(ReadSensor, SphericalSeesAllAround) {
  const Scene s =
      must_read(sensor("spherical", R"(<transform name="to_world"><rotate y="1" angle="90"/></transform>)"));
  EXPECT_EQ(s.sensor.projection, Projection::spherical);
  expect_kept(s);
  EXPECT_THAT(
      messages(read(sensor("spherical", R"(<transform name="to_world"><scale value="2"/></transform>)"))),
      HasSubstr("may only move, turn and mirror"));
  EXPECT_THAT(messages(read(sensor("spherical", R"(<float name="near_clip" value="1"/>)"))),
              HasSubstr("no parameter 'near_clip'"));
}

TEST(ReadSensor, ThinLensMayHaveAnApertureMap) {
  const std::string lens =
      R"(<float name="aperture_radius" value="0.1"/><float name="focus_distance" value="2"/>)";
  const Scene s = must_read(sensor(
      "thinlens",
      lens +
          R"(<texture type="bitmap" name="aperture_scale"><string name="filename" value="wood.png"/></texture>)"));
  ASSERT_TRUE(s.sensor.aperture_scale);
  expect_kept(s);
  EXPECT_THAT(messages(read(sensor("perspective", R"(<float name="aperture_scale" value="0.5"/>)"))),
              HasSubstr("no parameter 'aperture_scale'"));
  EXPECT_THAT(messages(read(sensor("thinlens", lens + R"(<float name="aperture_scale" value="2"/>)"))),
              HasSubstr("out of its range"));
}

std::string crop(int x, int y, int width, int height) {
  std::string text;
  const auto add = [&](std::string_view name, int value) {
    if (value >= 0) text += fmt::format("<integer name=\"crop_{}\" value=\"{}\"/>", name, value);
  };
  add("offset_x", x);
  add("offset_y", y);
  add("width", width);
  add("height", height);
  return text;
}

TEST(ReadFilm, CropsToAPartOfTheFrame) {
  const Scene s = must_read(sensor("perspective", "", crop(3, 2, 10, 5)));
  EXPECT_EQ(s.film.size, (FrameSize{20, 10}));
  EXPECT_EQ(s.film.crop_offset, (std::array{3, 2}));
  EXPECT_EQ(s.film.image_size(), (FrameSize{10, 5}));
  expect_kept(s);
  // A missing width or height is that of the frame.
  EXPECT_EQ(must_read(sensor("perspective", "", crop(-1, -1, 7, -1))).film.image_size(), (FrameSize{7, 10}));
}

TEST(ReadFilm, WholeFrameCropIsNoCrop) {
  EXPECT_EQ(must_read(sensor("perspective", "", crop(0, 0, 20, 10))), must_read(sensor("perspective", "")));
}

TEST(ReadFilm, RefusesCropsOutsideTheFrame) {
  for (const std::string& bad : {crop(15, 0, 6, 10), crop(0, 8, 20, 3), crop(1, -1, -1, -1), crop(0, 0, 0, 5),
                                 crop(16384, 16384, 16384, 16384), crop(21, 0, 1, 1)})
    EXPECT_THAT(messages(read(sensor("perspective", "", bad))),
                HasSubstr("is not within its frame of 20 x 10"))
        << bad;
  EXPECT_THAT(messages(read(sensor("perspective", "", "<integer name=\"crop_offset_x\" value=\"-1\"/>"))),
              HasSubstr("0 <= crop_offset_x"));
}

TEST(ReadFilm, CropsOfVersionZeroHaveTheirOldNames) {
  std::string text =
      sensor("perspective", "",
             "<integer name=\"cropOffsetX\" value=\"4\"/><integer name=\"cropWidth\" value=\"5\"/>");
  text.replace(text.find("3.0.0"), 5, "0.6.0");
  const Scene s = must_read(text);
  EXPECT_EQ(s.film.crop_offset[0], 4);
  EXPECT_EQ(s.film.image_size(), (FrameSize{5, 10}));
}

}  // namespace
}  // namespace ls

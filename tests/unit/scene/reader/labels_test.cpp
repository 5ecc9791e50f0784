// The names of shapes and materials, and the AOVs that a scene requests.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/json/serialize.h"
#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using testing::HasSubstr;

std::string wrapped(std::string_view channels) {
  return with_sensor("<integrator type=\"aov\"><string name=\"aovs\" value=\"" + std::string(channels) +
                     "\"/><integrator type=\"path\"/></integrator>");
}

TEST(Channels, MitsubasWrapperIsReadWithLightshaftsNames) {
  const auto r = read(wrapped("depth:depth, normal:sh_normal,uv:uv"));

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(r.scene->aovs, "depth,normal,uv");
  EXPECT_EQ(r.scene->integrator.name, "path");
  EXPECT_TRUE(r.diagnostics.empty());
}

TEST(Channels, UnknownLabelsCauseAWarning) {
  const auto r = read(wrapped("dd:depth,nn:sh_normal"));

  ASSERT_TRUE(r.scene) << messages(r);
  ASSERT_EQ(r.diagnostics.size(), 1u);
  EXPECT_THAT(r.diagnostics[0].text, HasSubstr("\"dd\" is \"depth\", \"nn\" is \"normal\""));
}

TEST(Channels, SurviveConversionAndSerialisation) {
  const Scene scene = read(wrapped("depth:depth,normal:sh_normal,shape_id:shape_id")).scene.value();

  const auto again = read(write_xml(scene));

  ASSERT_TRUE(again.scene) << messages(again);
  EXPECT_EQ(again.scene->aovs, "depth,normal,shape_id");
  EXPECT_EQ(deserialize_scene(serialize(scene)).value(), scene);
}

constexpr std::string_view kThings =
    "<bsdf type=\"twosided\"><bsdf type=\"diffuse\" id=\"inner\"/></bsdf>"
    "<bsdf type=\"diffuse\" id=\"plaster\"/>"
    "<shape type=\"sphere\" id=\"ball\"><ref id=\"plaster\"/></shape>"
    "<shape type=\"cube\"><bsdf type=\"twosided\"><bsdf type=\"diffuse\" id=\"oak\"/></bsdf></shape>"
    "<shape type=\"sphere\"><bsdf type=\"null\"/></shape>"
    "<shape type=\"shapegroup\" id=\"g\"><shape type=\"disk\"/></shape>"
    "<shape type=\"instance\" id=\"here\"><ref id=\"g\"/></shape>"
    "<shape type=\"instance\"><ref id=\"g\"/></shape>"
    "<shape type=\"shapegroup\"><shape type=\"disk\"/></shape>";

TEST(Labels, AreIdsOrElseKindAndNumber) {
  const auto r = read(with_sensor(std::string(kThings)), {.labels = true});

  ASSERT_TRUE(r.scene) << messages(r);
  const Scene& s = *r.scene;
  ASSERT_EQ(s.shape_labels.size(), s.shapes.size());
  EXPECT_EQ(s.shape_labels[0], (Label{"ball", "plaster"}));
  EXPECT_EQ(s.shape_labels[1].name, "cube_1");
  EXPECT_EQ(s.shape_labels[1].material, "oak");
  EXPECT_EQ(s.shape_labels[2].name, "sphere_2");
  EXPECT_THAT(s.shape_labels[2].material, HasSubstr("null_"));
  ASSERT_EQ(s.instance_labels.size(), 2u);
  EXPECT_EQ(s.instance_labels[0].name, "here");
  EXPECT_EQ(s.instance_labels[1].name, "instance_1");
  EXPECT_EQ(deserialize_scene(serialize(s)).value(), s);
}

TEST(Labels, AreUniqueForAnyNames) {
  const std::string mesh = R"(<shape type="ply"><string name="filename" value="mesh.ply"/></shape>)";

  const auto r = read(with_sensor(R"(<shape type="sphere" id="mesh_2"/>)" + mesh + mesh + mesh +
                                  R"(<shape type="sphere" id="mesh_4"/>)"),
                      {.labels = true});

  ASSERT_TRUE(r.scene) << messages(r);
  std::vector<std::string> names;
  for (const Label& label : r.scene->shape_labels) names.push_back(label.name);
  EXPECT_THAT(names, testing::ElementsAre("mesh_2", "mesh", "mesh_3", "mesh_4", "mesh_4_4"));
}

TEST(Labels, AreAbsentIfTheSceneIsReadWithoutThem) {
  const Scene plain = read(with_sensor(std::string(kThings))).scene.value();
  Scene labelled = read(with_sensor(std::string(kThings)), {.labels = true}).scene.value();

  EXPECT_EQ(serialize(plain).find("label"), std::string::npos);
  EXPECT_EQ(serialize(plain).find("aovs"), std::string::npos);
  labelled.shape_labels.clear();
  labelled.instance_labels.clear();
  EXPECT_EQ(digest_of(labelled), digest_of(plain));
}

TEST(Labels, WrongNumberOfLabelsIsRefused) {
  Scene s = read(with_sensor(std::string(kThings)), {.labels = true}).scene.value();
  s.shape_labels.pop_back();

  EXPECT_THAT(deserialize_scene(serialize(s)).error().message, HasSubstr("shape_labels"));
}

TEST(Labels, LongNamesAreCutBetweenCharacters) {
  std::string id = "a";
  for (int i = 0; i < 128; ++i) id += "\xC3\xA4";
  const ReadResult r = read(with_sensor("<shape type=\"sphere\" id=\"" + id + "\"/>"), {.labels = true});
  ASSERT_TRUE(r.scene);
  EXPECT_EQ(r.scene->shape_labels.at(0).name, id.substr(0, 255));
  EXPECT_EQ(deserialize_scene(serialize(*r.scene)).value(), *r.scene);
}

}  // namespace
}  // namespace ls

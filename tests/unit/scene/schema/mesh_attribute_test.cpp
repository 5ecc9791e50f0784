// Reading and writing of `mesh_attribute` textures and of `multiple_scattering`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/schema/mesh_attributes.h"
#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;
using As = scene::AttributeUse::As;

constexpr char kAttribute[] =
    R"(<texture type="mesh_attribute" name="{}"><string name="name" value="{}"/><float name="scale" value="0.5"/></texture>)";

std::string attribute(std::string_view parameter, std::string_view name) {
  return fmt::format(kAttribute, parameter, name);
}
std::string mesh(const std::string& parts) {
  return with_sensor(R"(<shape type="ply"><string name="filename" value="mesh.ply"/>)" + parts + "</shape>");
}
std::string attribute_error(const std::string& text) {
  const ReadResult r = read(text);
  return r.scene ? "" : messages(r);
}

TEST(MeshAttribute, IsReadWithItsNameAndScale) {
  const Scene s =
      must_read(mesh("<bsdf type=\"diffuse\">" + attribute("reflectance", "vertex_color") + "</bsdf>"));

  const auto& b = std::get<DiffuseBsdf>(s.bsdfs.at(s.shapes.at(0).bsdf.value));
  const auto& t = std::get<MeshAttributeTexture>(s.textures.at(b.reflectance.value));
  EXPECT_EQ(t.name, "vertex_color");
  EXPECT_EQ(t.scale, .5);
  EXPECT_EQ(deserialize_scene(serialize(s)).value(), s);
  EXPECT_EQ(must_read(write_xml(s)), s);
}

TEST(MeshAttribute, ErrorExplainsItsUse) {
  const Scene s = must_read(mesh(
      R"(<bsdf type="blendbsdf">)" + attribute("weight", "vertex_w") + R"(<bsdf type="normalmap">)" +
      attribute("normalmap", "face_n") + R"(<bsdf type="roughconductor">)" + attribute("alpha", "vertex_a") +
      R"(</bsdf></bsdf><bsdf type="diffuse"><texture type="checkerboard" name="reflectance">)" +
      attribute("color0", "vertex_c") + R"(</texture></bsdf></bsdf><emitter type="area">)" +
      attribute("radiance", "face_l") + "</emitter>"));

  std::vector<std::string> uses;
  for (const scene::AttributeUse& use : scene::attribute_uses(s, s.shapes.at(0)))
    uses.push_back(fmt::format("{} {}{}",
                               std::get<MeshAttributeTexture>(s.textures.at(use.texture.value)).name,
                               use.as == As::number   ? "number"
                               : use.as == As::colour ? "colour"
                                                      : "any",
                               use.in_light ? " light" : ""));
  EXPECT_THAT(uses, ::testing::UnorderedElementsAre("vertex_w number", "face_n colour", "vertex_a number",
                                                    "vertex_c any", "face_l any light"));
}

TEST(MeshAttribute, ShapeWithoutAttributesIsRefusedWithItsPlace) {
  const std::string bsdf = "<bsdf type=\"diffuse\">" + attribute("reflectance", "vertex_color") + "</bsdf>";
  EXPECT_THAT(
      attribute_error(with_sensor("<shape type=\"sphere\">" + bsdf + "</shape>")),
      HasSubstr("test.xml:2:2: error: this sphere has no attribute \"vertex_color\", which its bsdf reads"));
  EXPECT_THAT(attribute_error(with_sensor(R"(<shape type="obj"><string name="filename" value="mesh.obj"/>)" +
                                          bsdf + "</shape>")),
              HasSubstr("only a \"ply\" mesh has attributes"));
  EXPECT_THAT(attribute_error(with_sensor("<shape type=\"disk\"><emitter type=\"area\">" +
                                          attribute("radiance", "face_l") + "</emitter></shape>")),
              HasSubstr("which its emitter reads"));
  EXPECT_THAT(
      attribute_error(with_sensor("<emitter type=\"projector\">" + attribute("irradiance", "vertex_color") +
                                  "</emitter>")),
      HasSubstr("'irradiance' of emitter \"projector\" can't be the mesh attribute \"vertex_color\""));
  EXPECT_THAT(attribute_error(with_sensor("<emitter type=\"spot\">" + attribute("texture", "vertex_color") +
                                          "</emitter>")),
              HasSubstr("'texture' of emitter \"spot\" can't be"));
}

TEST(MeshAttribute, NeedsANameOfAVertexOrFace) {
  for (const char* name : {"color", "vertex_", "edge_color"})
    EXPECT_THAT(attribute_error(mesh("<bsdf type=\"diffuse\">" + attribute("reflectance", name) + "</bsdf>")),
                HasSubstr("their names begin with \"vertex_\" or \"face_\""))
        << name;
  EXPECT_THAT(attribute_error(mesh(
                  "<bsdf type=\"diffuse\"><texture type=\"mesh_attribute\" name=\"reflectance\"/></bsdf>")),
              HasSubstr("'name'"));
}

// Textures that contain each other occur only in hostile JSON. The search ends nevertheless.
TEST(MeshAttribute, IsFoundInCyclicReferences) {
  Scene s;
  s.textures = {CheckerboardTexture{{1}, {2}, {}}, CheckerboardTexture{{0}, {7}, {}},
                MeshAttributeTexture{"face_a"}};
  s.bsdfs = {TwoSidedBsdf{{0}, {1}}, DiffuseBsdf{{0}}};
  Shape shape;
  shape.bsdf = {0};
  EXPECT_EQ(scene::attribute_uses(s, shape).size(), 1u);
}

// ---- multiple_scattering
std::string rough(const std::string& type, const std::string& parts) {
  return with_sensor("<shape type=\"sphere\"><bsdf type=\"" + type + "\">" + parts + "</bsdf></shape>");
}
constexpr char kOn[] = R"(<boolean name="multiple_scattering" value="true"/>)",
               kOff[] = R"(<boolean name="multiple_scattering" value="false"/>)";

TEST(MultipleScattering, ChangesTheDigestOfASceneOnlyWhereItIsOn) {
  for (const char* type : {"roughconductor", "roughdielectric", "roughplastic"}) {
    const Scene without = must_read(rough(type, "")), off = must_read(rough(type, kOff)),
                on = must_read(rough(type, kOn));
    EXPECT_EQ(serialize(without), serialize(off)) << type;
    EXPECT_EQ(serialize(without).find("multiple_scattering"), std::string::npos);
    EXPECT_EQ(write_xml(without).find("multiple_scattering"), std::string::npos);
    EXPECT_NE(digest_of(without), digest_of(on)) << type;
    EXPECT_EQ(deserialize_scene(serialize(on)).value(), on) << type;
    EXPECT_EQ(must_read(write_xml(on)), on) << type;
  }
}

// A scene has only one JSON text, so a default that the writer leaves out must not be present.
TEST(MultipleScattering, HasOneCanonicalForm) {
  std::string json = serialize(must_read(rough("roughplastic", kOn)));
  const std::size_t at = json.find("\"multiple_scattering\":true");
  ASSERT_NE(at, std::string::npos);
  json.replace(at, 26, "\"multiple_scattering\":false");
  const auto read = deserialize_scene(json);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("multiple_scattering has the value that is left out"));
}

TEST(MultipleScattering, NeedsOneRoughnessThatIsANumber) {
  EXPECT_THAT(
      attribute_error(rough("roughconductor", std::string(kOn) + R"(<float name="alpha_u" value=".1"/>)")),
      ::testing::IsEmpty());  // .1 is also the default of alpha_v
  EXPECT_THAT(
      attribute_error(rough("roughconductor", std::string(kOn) + R"(<float name="alpha_u" value=".2"/>)")),
      HasSubstr("the same roughness both ways: give alpha"));
  EXPECT_THAT(attribute_error(rough("roughdielectric",
                                    std::string(kOn) + R"(<texture type="checkerboard" name="alpha"/>)")),
              HasSubstr("needs a roughness that is a number, not a texture"));
}

}  // namespace
}  // namespace ls

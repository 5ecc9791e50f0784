// Files at and beyond the limits of their size: the time to read or refuse them is linear in the size.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/limits.h"
#include "tests/unit/scene/gltf/gltf_testing.h"
#include "tests/unit/scene/nori_testing.h"
#include "tests/unit/scene/pbrt/pbrt_testing.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

// Comparing each reference with every id, letter by letter, would take days.
TEST(HostileScenes, ManyUnresolvedReferencesAndIdsAreHandledQuickly) {
  const std::string filler(40, 'y');
  std::string text;
  for (int i = 0; i < 150'000; ++i) text += fmt::format("<bsdf type=\"null\" id=\"{}{}\"/>", filler, i);
  text += "<bsdf type=\"twosided\">";
  for (int i = 0; i < 150'000; ++i) text += fmt::format("<ref id=\"{}{}\"/>", std::string(40, 'x'), i);
  const auto r = read(with_sensor(text + "</bsdf>"));
  EXPECT_EQ(r.diagnostics.size(), scene::kMaxDiagnostics);
  EXPECT_THAT(first(r), HasSubstr("no object has the id \"xxx"));
}

// The same for references in nested objects, which are resolved only when the outer object is converted.
TEST(HostileScenes, ReadingEndsWithinAnObjectWhenTheReportIsFull) {
  const std::string filler(40, 'y');
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += fmt::format("<bsdf type=\"null\" id=\"{}{}\"/>", filler, i);
  text += "<shape type=\"cube\">";
  for (int i = 0; i < 100'000; ++i)
    text += fmt::format("<bsdf type=\"diffuse\"><ref name=\"reflectance\" id=\"{}{}\"/></bsdf>",
                        std::string(40, 'x'), i);
  EXPECT_LE(read(with_sensor(text + "</shape>")).diagnostics.size(), scene::kMaxDiagnostics);
}

TEST(HostileScenes, ColumnsInAHugeLineAreNotComputedForHiddenWarnings) {
  std::string text = std::string(std::size_t{12} << 20, ' ') + kSensor;
  for (int i = 0; i < 300'000; ++i) text += "<sensor type=\"perspective\"/>";
  const auto r = read("<scene version=\"3.0.0\">" + text + "</scene>");
  EXPECT_TRUE(r.scene);
  ASSERT_EQ(r.diagnostics.size(), scene::kMaxDiagnostics);
  EXPECT_THAT(first(r), HasSubstr("a second sensor; the first (line 1) is used"));
}

TEST(HostileScenes, LongNameAfterADollarIsFoundWithoutTryingAllPrefixes) {
  std::string text = "<default name=\"a\" value=\"\"/>";
  const std::string run(65'000, 'a');
  for (int i = 0; i < 450; ++i) text += "<bsdf type=\"null\" id=\"$" + run + "\"/>";
  EXPECT_THAT(first(read(with_sensor(text))), HasSubstr("is given twice"));
}

// Comparing each name with all names before it would take half an hour.
TEST(HostileScenes, HugeNoriObjectIsRefusedBeforeItsElementsAreRead) {
  std::string text = "<mesh type=\"sphere\">";
  for (int i = 0; i < 400'000; ++i) text += fmt::format("<float name=\"a{}\" value=\"1\"/>", i);
  const auto r = read(nori_scene(text + "</mesh>"));
  EXPECT_FALSE(r.scene);
  ASSERT_EQ(r.diagnostics.size(), 1u);  // about the mesh, none about its elements
  EXPECT_THAT(first(r), HasSubstr("mesh \"sphere\" has 400000 elements in it; 4096 are allowed"));
}

TEST(HostileScenes, CountlessUnusedDefinesAreReportedQuickly) {
  std::map<std::string, std::string> defines;
  std::string text;
  for (int i = 0; i < 2000; ++i) {
    defines[fmt::format("{}{}", std::string(58, 'x'), i)] = "1";
    text += fmt::format("<default name=\"{}{}\" value=\"\"/>", std::string(58, 'y'), i);
  }
  const auto r = read(with_sensor(text), {.defines = defines});
  EXPECT_TRUE(r.scene);
  EXPECT_EQ(r.diagnostics.size(), scene::kMaxDiagnostics);
}

TEST(GltfHostile, ManyValuesAreRefused) {
  std::string many = "{\"extras\":[";
  for (std::size_t i = 0; i <= scene::kMaxGltfValues; ++i) many += "1,";
  many += "1]}";

  EXPECT_NE(said_of(many).find("more than 2000000 values"), std::string::npos);
}

// Every primitive looks up several members of its material. A linear search for them would take hours.
TEST(GltfHostile, FindsMembersAmongAMillion) {
  GltfFile file;
  json& primitives = file.j["meshes"][0]["primitives"];
  primitives = json(50'000, primitives[0]);
  for (std::size_t i = 0; i < 1'000'000; ++i) file.material()[std::to_string(i)] = 0;
  file.material()["alphaMode"] = "FADE";

  EXPECT_NE(said_of(file.glb()).find("materials[0].alphaMode: alphaMode is OPAQUE, MASK or BLEND"),
            std::string::npos);
}

TEST(GltfHostile, ManyInstancesAreRefused) {
  GltfFile file;
  const std::size_t moves = file.add(std::vector<float>(3 * 200'000, 1), "VEC3");
  file.j["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", moves}};

  EXPECT_NE(said_of(file.glb()).find("the scene is too large"), std::string::npos);
}

TEST(GltfHostile, TooManyMeshVariantsAreRefused) {
  GltfFile file;
  json& primitives = file.j["meshes"][0]["primitives"];
  primitives = json(10'000, {{"attributes", {{"POSITION", file.add(std::vector<float>{0, 0, 0}, "VEC3")}}},
                             {"targets", json(1, json::object())}});
  for (std::size_t i = 0; i < 30; ++i) {
    file.j["nodes"].push_back({{"mesh", 0}, {"weights", {i + 1}}});
    file.j["scenes"][0]["nodes"].push_back(3 + i);
  }

  EXPECT_NE(said_of(file.glb()).find("meshes[0]: more than 500000 primitives and morph targets are read"),
            std::string::npos);
}

TEST(Pbrt, SizeIsLimited) {
  std::string many, grouped = "ObjectBegin \"o\" ";
  for (std::size_t i = 0; i <= scene::kMaxElements / 3; ++i) many += "Shape \"sphere\" ";

  EXPECT_NE(refusal(many).find("the scene is too large"), std::string::npos);
  EXPECT_NE(refusal(grouped + many).find("the scene is too large"), std::string::npos);
}

TEST(Pbrt, VerticesInTheTextAreLimited) {
  std::string corners = R"(Texture "t" "spectrum" "imagemap" "string filename" "wood.png"
Material "diffuse" "texture reflectance" "t"
Shape "trianglemesh" "point3 P" [ 0 0 0  1 0 0  0 1 0 ] "integer indices" [ )";
  for (std::size_t i = 0; i <= (std::size_t{1} << 22) / 3; ++i) corners += "0 1 2 ";

  EXPECT_NE(refusal(corners + "]").find("more than 4194304 corners that need uv of their own"),
            std::string::npos);
}

}  // namespace
}  // namespace ls

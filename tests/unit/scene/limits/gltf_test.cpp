// glTF files at and beyond the size limits.
#include "common/scene/limits.h"
#include "tests/unit/scene/gltf/gltf_testing.h"

namespace ls {
namespace {

using nlohmann::json;

TEST(GltfHostile, ManyValuesAreRefused) {
  std::string many = "{\"extras\":[";
  for (std::size_t i = 0; i <= scene::kMaxGltfValues; ++i) many += "1,";
  many += "1]}";

  EXPECT_NE(said_of(many).find("more than 2000000 values"), std::string::npos);
}

// Every primitive looks up several members of its material. A linear search for them would take hours.
TEST(GltfHostile, MembersAreFoundAmongAMillion) {
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

TEST(GltfHostile, ManyFormsOfManyPrimitivesAreRefused) {
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

}  // namespace
}  // namespace ls

// Errors in glTF files: their places and messages. No file causes a crash or a long run.
#include <functional>

#include "core/scene/limits.h"
#include "formats/gltf/support_table.h"
#include "tests/unit/scene/gltf/gltf_testing.h"

namespace ls {
namespace {

using nlohmann::json;

struct Case {
  std::string name;
  std::function<void(GltfFile&)> spoil;
  std::string want;  // part of the messages
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class GltfRefuses : public ::testing::TestWithParam<Case> {};

TEST_P(GltfRefuses, RefusalsHaveAPathAndAdvice) {
  GltfFile file;
  GetParam().spoil(file);

  const ReadResult r = read_gltf(file);

  EXPECT_FALSE(r.scene);
  EXPECT_NE(messages(r).find(GetParam().want), std::string::npos) << messages(r);
}

INSTANTIATE_TEST_SUITE_P(
    All, GltfRefuses,
    ::testing::Values(
        Case{"OldVersion", [](GltfFile& f) { f.j["asset"]["version"] = "1.0"; },
             "asset.version: the asset's version is \"1.0\", and only 2.0 is read"},
        Case{"VersionAsNumber", [](GltfFile& f) { f.j["asset"]["version"] = 1; },
             ": error: asset.version: the asset has no version that is a text, as \"2.0\" is, and only 2.0 is read"},
        Case{"NoVersion", [](GltfFile& f) { f.j.erase("asset"); }, "and only 2.0 is read"},
        Case{"Draco", [](GltfFile& f) { f.j["extensionsRequired"] = {"KHR_draco_mesh_compression"}; },
             "extensionsRequired[0]: KHR_draco_mesh_compression is not read: unpack the file"},
        Case{"Unknown",
             [](GltfFile& f) {
               f.j["extensionsRequired"] = {"KHR_mesh_quantization", "ACME_magic"};
             },
             "extensionsRequired[1]: ACME_magic is not known here, and the file can't do without it"},
        Case{"NoSuchMesh", [](GltfFile& f) { f.j["nodes"][0]["mesh"] = 7; },
             "nodes[0].mesh: a whole number from 0 to 0 is wanted here"},
        Case{"NegativeIndex", [](GltfFile& f) { f.j["nodes"][0]["mesh"] = -1; },
             "nodes[0].mesh: a whole number"},
        Case{"FractionAsIndex", [](GltfFile& f) { f.j["nodes"][0]["mesh"] = .5; },
             "nodes[0].mesh: a whole number"},
        Case{"TextAsIndex", [](GltfFile& f) { f.j["nodes"][0]["mesh"] = "a"; },
             "nodes[0].mesh: a whole number"},
        Case{"NoSuchList", [](GltfFile& f) { f.j.erase("cameras"); }, "nodes[1].camera: there is nothing"},
        Case{"Cycle", [](GltfFile& f) { f.j["nodes"][0]["children"] = {0}; },
             "nodes[0].children[0]: this node stands in the scene already"},
        Case{"TwoParents",
             [](GltfFile& f) {
               f.j["scenes"][0]["nodes"] = {0, 0};
             },
             "scenes[0].nodes[1]: this node stands in the scene already"},
        Case{"NoTurn",
             [](GltfFile& f) {
               f.j["nodes"][0]["rotation"] = {0, 0, 0, 0};
             },
             "nodes[0].rotation: a rotation is a quaternion of length 1"},
        Case{"ThreeForFour",
             [](GltfFile& f) {
               f.j["nodes"][0]["rotation"] = {0, 0, 0};
             },
             "nodes[0].rotation: 4 numbers are wanted here"},
        Case{"NoPosition", [](GltfFile& f) { f.attributes() = json::object(); },
             "meshes[0].primitives[0]: a primitive needs the attribute POSITION"},
        Case{"CornerOutOfRange",
             [](GltfFile& f) {
               f.primitive()["indices"] = f.add(std::vector<std::uint16_t>{0, 1, 3}, "SCALAR");
             },
             "meshes[0].primitives[0].indices: there is no corner 3: POSITION has 3, counted from 0"},
        Case{"FloatIndices",
             [](GltfFile& f) {
               f.primitive()["indices"] = f.add(std::vector<float>{0, 1, 2}, "SCALAR");
             },
             "accessors[1]: indices are of type SCALAR and of componentType 5121, 5123 or 5125"},
        Case{"WrongType", [](GltfFile& f) { f.j["accessors"][0]["type"] = "VEC2"; },
             "accessors[0].type: VEC3 is wanted for this use"},
        Case{"NoType", [](GltfFile& f) { f.j["accessors"][0].erase("type"); },
             "accessors[0]: an accessor needs"},
        Case{"BeyondView", [](GltfFile& f) { f.j["accessors"][0]["count"] = 4; },
             "accessors[0]: 4 elements end at byte 48, beyond the buffer view, which has 36"},
        Case{"HugeCount", [](GltfFile& f) { f.j["accessors"][0]["count"] = 4294967295u; },
             "accessors[0]: 4294967295 elements end at byte"},
        Case{"HugerCount", [](GltfFile& f) { f.j["accessors"][0]["count"] = 1e300; }, "accessors[0]"},
        Case{"HugeOffset", [](GltfFile& f) { f.j["accessors"][0]["byteOffset"] = 4294967295u; },
             "beyond the buffer view"},
        Case{"HugeView", [](GltfFile& f) { f.j["bufferViews"][0]["byteLength"] = 2147483648u; },
             "bufferViews[0]: bytes 0 to 2147483648 are beyond its buffer, which has 36"},
        Case{"HugeBuffer",
             [](GltfFile& f) {
               f.j["buffers"] = {{{"byteLength", 2147483648u}}};
             },
             "buffers[0].byteLength: 2147483648 bytes are announced, but there are 36"},
        Case{"HugeNothing",
             [](GltfFile& f) {
               f.j["accessors"][0] = {{"componentType", 5126}, {"count", 2147483648u}, {"type", "VEC3"}};
             },
             "elements without a buffer view, which are all 0: at most 1048576 of a file are read"},
        Case{"SparseOutOfRange",
             [](GltfFile& f) {
               f.add(std::vector<std::uint8_t>{3}, "SCALAR");
               f.j["accessors"][0]["sparse"] = {{"count", 1},
                                                {"indices", {{"bufferView", 1}, {"componentType", 5121}}},
                                                {"values", {{"bufferView", 0}}}};
             },
             "accessors[0].sparse.indices: number 0 is 3, but the accessor has 3 elements"},
        Case{"NotANumber",
             [](GltfFile& f) {
               f.attributes()["POSITION"] =
                   f.add(std::vector<float>{0, 0, 0, 1, 0, 0, 0, std::numeric_limits<float>::quiet_NaN(), 0},
                         "VEC3");
             },
             "accessors[1]: element 2 is not a finite number"},
        Case{"LessNormals",
             [](GltfFile& f) {
               f.attributes()["NORMAL"] = f.add(std::vector<float>{0, 0, 1}, "VEC3");
             },
             "meshes[0].primitives[0].attributes.NORMAL: 1 elements, but POSITION has 3"},
        Case{"BrokenData",
             [](GltfFile& f) {
               f.j["buffers"] = {{{"byteLength", 36}, {"uri", "data:;base64,??"}}};
             },
             "buffers[0].uri: this data URI is broken"},
        Case{"Elsewhere",
             [](GltfFile& f) {
               f.j["buffers"] = {{{"byteLength", 36}, {"uri", "https://example.com/a.bin"}}};
             },
             "buffers[0].uri: nothing is fetched from elsewhere"},
        Case{"NameThatIsNoText", [](GltfFile& f) { f.j["buffers"] = {{{"byteLength", 36}, {"uri", "a%ff.bin"}}}; },
             "buffers[0].uri: this names no file"},
        Case{"NameWithAControl", [](GltfFile& f) { f.j["buffers"] = {{{"byteLength", 36}, {"uri", "a%0a.bin"}}}; },
             "buffers[0].uri: this names no file"},
        Case{"MissingFile",
             [](GltfFile& f) {
               f.j["buffers"] = {{{"byteLength", 36}, {"uri", "a.bin"}}};
             },
             "buffers[0].uri: there is no file \"a.bin\""},
        Case{"MissingImage",
             [](GltfFile& f) {
               f.j["images"][0]["uri"] = "oak.png";
               f.pbr()["baseColorTexture"] = {{"index", 0}};
             },
             "there is no file \"oak.png\""},
        Case{"WebP",
             [](GltfFile& f) {
               f.j["images"][0]["uri"] = "oak.webp";
               f.pbr()["baseColorTexture"] = {{"index", 0}};
             },
             "images[0].uri: \"oak.webp\" is no PNG or JPEG"},
        Case{"Basis",
             [](GltfFile& f) {
               f.j["textures"][0] = {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}};
               f.pbr()["baseColorTexture"] = {{"index", 0}};
             },
             "textures[0]: this texture has no source that is read: images in KTX2"},
        Case{"BadAlpha", [](GltfFile& f) { f.material()["alphaMode"] = "FADE"; },
             "materials[0].alphaMode: alphaMode is OPAQUE, MASK or BLEND"},
        Case{"BrightPaint",
             [](GltfFile& f) {
               f.pbr()["baseColorFactor"] = {2, 1, 1, 1};
             },
             "materials[0]: "},
        Case{"LowIndex", [](GltfFile& f) { f.material()["extensions"]["KHR_materials_ior"]["ior"] = .5; },
             "materials[0].extensions.KHR_materials_ior.ior: an index of refraction of at least 1 is read"},
        Case{"BadLight",
             [](GltfFile& f) { f.j["extensions"]["KHR_lights_punctual"]["lights"][0]["type"] = "area"; },
             "extensions.KHR_lights_punctual.lights[0].type: a light is \"directional\""},
        Case{"WideSpot",
             [](GltfFile& f) {
               f.j["extensions"]["KHR_lights_punctual"]["lights"][0] = {{"type", "spot"},
                                                                        {"spot", {{"outerConeAngle", 2}}}};
             },
             "lights[0].spot: a cone is wanted"},
        Case{"FlatView", [](GltfFile& f) { f.j["cameras"][0]["perspective"]["yfov"] = 0; },
             "cameras[0].perspective: yfov is wanted"},
        Case{"ListForObject", [](GltfFile& f) { f.j["materials"][0] = json::array(); },
             "materials[0]: an object is wanted here"}),
    [](const auto& info) { return info.param.name; });

TEST(GltfHostile, SurvivesTruncationAtEveryByte) {
  GltfFile file;
  file.primitive()["indices"] = file.add(std::vector<std::uint8_t>{0, 1, 2}, "SCALAR");
  const std::string whole = file.glb();

  for (std::size_t n = 0; n < whole.size(); ++n) EXPECT_FALSE(said_of(whole.substr(0, n)).empty()) << n;
  EXPECT_NE(said_of(whole.substr(0, whole.size() - 4)).find("it is cut off, copy it again"),
            std::string::npos);
}

TEST(GltfHostile, RefusesFalseHeaders) {
  const std::string whole = GltfFile().glb();
  const auto with = [&](std::size_t at, std::uint32_t x) {
    std::string out = whole;
    return out.replace(at, 4, GltfFile::word(x));
  };

  EXPECT_NE(said_of(with(4, 1)).find("glTF of version 1 is not read, only 2"), std::string::npos);
  EXPECT_NE(said_of(with(8, 0xffffffff)).find("announces 4294967295 bytes"), std::string::npos);
  EXPECT_NE(said_of(with(12, 0xffffffff)).find("the chunk at byte 12 announces 4294967295 bytes"),
            std::string::npos);
  EXPECT_NE(said_of(with(16, 0x004e4942)).find("the first chunk of a .glb"), std::string::npos);
  EXPECT_FALSE(said_of(with(8, 0)).empty());
  EXPECT_FALSE(said_of(with(12, 0)).empty());
}

TEST(GltfHostile, RefusesTextThatIsNotGltf) {
  for (const char* text :
       {"", "{", "[]", "3", "\"a\"", "null", "{}", "{\"asset\":3}", "{\"asset\":{\"version\":2}}", "<scene/>",
        "\xff", "{\"asset\":{\"version\":\"2.0\"},\"nodes\":3}",
        "{\"asset\":{\"version\":\"2.0\",\"x\":1e999}}"})
    EXPECT_FALSE(said_of(text).empty()) << text;
}

TEST(GltfHostile, ErrorPlacesMatchTheText) {
  const std::string said =
      said_of("{\n  \"asset\": {\n    \"version\": \"2.0\"\n  },\n  \"scene\": true,\n  \"scenes\": [{}]\n}");

  EXPECT_NE(said.find("test.glb:5:3: error: scene: a whole number from 0 to 0 is wanted here"),
            std::string::npos)
      << said;
}

TEST(GltfHostile, NestingIsLimited) {
  const std::string deep(100'000, '[');

  EXPECT_NE(said_of("{\"extras\":" + deep).find("values are nested more than 64 deep"), std::string::npos);
}

TEST(GltfHostile, NodeNestingIsLimited) {
  GltfFile file;
  for (std::size_t i = 3; i < scene::kMaxGltfNodes + 5; ++i)
    file.j["nodes"].push_back({{"children", {i + 1}}});
  file.j["nodes"].push_back(json::object());
  file.j["scenes"][0]["nodes"] = {3};

  EXPECT_NE(said_of(file.glb()).find("nodes are nested more than 256 deep"), std::string::npos);
}

TEST(GltfHostile, SizeIsLimited) {
  EXPECT_NE(said_of(std::string(scene::kMaxTextBytes + 1, ' '))
                .find("a scene file may have 33554432: export it as a .gltf"),
            std::string::npos);
}

std::string said_at_second_0(const GltfFile& file) {
  ReadOptions options;
  options.defines["time"] = "0";
  return said_of(file.glb(), options);
}

TEST(GltfHostile, ManyWeightsAreRefused) {
  const json many(scene::kMaxGltfTargets + 1, 1);
  GltfFile file;
  file.primitive()["targets"] = json(many.size(), json::object());
  file.j["meshes"][0]["weights"] = many;
  EXPECT_NE(said_of(file.glb()).find("meshes[0].weights: 4097 weights: at most 4096 are read"),
            std::string::npos);

  file.j["meshes"][0].erase("weights");
  const std::size_t input = file.add(std::vector<float>{0}, "SCALAR"),
                    output = file.add(std::vector<float>(many.size(), 1), "SCALAR");
  const json sampler = {{"input", input}, {"output", output}};
  file.j["animations"] = {{{"samplers", {sampler}},
                           {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}}}}}};
  EXPECT_NE(said_at_second_0(file).find(
                "animations[0].samplers[0].output: 4097 numbers a time: at most 4096 are read"),
            std::string::npos);

  json& accessor = file.j["accessors"][output];
  accessor["count"] = scene::kMaxGltfTargets;
  json& animation = file.j["animations"][0];
  for (std::size_t i = 1; i <= scene::kMaxGltfValues / scene::kMaxGltfTargets + 1; ++i) {
    json channel = animation["channels"][0];
    channel["sampler"] = i;
    animation["samplers"].push_back(sampler);
    animation["channels"].push_back(channel);
  }
  EXPECT_NE(said_at_second_0(file).find("animations give more than 2000000 numbers at a time"),
            std::string::npos);
}

TEST(GltfHostile, ManySetsOfJointsAreRefused) {
  GltfFile file;
  const std::size_t joints = file.add(std::vector<std::uint8_t>(12, 0), "VEC4"),
                    weights = file.add(std::vector<float>(12, 1), "VEC4");
  for (std::size_t i = 0; i <= scene::kMaxGltfJointSets; ++i) {
    file.attributes()["JOINTS_" + std::to_string(i)] = joints;
    file.attributes()["WEIGHTS_" + std::to_string(i)] = weights;
  }
  file.j["nodes"][0]["skin"] = 0;
  file.j["skins"] = {{{"joints", {0}}}};

  EXPECT_NE(said_of(file.glb()).find("attributes.JOINTS_8: at most 8 sets of joints are read"),
            std::string::npos);
}

TEST(Gltf, UnknownChoicesAreRefused) {
  const std::string file = GltfFile().glb();
  ReadOptions unknown, dark;
  unknown.defines["camra"] = "x";
  dark.defines["environment"] = "-1";

  EXPECT_NE(
      said_of(file, unknown)
          .find("-D camra: of a glTF file only camera, environment, animation, time, fps can be chosen"),
      std::string::npos);
  EXPECT_NE(said_of(file, dark).find("-D environment=-1 wants a number from"), std::string::npos);
}

TEST(Gltf, ReaderKnowsAllExtensionsOfTheTable) {
  for (const auto& row : scene::gltf::extensions()) {
    GltfFile file;
    file.j["extensionsUsed"] = {row.name};
    const ReadResult used = read_gltf(file);
    file.j["extensionsRequired"] = {row.name};
    const ReadResult required = read_gltf(file);

    EXPECT_TRUE(used.scene) << messages(used);
    EXPECT_EQ(used.diagnostics.empty(), row.use != scene::gltf::Use::ignored) << messages(used);
    EXPECT_EQ(required.scene.has_value(), row.use != scene::gltf::Use::refused) << messages(required);
  }
}

TEST(Gltf, UnusedContentIsAWarning) {
  GltfFile file;
  file.j["animations"] = {json::object()};
  file.material()["normalTexture"] = {{"index", 0}, {"scale", .5}};
  file.material()["alphaMod"] = "MASK";
  file.material()["extras"] = {{"anything", 1}};
  file.material()["extensions"]["ACME_paint"] = json::object();
  file.material()["extensions"]["KHR_materials_sheen"] = json::object();
  file.material()["extensions"]["KHR_materials_ior"] = {{"IOR", 2}};
  file.attributes()["COLOR_1"] = file.attributes()["_MINE"] = file.attributes()["POSITION"];
  file.j["extensions"]["KHR_lights_punctual"]["lights"][0]["range"] = 10;

  const ReadResult r = read_gltf(file);

  ASSERT_TRUE(r.scene) << messages(r);
  for (const char* want :
       {"animations: what moves is seen as the nodes themselves say",
        "materials[0].normalTexture.scale: the strength of a normal map counts as 1 here",
        "materials[0].alphaMod: a material has no member alphaMod, which has no effect; did you "
        "mean 'alphaMode'?",
        "materials[0].extensions.ACME_paint: ACME_paint is not known here, and has no effect",
        "materials[0].extensions.KHR_materials_sheen: KHR_materials_sheen has no effect",
        "KHR_materials_ior.IOR: KHR_materials_ior has no member IOR",
        "attributes.COLOR_1: the attribute COLOR_1 has no effect",
        "lights[0].range: range has no effect: light has no end here"})
    EXPECT_NE(messages(r).find(want), std::string::npos) << want << "\n" << messages(r);
  EXPECT_EQ(r.diagnostics.size(), 8u) << "quiet are extras and _MINE: " << messages(r);
}

TEST(Gltf, UnusedContentIsReportedOnce) {
  GltfFile file;
  file.j["extensionsUsed"] = {"ACME_paint"};
  for (int i = 0; i < 3; ++i)
    file.j["materials"].push_back({{"extensions", {{"ACME_paint", json::object()}}}, {"colour", 1}});

  const ReadResult r = read_gltf(file);

  EXPECT_EQ(r.diagnostics.size(), 2u) << messages(r);
}

TEST(Gltf, MissingMeshFileNamesItsSource) {
  MemoryAssets assets;

  const ReadResult r = read_scene("t.glb", GltfFile().glb(), assets);

  EXPECT_FALSE(r.scene);
  EXPECT_NE(messages(r).find("which `lightshaft submit` sends along"), std::string::npos) << messages(r);
}

}  // namespace
}  // namespace ls

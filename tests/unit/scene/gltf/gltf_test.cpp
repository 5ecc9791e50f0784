// Translation of glTF's nodes, meshes, cameras and lights.
#include "tests/unit/scene/gltf/gltf_testing.h"

#include <cmath>
#include <numbers>

namespace ls {
namespace {

constexpr double kPi = std::numbers::pi;

// The only .ply file that was made. `numbers` are the floats of its corners, `corners` those of its
// triangles.
struct Ply {
  std::string header;
  std::vector<float> numbers;
  std::vector<std::uint32_t> corners;
};
Ply made_ply(const KeepingAssets& assets) {
  Ply out;
  for (const auto& [name, bytes] : assets.memory.files) {
    if (!name.starts_with("mesh-")) continue;
    EXPECT_TRUE(out.header.empty()) << "a second mesh was made";
    const std::string end = "end_header\n";
    const std::size_t begin = bytes.find(end) + end.size();
    out.header = bytes.substr(0, begin);
    const auto count = [&](const std::string& what) {
      return std::stoul(out.header.substr(out.header.find(what) + what.size()));
    };
    std::size_t properties = 0;
    for (auto at = out.header.find("property float"); at != std::string::npos;
         at = out.header.find("property float", at + 1))
      ++properties;
    out.numbers.resize(count("element vertex ") * properties);
    std::memcpy(out.numbers.data(), bytes.data() + begin, out.numbers.size() * 4);
    const std::size_t faces = begin + out.numbers.size() * 4;
    for (std::size_t i = 0; i < count("element face "); ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        std::uint32_t corner;
        std::memcpy(&corner, bytes.data() + faces + 13 * i + 1 + 4 * k, 4);
        out.corners.push_back(corner);
      }
  }
  return out;
}

Ply ply_of(const GltfFile& file) {
  KeepingAssets assets;
  const ReadResult r = read_gltf(file.glb(), assets);
  EXPECT_TRUE(r.scene) << messages(r);
  return made_ply(assets);
}

using Corners = std::vector<std::uint32_t>;
using Floats = std::vector<float>;

TEST(Gltf, IsTheSameSceneAsItsTranslation) {
  const GltfFile file;
  KeepingAssets assets;

  const ReadResult one = read_gltf(file.glb(), assets);
  std::string name;
  for (const auto& [made, bytes] : assets.memory.files)
    if (made.starts_with("mesh-")) name = made;
  const std::string xml = fmt::format(R"(<scene version="3.0.0"><integrator type="volpath"/>
    <shape type="ply"><string name="filename" value="{}"/><boolean name="face_normals" value="true"/>
      <bsdf type="twosided"><bsdf type="roughplastic"><string name="distribution" value="ggx"/><float name="alpha" value="0.25"/>
        <float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/><rgb name="diffuse_reflectance" value="1"/>
        <boolean name="multiple_scattering" value="true"/></bsdf></bsdf></shape>
    <emitter type="directional"><vector name="direction" x="0" y="0" z="-1"/><rgb name="irradiance" value="3"/></emitter>
    <sensor type="perspective"><float name="fov" value="{}"/><string name="fov_axis" value="y"/><float name="near_clip" value="0.1"/>
      <float name="far_clip" value="1e7"/><transform name="to_world"><matrix value="-1 0 0 0 0 1 0 0 0 0 -1 5 0 0 0 1"/></transform>
      <sampler type="independent"><integer name="sample_count" value="64"/></sampler>
      <film type="hdrfilm"><integer name="width" value="1280"/><integer name="height" value="720"/></film></sensor></scene>)",
                                      name, .8 * (180 / kPi));
  const ReadResult other = read_scene("other.xml", xml, assets);

  ASSERT_TRUE(one.scene) << messages(one);
  ASSERT_TRUE(other.scene) << messages(other);
  EXPECT_TRUE(one.diagnostics.empty()) << messages(one);
  EXPECT_EQ(serialize(*one.scene), serialize(*other.scene));
}

TEST(Gltf, JsonWithFilesBesideItIsTheSameAsAGlb) {
  GltfFile file;
  const Scene glb = gltf(file);
  KeepingAssets assets;
  assets.memory.files["my data.bin"] = file.bytes;
  file.j["buffers"] = {{{"byteLength", file.bytes.size()}, {"uri", "my%20data.bin"}}};

  const ReadResult r = read_scene("test.gltf", file.j.dump(2), assets);

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(serialize(*r.scene), serialize(glb));
}

TEST(Gltf, ReadsBase64InTheText) {
  GltfFile file;
  file.j["images"][0] = {{"uri", "data:image/png;base64,iVBORw0KGgo="}};
  file.pbr()["baseColorTexture"] = {{"index", 0}};
  KeepingAssets assets;

  const ReadResult r = read_gltf(file.glb(), assets);

  ASSERT_TRUE(r.scene) << messages(r);
  const auto made = std::find_if(assets.memory.files.begin(), assets.memory.files.end(),
                                 [](const auto& f) { return f.first.starts_with("image-"); });
  ASSERT_NE(made, assets.memory.files.end());
  EXPECT_EQ(made->second, "\x89PNG\r\n\x1a\n");
  EXPECT_TRUE(made->first.ends_with(".png"));
}

TEST(Gltf, StripsAndFansKeepTheWindingOfTriangles) {
  GltfFile file;
  file.attributes()["POSITION"] = file.add(Floats{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0}, "VEC3");

  file.primitive()["mode"] = 5;
  EXPECT_EQ(ply_of(file).corners, (Corners{0, 1, 2, 1, 3, 2, 2, 3, 4}));
  file.primitive()["mode"] = 6;
  EXPECT_EQ(ply_of(file).corners, (Corners{1, 2, 0, 2, 3, 0, 3, 4, 0}));
}

TEST(Gltf, IndicesHaveThreeIntegerTypes) {
  GltfFile file;
  const std::size_t all[] = {file.add(std::vector<std::uint8_t>{2, 1, 0}, "SCALAR"),
                             file.add(std::vector<std::uint16_t>{2, 1, 0}, "SCALAR"),
                             file.add(std::vector<std::uint32_t>{2, 1, 0}, "SCALAR")};
  for (const std::size_t index : all) {
    file.primitive()["indices"] = index;
    EXPECT_EQ(ply_of(file).corners, (Corners{2, 1, 0}));
  }
}

TEST(Gltf, NumbersMayBeInterleavedAndSparse) {
  GltfFile file;
  // The positions of two corners, each followed by a number to skip; the third comes from the sparse part.
  file.add(Floats{1, 2, 3, -1, 4, 5, 6, -1, 0, 0, 0, -1}, "SCALAR");
  file.j["bufferViews"][1]["byteStride"] = 16;
  file.j["accessors"][1]["type"] = "VEC3";
  file.j["accessors"][1]["count"] = 3;
  file.add(std::vector<std::uint8_t>{2}, "SCALAR");
  file.add(Floats{7, 8, 9}, "VEC3");
  file.j["accessors"][1]["sparse"] = {{"count", 1},
                                      {"indices", {{"bufferView", 2}, {"componentType", 5121}}},
                                      {"values", {{"bufferView", 3}}}};
  file.attributes()["POSITION"] = 1;

  EXPECT_EQ(ply_of(file).numbers, (Floats{1, 2, 3, 4, 5, 6, 7, 8, 9}));
}

TEST(Gltf, NormalizedIntegersAreFractions) {
  GltfFile file;
  file.attributes()["POSITION"] = file.add(std::vector<std::int16_t>{0, 0, 0, 300, 0, 0, 0, -300, 0}, "VEC3");
  file.attributes()["TEXCOORD_0"] = file.add(std::vector<std::uint8_t>{0, 255, 51, 0, 0, 0}, "VEC2");
  file.j["accessors"].back()["normalized"] = true;
  file.attributes()["NORMAL"] = file.add(std::vector<std::int8_t>{0, 0, 127, 0, -128, 0, -127, 0, 0}, "VEC3");
  file.j["accessors"].back()["normalized"] = true;

  EXPECT_EQ(ply_of(file).numbers,
            (Floats{0, 0, 0, 0, 0, 1, 0, 1, 300, 0, 0, 0, -1, 0, .2f, 0, 0, -300, 0, -1, 0, 0, 0, 0}));
}

TEST(Gltf, VertexColoursMultiplyTheBaseColour) {
  GltfFile file;
  file.attributes()["COLOR_0"] =
      file.add(std::vector<std::uint8_t>{255, 0, 0, 255, 0, 255, 0, 51, 0, 0, 255, 0}, "VEC4");
  file.j["accessors"].back()["normalized"] = true;
  file.pbr()["baseColorFactor"] = {.5, .5, .5, 1};
  file.material()["alphaMode"] = "BLEND";

  const Ply ply = ply_of(file);
  const Scene s = gltf(file);

  EXPECT_NE(ply.header.find("property float opacity_x"), std::string::npos);
  EXPECT_EQ(ply.numbers, (Floats{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1, 0, .2f, 0, 1, 0, 0, 0, 1, 0}));
  std::vector<std::string> names;
  for (const Texture& t : s.textures)
    if (const auto* a = std::get_if<MeshAttributeTexture>(&t)) names.push_back(a->name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"vertex_color", "vertex_opacity"}));
}

TEST(Gltf, NodesTransformTheirChildren) {
  GltfFile file;
  file.j["scenes"][0]["nodes"] = {3, 1, 2};
  // A scale, a quarter turn about z and a translation; the inner node has a matrix.
  file.j["nodes"].push_back({{"translation", {1, 2, 3}},
                             {"rotation", {0, 0, std::sin(kPi / 4), std::cos(kPi / 4)}},
                             {"scale", {2, 3, 4}},
                             {"children", {0}}});
  file.j["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1};

  const Transform t = gltf(file).shapes.at(0).to_world;

  const double want[16] = {0, -3, 0, 1 - 18, 2, 0, 0, 2 + 10, 0, 0, 4, 3 + 28, 0, 0, 0, 1};
  for (std::size_t i = 0; i < 16; ++i)
    EXPECT_NEAR(t.m[i], want[i], 1e-13) << i;  // a few roundings of numbers below 32
}

// Under a mirror normals of the file keep their side, and those of flat triangles follow the winding. What is
// seen is compared in tests/system/test_mirrors.py.
TEST(Gltf, MirroringFlipsOnlyFlatTriangles) {
  GltfFile file;
  file.j["nodes"][0]["scale"] = {-1, 1, 1};
  EXPECT_TRUE(gltf(file).shapes.at(0).flip_normals);
  file.attributes()["NORMAL"] = file.add(Floats{0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");

  EXPECT_FALSE(gltf(file).shapes.at(0).flip_normals);
}

// As Blender writes them: equal angles for a hard edge, and a right angle in single precision.
TEST(Gltf, SpotsMayHaveAHardEdgeAndARightAngle) {
  for (const auto& [inner, outer] : {std::pair{.6, .6},
                                     {1.5707963705062866, 1.5707963705062866},
                                     {.6000000238418579, .5999999642372131},
                                     {0., 1.5707963705062866}}) {
    GltfFile file;
    file.j["extensions"]["KHR_lights_punctual"]["lights"][0] = {
        {"type", "spot"}, {"spot", {{"innerConeAngle", inner}, {"outerConeAngle", outer}}}};

    const Scene s = gltf(file);

    const auto& spot = std::get<SpotEmitter>(s.emitters.at(0));
    EXPECT_NEAR(spot.cutoff_angle, outer * 180 / kPi, 1e-5);
    EXPECT_LE(spot.cutoff_angle, 90);
    EXPECT_NEAR(spot.beam_width, inner * 180 / kPi, 1e-5);
    EXPECT_LE(spot.beam_width, spot.cutoff_angle);
  }
}

TEST(Gltf, MeshesOfSeveralNodesAreInstances) {
  GltfFile file;
  file.j["nodes"].push_back({{"mesh", 0}, {"translation", {3, 0, 0}}});
  file.j["scenes"][0]["nodes"].push_back(3);

  const Scene s = gltf(file);

  EXPECT_EQ(s.shapes.size(), 1u);
  ASSERT_EQ(s.instances.size(), 2u);
  EXPECT_EQ(s.instances[1].to_world.m[3], 3);
}

TEST(Gltf, EmittingPartsAreSeparateShapesInEveryInstance) {
  GltfFile file;
  file.j["nodes"].push_back({{"mesh", 0}, {"translation", {3, 0, 0}}});
  file.j["scenes"][0]["nodes"].push_back(3);
  file.material()["emissiveFactor"] = {1, 1, 1};

  const Scene s = gltf(file);

  ASSERT_EQ(s.shapes.size(), 2u);
  EXPECT_TRUE(s.instances.empty());
  EXPECT_TRUE(s.shapes[1].emitter);
}

TEST(Gltf, ReadsInstancingAttributes) {
  GltfFile file;
  const std::size_t moves = file.add(Floats{1, 0, 0, 2, 0, 0, 3, 0, 0}, "VEC3");
  const std::size_t scales = file.add(Floats{1, 1, 1, 2, 2, 2, 3, 3, 3}, "VEC3");
  file.j["nodes"][0]["translation"] = {0, 1, 0};
  file.j["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", moves},
                                                                               {"SCALE", scales}};

  const Scene s = gltf(file);

  ASSERT_EQ(s.instances.size(), 3u);
  EXPECT_EQ(s.instances[2].to_world.m,
            (std::array<double, 16>{3, 0, 0, 3, 0, 3, 0, 1, 0, 0, 3, 0, 0, 0, 0, 1}));
}

TEST(Gltf, LightsHaveTheUnitsOfPhysics) {
  GltfFile file;
  file.j["extensions"]["KHR_lights_punctual"]["lights"] = nlohmann::json::parse(R"([
    {"type": "directional", "intensity": 100, "color": [1, 0.5, 0.25]}, {"type": "point", "intensity": 8},
    {"type": "spot", "intensity": 6, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.6}}])");
  file.j["nodes"][2]["rotation"] = {-std::sin(kPi / 4), 0, 0, std::cos(kPi / 4)};  // looks down
  file.j["nodes"].push_back(
      {{"extensions", {{"KHR_lights_punctual", {{"light", 1}}}}}, {"translation", {1, 2, 3}}});
  file.j["nodes"].push_back(
      {{"extensions", {{"KHR_lights_punctual", {{"light", 2}}}}}, {"scale", {7, 7, 7}}});
  file.j["scenes"][0]["nodes"] = {0, 1, 2, 3, 4};

  const Scene s = gltf(file);

  ASSERT_EQ(s.emitters.size(), 3u);
  const auto& sun = std::get<DirectionalEmitter>(s.emitters[0]);
  EXPECT_EQ(sun.irradiance, (Rgb{100, 50, 25}));
  EXPECT_NEAR(sun.direction[1], -1, 1e-15);
  const auto& lamp = std::get<PointEmitter>(s.emitters[1]);
  EXPECT_EQ(lamp.intensity, (Rgb{8, 8, 8}));
  EXPECT_EQ(lamp.position, (Vec3{{1, 2, 3}}));
  const auto& spot = std::get<SpotEmitter>(s.emitters[2]);
  EXPECT_EQ(spot.intensity, (Rgb{6, 6, 6}));
  EXPECT_NEAR(spot.cutoff_angle, .6 * 180 / kPi, 1e-12);
  EXPECT_NEAR(spot.beam_width, .3 * 180 / kPi, 1e-12);
  EXPECT_EQ(spot.to_world.m, (std::array<double, 16>{-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1}));
}

TEST(Gltf, CamerasAreChosenByName) {
  GltfFile file;
  file.j["cameras"].push_back({{"type", "orthographic"},
                               {"name", "plan"},
                               {"orthographic", {{"xmag", 2}, {"ymag", 1}, {"znear", 0.5}, {"zfar", 9}}}});
  file.j["nodes"].push_back({{"camera", 1}});
  file.j["scenes"][0]["nodes"].push_back(3);
  ReadOptions plan;
  plan.defines["camera"] = "plan";
  ReadOptions wrong;
  wrong.defines["camera"] = "plann";

  EXPECT_EQ(gltf(file).sensor.projection, Projection::perspective);
  const Scene s = gltf(file, plan);
  EXPECT_EQ(s.sensor.projection, Projection::orthographic);
  EXPECT_EQ(s.film.size, (FrameSize{1440, 720}));
  EXPECT_EQ(s.sensor.far_clip, 9);
  EXPECT_NE(messages(read_gltf(file, wrong)).find("no camera \"plann\"; did you mean 'plan'?"),
            std::string::npos);
}

TEST(Gltf, AspectRatioSetsTheFrame) {
  GltfFile file;
  file.j["cameras"][0]["perspective"]["aspectRatio"] = 1.5;

  EXPECT_EQ(gltf(file).film.size, (FrameSize{1080, 720}));
}

TEST(Gltf, DefaultCameraShowsEverything) {
  GltfFile file;
  file.j["scenes"][0]["nodes"] = {0, 2};
  file.j["nodes"][0]["translation"] = {100, 0, 0};

  const ReadResult r = read_gltf(file);

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_NE(messages(r).find("warning: the scene has no camera"), std::string::npos) << messages(r);
  const auto& m = r.scene->sensor.to_world.m;
  const double middle[3] = {100.5, .5, 0}, radius = std::sqrt(.5);
  double along = 0, far2 = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    along += (middle[i] - m[4 * i + 3]) * m[4 * i + 2];
    far2 += (middle[i] - m[4 * i + 3]) * (middle[i] - m[4 * i + 3]);
  }
  EXPECT_NEAR(along * along, far2, 1e-9);                                    // looks at the middle
  EXPECT_GT(along * std::sin(r.scene->sensor.fov / 2 * kPi / 180), radius);  // the bounding sphere fits
}

TEST(Gltf, SceneWithoutLightsIsAWarningAndCanGetASky) {
  GltfFile file;
  file.j["scenes"][0]["nodes"] = {0, 1};
  ReadOptions sky;
  sky.defines["environment"] = "2.5";

  EXPECT_NE(messages(read_gltf(file)).find("warning: the scene has no light"), std::string::npos);
  const ReadResult r = read_gltf(file, sky);
  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_TRUE(r.diagnostics.empty()) << messages(r);
  EXPECT_EQ(std::get<ConstantEmitter>(r.scene->emitters.at(0)).radiance, (Rgb{2.5, 2.5, 2.5}));
}

TEST(Gltf, FlattenedAndHiddenNodesAreLeftOut) {
  GltfFile file;
  file.j["nodes"].push_back({{"mesh", 0}, {"scale", {1, 0, 1}}});
  file.j["nodes"].push_back({{"mesh", 0}, {"extensions", {{"KHR_node_visibility", {{"visible", false}}}}}});
  file.j["scenes"][0]["nodes"] = {0, 1, 2, 3, 4};

  const ReadResult r = read_gltf(file);

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(r.scene->shapes.size() + r.scene->instances.size(), 1u);
  EXPECT_NE(messages(r).find("nodes[3]: a mesh is left out"), std::string::npos) << messages(r);
}

}  // namespace
}  // namespace ls

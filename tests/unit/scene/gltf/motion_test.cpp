// glTF's skins, morph targets and animations: the corners and transforms that result from them.
#include <cmath>

#include "formats/gltf/translation.h"
#include "tests/unit/scene/gltf/gltf_testing.h"

namespace ls {
namespace {

using nlohmann::json;
using Floats = std::vector<float>;

// The only mesh that was made, a triangle. `corners`: its positions, or its positions and normals.
struct Triangle {
  Floats corners;
  std::array<std::int32_t, 3> order{};
};
Triangle triangle_of(const GltfFile& file, const ReadOptions& options = {}) {
  KeepingAssets assets;
  const ReadResult r = read_gltf(file.glb(), assets, options);
  EXPECT_TRUE(r.scene) << messages(r);
  for (const auto& [name, bytes] : assets.memory.files) {
    if (!name.starts_with("mesh-")) continue;
    const std::string end = "end_header\n";
    const bool has_normals = bytes.find("property float nx") != std::string::npos;
    Triangle out{Floats(3 * (has_normals ? 6 : 3))};
    const char* numbers = bytes.data() + bytes.find(end) + end.size();
    std::memcpy(out.corners.data(), numbers, 4 * out.corners.size());
    // The first byte of the triangle is its number of corners.
    std::memcpy(out.order.data(), numbers + 4 * out.corners.size() + 1, sizeof out.order);
    return out;
  }
  ADD_FAILURE() << "no mesh was made";
  return {};
}
Floats corners_of(const GltfFile& file, const ReadOptions& options = {}) {
  return triangle_of(file, options).corners;
}
std::array<double, 16> stands(const GltfFile& file, const ReadOptions& options) {
  return gltf(file, options).shapes.at(0).to_world.m;
}
std::string said(const GltfFile& file, const ReadOptions& options = {}) {
  return messages(read_gltf(file, options));
}
ReadOptions at_second(const std::string& time) { return {.defines = {{"time", time}}}; }

// A triangle whose first corner follows joint 0, the second joint 1, and the third both with equal weights.
// The joints are nodes 3 and 4.
GltfFile skinned() {
  GltfFile file;
  file.attributes()["JOINTS_0"] =
      file.add(std::vector<std::uint8_t>{0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}, "VEC4");
  file.attributes()["WEIGHTS_0"] = file.add(Floats{1, 0, 0, 0, 1, 0, 0, 0, .5f, .5f, 0, 0}, "VEC4");
  file.j["scenes"][0]["nodes"] = {0, 1, 2, 3};
  file.j["nodes"].push_back({{"children", {4}}, {"translation", {10, 0, 0}}});
  file.j["nodes"].push_back({{"translation", {0, 20, 0}}, {"scale", {2, 2, 2}}});
  file.j["nodes"][0]["skin"] = 0;
  file.j["nodes"][0]["translation"] = {7, 7, 7};  // no effect, since the node has a skin
  file.j["skins"] = {{{"joints", {3, 4}}}};
  return file;
}

TEST(GltfMotion, SkinMovesVerticesWithTheirJoints) {
  GltfFile file = skinned();
  EXPECT_EQ(corners_of(file), (Floats{10, 0, 0, 12, 20, 0, 10, 11.5f, 0}));
  EXPECT_EQ(stands(file, {}), Transform{}.m);

  // The bind pose has joint 0 at (10, 0, 0), where it still is, so it does not move its corners.
  Floats bind(32, 0);
  for (const std::size_t i : {0, 5, 10, 15, 16, 21, 26, 31}) bind[i] = 1;
  bind[12] = -10;
  file.j["skins"][0]["inverseBindMatrices"] = file.add(bind, "MAT4");
  file.j["accessors"].back()["type"] = "MAT4";
  file.j["accessors"].back()["count"] = 2;
  EXPECT_EQ(corners_of(file), (Floats{0, 0, 0, 12, 20, 0, 5, 11.5f, 0}));
}

TEST(GltfMotion, SkinTransformsNormalsByTheInverseTranspose) {
  GltfFile file = skinned();
  file.attributes()["NORMAL"] = file.add(Floats{.6f, .8f, 0, .6f, .8f, 0, 0, 0, 1}, "VEC3");
  file.j["nodes"][4]["scale"] = {2, 1, 1};

  const Floats all = corners_of(file);

  // The normal (.6, .8) becomes (.6 / 2, .8 / 1), normalised.
  const float length = std::hypot(.3f, .8f);
  const Floats expected{.6f, .8f, 0, .3f / length, .8f / length, 0, 0, 0, 1};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(all[6 * (i / 3) + 3 + i % 3], expected[i], 1e-6f) << i;
}

TEST(GltfMotion, HiddenJointsMoveVisibleMeshes) {
  GltfFile file = skinned();
  const Floats seen = corners_of(file);
  file.j["nodes"][3]["extensions"]["KHR_node_visibility"]["visible"] = false;
  EXPECT_EQ(corners_of(file), seen);

  // A child of a hidden node is hidden, even if the child is marked as visible.
  file.j["nodes"][4]["mesh"] = 0;
  file.j["nodes"][4]["extensions"]["KHR_node_visibility"]["visible"] = true;
  EXPECT_EQ(gltf(file).shapes.size(), 1u);
}

TEST(GltfMotion, MirroredJointKeepsTheFrontSide) {
  using Order = std::array<std::int32_t, 3>;
  GltfFile file = skinned();
  EXPECT_EQ(triangle_of(file).order, (Order{0, 1, 2}));
  file.j["nodes"][3]["scale"] = {-1, 1, 1};  // joint 0; joint 1 is its child
  EXPECT_EQ(triangle_of(file).order, (Order{0, 2, 1}));
  file.j["nodes"][3]["scale"] = {-1, -1, 1};  // half a turn, no mirror
  EXPECT_EQ(triangle_of(file).order, (Order{0, 1, 2}));

  // Joint 1, scaled by (-2, 2, 2), mirrors the corner that follows it alone, and also the one that follows
  // both joints, whose mean scale is (-0.5, 1.5, 1.5). Two of three corners are a majority.
  file.j["nodes"][3]["scale"] = {1, 1, 1};
  file.j["nodes"][4]["scale"] = {-2, 2, 2};
  EXPECT_EQ(triangle_of(file).order, (Order{0, 2, 1}));
}

TEST(GltfMotion, NormalsOfAnyLengthBecomeUnits) {
  GltfFile file;
  file.attributes()["NORMAL"] = file.add(Floats{0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  file.primitive()["targets"] = {{{"NORMAL", file.add(Floats{3e38f, 3e38f, 0, 0, 0, 0, 0, 0, 0}, "VEC3")}}};
  file.j["meshes"][0]["weights"] = {1};
  // Tolerance: half the distance of two floats below 1.
  const Floats morphed = corners_of(file);
  EXPECT_NEAR(morphed[3], std::sqrt(.5), 3e-8);
  EXPECT_NEAR(morphed[4], std::sqrt(.5), 3e-8);

  // Lengths grow by 1e30, and areas by 1e60, which is beyond the range of float.
  file = skinned();
  file.attributes()["NORMAL"] = file.add(Floats{0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  file.j["nodes"][3]["scale"] = {1e30, 1e30, 1e30};
  EXPECT_EQ(corners_of(file)[5], 1);
}

TEST(GltfMotion, MorphTargetsAreAddedByTheirWeights) {
  GltfFile file;
  file.primitive()["targets"] = {{{"POSITION", file.add(Floats{1, 0, 0, 0, 0, 0, 0, 0, 2}, "VEC3")}},
                                 {{"POSITION", file.add(Floats{0, 0, 0, 0, 4, 0, 0, 0, 0}, "VEC3")}}};
  EXPECT_EQ(corners_of(file), (Floats{0, 0, 0, 1, 0, 0, 0, 1, 0}));
  file.j["meshes"][0]["weights"] = {.5, 0};
  EXPECT_EQ(corners_of(file), (Floats{.5f, 0, 0, 1, 0, 0, 0, 1, 1}));
  file.j["nodes"][0]["weights"] = {0, .25};  // replaces the mesh's weights
  EXPECT_EQ(corners_of(file), (Floats{0, 0, 0, 1, 1, 0, 0, 1, 0}));
}

TEST(GltfMotion, MeshWithTwoShapesBecomesTwoMeshes) {
  GltfFile file;
  file.primitive()["targets"] = {{{"POSITION", file.add(Floats{1, 0, 0, 0, 0, 0, 0, 0, 2}, "VEC3")}}};
  file.j["nodes"].push_back({{"mesh", 0}, {"weights", {1}}});
  file.j["nodes"].push_back({{"mesh", 0}, {"weights", {1}}});
  file.j["scenes"][0]["nodes"] = {0, 1, 2, 3, 4};

  const Scene s = gltf(file);

  EXPECT_EQ(s.assets.size(), 2u);
  EXPECT_EQ(s.instances.size(), 2u);  // of the form that two nodes show
  EXPECT_EQ(s.shapes.size(), 2u);
}

// A list of weights may be long, and many nodes may use it.
TEST(GltfMotion, EqualWeightsAreStoredOnce) {
  GltfFile file;
  file.primitive()["targets"] = {json::object()};
  file.j["meshes"][0]["weights"] = {1};
  file.j["nodes"].push_back({{"mesh", 0}});
  file.j["nodes"].push_back({{"mesh", 0}, {"weights", {1}}});
  file.j["nodes"].push_back({{"mesh", 0}, {"weights", {0}}});
  file.j["scenes"][0]["nodes"] = {0, 1, 2, 3, 4, 5};
  scene::Report report(false);
  const auto tree = scene::gltf::parse_json("test.gltf", file.j.dump(), report);
  ASSERT_TRUE(tree);
  const scene::gltf::Item root(*tree, report);
  KeepingAssets assets;
  scene::gltf::Translation t{assets,
                             report,
                             root,
                             scene::gltf::Buffers(root, assets, std::nullopt),
                             scene::made("scene", "", root.at()),
                             0,
                             false,
                             {},
                             {},
                             {}};

  const scene::gltf::Stage stage = scene::gltf::read_nodes(t, {});

  ASSERT_EQ(stage.meshes.size(), 4u);
  ASSERT_TRUE(stage.meshes[0].weights);
  EXPECT_EQ(stage.meshes[1].weights, stage.meshes[0].weights);
  EXPECT_EQ(stage.meshes[2].weights, stage.meshes[0].weights);
  EXPECT_EQ(stage.meshes[3].weights, nullptr) << "it has its base form";
}

// Returns a file in which an animation of one channel moves node 0.
GltfFile moving(const std::string& path, const Floats& times, const Floats& values, const std::string& type,
                const std::string& interpolation) {
  GltfFile file;
  const std::size_t input = file.add(times, "SCALAR"), output = file.add(values, type);
  file.j["animations"] = {
      {{"name", "go"},
       {"samplers", {{{"input", input}, {"output", output}, {"interpolation", interpolation}}}},
       {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", path}}}}}}}};
  return file;
}

TEST(GltfMotion, IsEvaluatedAtATimeOrFrame) {
  const GltfFile file = moving("translation", {1, 3}, {0, 0, 0, 8, 0, 0}, "VEC3", "LINEAR");
  for (const auto& [time, x] : {std::pair{"0", 0.}, {"1", 0.}, {"1.5", 2.}, {"3", 8.}, {"9", 8.}})
    EXPECT_EQ(stands(file, at_second(time))[3], x) << time;

  EXPECT_EQ(stands(file, {.frame = 36})[3], 2) << "36 / 24 s";
  EXPECT_EQ(stands(file, {.defines = {{"fps", "12"}}, .frame = 18})[3], 2) << "18 / 12 s";
  EXPECT_EQ(stands(file, {.defines = {{"time", "1"}}, .frame = 12})[3], 2) << "1 + 12 / 24 s";
  EXPECT_NE(said(file).find("choose a second by -D time=1.5"), std::string::npos) << said(file);
  EXPECT_EQ(said(file, at_second("2")), "");

  const GltfFile step = moving("translation", {1, 3}, {0, 0, 0, 8, 0, 0}, "VEC3", "STEP");
  EXPECT_EQ(stands(step, at_second("2.9"))[3], 0);
  EXPECT_EQ(stands(step, at_second("3"))[3], 8);
}

// A Hermite spline from 0 to 8 in 2 s, with the slopes 4 per second at its start and 0 at its end. In the
// middle it is 8 / 2 + 2 * 4 / 8.
TEST(GltfMotion, CubicSplinesHaveTangentsPerSecond) {
  const GltfFile file = moving("translation", {1, 3}, {9, 9, 9, 0, 0, 0, 4, 0, 0, 0, 0, 0, 8, 0, 0, 9, 9, 9},
                               "VEC3", "CUBICSPLINE");
  EXPECT_DOUBLE_EQ(stands(file, at_second("2"))[3], 5);
  EXPECT_EQ(stands(file, at_second("0"))[3], 0);
  EXPECT_EQ(stands(file, at_second("5"))[3], 8);
}

// From no rotation to one by 90 degrees about z, whose quaternion has the opposite sign. After a third of the
// time the rotation is 30 degrees.
TEST(GltfMotion, RotationsUseSphericalInterpolation) {
  const float h = std::sqrt(.5f);
  const GltfFile file = moving("rotation", {0, 3}, {0, 0, 0, 1, 0, 0, -h, -h}, "VEC4", "LINEAR");
  const auto m = stands(file, at_second("1"));
  EXPECT_NEAR(m[0], std::sqrt(3.) / 2, 1e-7);
  EXPECT_NEAR(m[4], .5, 1e-7);
}

TEST(GltfMotion, AnimatesMorphWeights) {
  GltfFile file = moving("weights", {0, 2}, {0, 0, 1, .5f}, "SCALAR", "LINEAR");
  file.primitive()["targets"] = {{{"POSITION", file.add(Floats{1, 0, 0, 0, 0, 0, 0, 0, 2}, "VEC3")}},
                                 {{"POSITION", file.add(Floats{0, 0, 0, 0, 4, 0, 0, 0, 0}, "VEC3")}}};
  EXPECT_EQ(corners_of(file, at_second("1")), (Floats{.5f, 0, 0, 1, 1, 0, 0, 1, 1}));
}

TEST(GltfMotion, PlaysOneAnimationOrAll) {
  GltfFile file = moving("translation", {0}, {1, 0, 0}, "VEC3", "LINEAR");
  json second = file.j["animations"][0];
  second["name"] = "grow";
  second["channels"][0]["target"]["path"] = "scale";
  file.j["animations"].push_back(second);
  second["samplers"][0]["output"] = file.add(Floats{2, 3, 4}, "VEC3");
  file.j["animations"][1] = second;

  EXPECT_EQ(stands(file, at_second("0"))[3], 1);
  EXPECT_EQ(stands(file, at_second("0"))[5], 1);
  EXPECT_NE(said(file, at_second("0")).find("of 2 animations the first is seen"), std::string::npos);
  const ReadOptions grow{.defines = {{"time", "0"}, {"animation", "grow"}}};
  EXPECT_EQ(stands(file, grow)[3], 0);
  EXPECT_EQ(stands(file, grow)[5], 3);
  const ReadOptions all{.defines = {{"time", "0"}, {"animation", "*"}}};
  EXPECT_EQ(stands(file, all)[3], 1);
  EXPECT_EQ(stands(file, all)[5], 3);
  EXPECT_NE(
      said(file, {.defines = {{"animation", "grwo"}}}).find("there is no animation \"grwo\"; did you mean"),
      std::string::npos);
}

TEST(GltfMotion, ErrorsAreNamed) {
  const auto expect = [](const GltfFile& file, const std::string& want, const ReadOptions& options = {}) {
    const ReadResult r = read_gltf(file, options);
    EXPECT_FALSE(r.scene) << want;
    EXPECT_NE(messages(r).find(want), std::string::npos) << want << "\n" << messages(r);
  };
  GltfFile file = skinned();
  file.j["skins"][0]["joints"] = {3};
  expect(file, "JOINTS_0: there is no joint 1: the skin has 1, counted from 0");
  file = skinned();
  file.j["scenes"][0]["nodes"] = {0, 1, 2};
  expect(file, "skins[0].joints[0]: this joint is not in the scene");
  file = skinned();
  file.attributes().erase("WEIGHTS_0");
  expect(file, "a mesh with a skin needs the attributes JOINTS_0 and WEIGHTS_0");
  file = skinned();
  file.j["nodes"][4]["scale"] = {1e300, 1, 1};
  expect(file, "carry corners out of the range of numbers");
  file = GltfFile();
  file.attributes()["NORMAL"] = file.add(Floats{0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  file.primitive()["targets"] = {{{"NORMAL", file.add(Floats{3e38f, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3")}}};
  file.j["meshes"][0]["weights"] = {2};
  expect(file,
         "primitives[0]: its skin or its morph targets carry corners out of the range of numbers, or "
         "their normals");
  file = GltfFile();
  file.j["nodes"][0]["weights"] = {1};
  expect(file, "nodes[0].weights: 0 morph targets, but 1 weights");
  file = moving("translation", {3, 1}, {0, 0, 0, 8, 0, 0}, "VEC3", "LINEAR");
  expect(file, "samplers[0].input: the times of a sampler must ascend", at_second("1"));
  file = moving("rotation", {1, 3}, {0, 0, 0, 8, 0, 0}, "VEC3", "LINEAR");
  expect(file, "a rotation is a quaternion of 4 numbers", at_second("1"));
  file = moving("scale", {1, 3}, {0, 8}, "SCALAR", "LINEAR");
  expect(file, "3 numbers a time are wanted", at_second("1"));
  file = moving("weights", {1}, {1, 1}, "SCALAR", "LINEAR");
  expect(file, "nodes[0]: 0 morph targets, but 2 weights", at_second("1"));
  file = moving("scale", {1, 3}, {0, 0, 0}, "VEC3", "LINEAR");
  expect(file, "1 values do not fit 2 times", at_second("1"));
  file.j["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  expect(file, "has a matrix", at_second("1"));
  expect(GltfFile(), "-D time=soon wants a number from 0", at_second("soon"));
  expect(GltfFile(), "the file has no animations", {.defines = {{"animation", "go"}}});
}

}  // namespace
}  // namespace ls

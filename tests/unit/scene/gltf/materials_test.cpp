// Translation of glTF's materials to bsdfs.
#include "tests/unit/scene/gltf/gltf_testing.h"

#include <cmath>

namespace ls {
namespace {

template <class T>
const T* only(const Scene& s) {
  const T* found = nullptr;
  for (const Bsdf& b : s.bsdfs)
    if (const auto* one = std::get_if<T>(&b)) {
      EXPECT_EQ(found, nullptr) << "there are several";
      found = one;
    }
  EXPECT_NE(found, nullptr) << "there is none";
  return found;
}
Rgb constant(const Scene& s, TextureIndex t) {
  const auto* c = std::get_if<ConstantTexture>(&s.textures.at(t.value));
  EXPECT_NE(c, nullptr);
  return c ? c->value : Rgb{};
}
const BitmapTexture& bitmap(const Scene& s, TextureIndex t) {
  return std::get<BitmapTexture>(s.textures.at(t.value));
}
const ProductTexture& product(const Scene& s, TextureIndex t) {
  return std::get<ProductTexture>(s.textures.at(t.value));
}

TEST(GltfMaterials, DielectricIsACoatOverADiffuseBase) {
  GltfFile file;
  file.pbr()["baseColorFactor"] = {.1, .2, .3, 1};
  file.material()["extensions"]["KHR_materials_ior"]["ior"] = 1.3;

  const Scene s = gltf(file);

  const auto* coat = only<RoughPlasticBsdf>(s);
  EXPECT_EQ(coat->alpha, .25);
  EXPECT_EQ(coat->int_ior, 1.3);
  EXPECT_TRUE(coat->multiple_scattering);
  EXPECT_EQ(constant(s, coat->diffuse_reflectance), (Rgb{.1, .2, .3}));
}

TEST(GltfMaterials, PartialMetalIsABlend) {
  GltfFile file;
  file.pbr()["metallicFactor"] = 1;
  const Scene metal = gltf(file);
  file.pbr()["metallicFactor"] = .25;
  const Scene both = gltf(file);

  EXPECT_EQ(constant(metal, only<PrincipledBsdf>(metal)->metallic), (Rgb{1, 1, 1}));
  EXPECT_EQ(constant(both, only<BlendBsdf>(both)->weight), (Rgb{.25, .25, .25}));
  EXPECT_EQ(constant(both, only<PrincipledBsdf>(both)->metallic), (Rgb{1, 1, 1}));
}

TEST(GltfMaterials, RoughnessIsGreenAndMetallicBlue) {
  GltfFile file;
  file.pbr() = {{"metallicRoughnessTexture", {{"index", 0}}}, {"roughnessFactor", .5}};

  const Scene s = gltf(file);

  const auto* p = only<PrincipledBsdf>(s);
  EXPECT_EQ(bitmap(s, p->metallic).channel, Channel::blue);
  EXPECT_TRUE(bitmap(s, p->metallic).raw);
  EXPECT_EQ(constant(s, product(s, p->roughness).first), (Rgb{.5, .5, .5}));
  EXPECT_EQ(bitmap(s, product(s, p->roughness).second).channel, Channel::green);
}

TEST(GltfMaterials, ColourOfAnImageIsMultipliedAndTransformed) {
  GltfFile file;
  file.pbr()["baseColorTexture"] = {
      {"index", 0},
      {"extensions",
       {{"KHR_texture_transform",
         {{"offset", {0, 1}}, {"rotation", 1.57079632679489661923}, {"scale", {.5, .5}}}}}}};
  file.pbr()["baseColorFactor"] = {1, .5, .25, 1};
  file.j["textures"][0]["sampler"] = 0;
  file.j["samplers"] = {{{"wrapS", 33648}, {"wrapT", 33648}, {"magFilter", 9728}}};

  const Scene s = gltf(file);

  const auto& both = product(s, only<RoughPlasticBsdf>(s)->diffuse_reflectance);
  EXPECT_EQ(constant(s, both.first), (Rgb{1, .5, .25}));
  const BitmapTexture& image = bitmap(s, both.second);
  EXPECT_FALSE(image.raw);
  EXPECT_EQ(image.wrap, Wrap::mirror);
  EXPECT_EQ(image.filter, TextureFilter::nearest);
  // The example in the specification of the extension: u' = v / 2, v' = 1 - u / 2.
  const double want[9] = {0, .5, 0, -.5, 0, 1, 0, 0, 1};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(image.to_uv.m[i], want[i], 1e-15) << i;
}

TEST(GltfMaterials, CutOutsHaveAThreshold) {
  GltfFile file;
  file.pbr()["baseColorTexture"] = {{"index", 0}};
  file.pbr()["baseColorFactor"] = {1, 1, 1, .5};
  file.material()["alphaMode"] = "MASK";
  file.material()["alphaCutoff"] = .25;

  const Scene s = gltf(file);

  const auto& cut = product(s, only<MaskBsdf>(s)->opacity);
  EXPECT_EQ(cut.threshold, .25);
  EXPECT_EQ(constant(s, cut.first), (Rgb{.5, .5, .5}));
  EXPECT_EQ(bitmap(s, cut.second).channel, Channel::alpha);
  EXPECT_FALSE(bitmap(s, cut.second).alpha);
}

TEST(GltfMaterials, CutOutsWorkWithAnImageAlone) {
  GltfFile file;
  file.pbr()["baseColorTexture"] = {{"index", 0}};
  file.material()["alphaMode"] = "MASK";

  const Scene s = gltf(file);

  EXPECT_EQ(product(s, only<MaskBsdf>(s)->opacity).threshold, .5);
}

TEST(GltfMaterials, BlendUsesAlphaAndOpaqueIgnoresIt) {
  GltfFile file;
  file.pbr()["baseColorFactor"] = {1, 1, 1, .5};
  for (const Bsdf& b : gltf(file).bsdfs) EXPECT_FALSE(std::holds_alternative<MaskBsdf>(b));
  file.material()["alphaMode"] = "BLEND";

  const Scene s = gltf(file);

  EXPECT_EQ(constant(s, only<MaskBsdf>(s)->opacity), (Rgb{.5, .5, .5}));
}

TEST(GltfMaterials, EmissionIsMultipliedByItsStrength) {
  GltfFile file;
  file.material()["emissiveFactor"] = {1, .5, 0};
  file.material()["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 10;

  const Scene s = gltf(file);

  ASSERT_TRUE(s.shapes.at(0).emitter);
  EXPECT_EQ(constant(s, s.shapes[0].emitter->radiance), (Rgb{10, 5, 0}));
}

// What is cut out or lets light pass gives as much less light, whether the surface glows or is unlit.
TEST(GltfMaterials, EmissionIsMultipliedByTheOpacity) {
  for (const bool unlit : {false, true}) {
    GltfFile file;
    if (unlit)
      file.material()["extensions"]["KHR_materials_unlit"] = nlohmann::json::object();
    else
      file.material()["emissiveFactor"] = {1, 1, 1};
    file.pbr()["baseColorFactor"] = {1, 1, 1, .25};
    const auto light = [&] {
      const Scene s = gltf(file);
      return s.shapes.at(0).emitter ? constant(s, s.shapes[0].emitter->radiance) : Rgb{0, 0, 0};
    };
    EXPECT_EQ(light(), (Rgb{1, 1, 1})) << "opaque";
    file.material()["alphaMode"] = "BLEND";
    EXPECT_EQ(light(), (Rgb{.25, .25, .25}));
    file.material()["alphaMode"] = "MASK";
    EXPECT_EQ(light(), (Rgb{0, 0, 0}));
    file.material()["alphaCutoff"] = .2;
    EXPECT_EQ(light(), (Rgb{1, 1, 1}));
  }
}

TEST(GltfMaterials, EmissionIsCutOutByAnImage) {
  GltfFile file;
  file.pbr()["baseColorTexture"] = {{"index", 0}};
  file.material()["alphaMode"] = "MASK";
  file.material()["emissiveFactor"] = {.5, .5, .5};

  const Scene s = gltf(file);

  ASSERT_TRUE(s.shapes.at(0).emitter);
  const auto& light = product(s, s.shapes[0].emitter->radiance);
  EXPECT_EQ(light.threshold, 0);
  EXPECT_EQ(constant(s, light.first), (Rgb{.5, .5, .5}));
  const auto& cut = product(s, light.second);
  EXPECT_EQ(cut.threshold, .5);
  EXPECT_EQ(bitmap(s, cut.second).channel, Channel::alpha);
  EXPECT_EQ(product(s, only<MaskBsdf>(s)->opacity).threshold, .5);
}

TEST(GltfMaterials, SharesMayExceedOneByRoundingOfSinglePrecision) {
  GltfFile file;
  file.pbr() = {{"baseColorFactor", {1.0000001192092896, -1e-9, 0, 1}},
                {"metallicFactor", 1.0000001192092896}};

  const Scene s = gltf(file);

  EXPECT_EQ(constant(s, only<PrincipledBsdf>(s)->base_color), (Rgb{1, 0, 0}));
  EXPECT_EQ(constant(s, only<PrincipledBsdf>(s)->metallic), (Rgb{1, 1, 1}));
}

TEST(GltfMaterials, GlassBodiesContainAbsorbingMedia) {
  GltfFile file;
  file.pbr() = {{"metallicFactor", 0}, {"roughnessFactor", 0}, {"baseColorFactor", {.25, 1, 1, 1}}};
  file.material()["extensions"] = {
      {"KHR_materials_transmission", {{"transmissionFactor", 1}}},
      {"KHR_materials_ior", {{"ior", 1.33}}},
      {"KHR_materials_volume",
       {{"thicknessFactor", 1}, {"attenuationDistance", 2}, {"attenuationColor", {.5, 1, .25}}}}};

  const Scene s = gltf(file);

  const auto* glass = only<DielectricBsdf>(s);
  EXPECT_EQ(glass->int_ior, 1.33);
  EXPECT_EQ(constant(s, glass->specular_transmittance), (Rgb{.5, 1, 1}));  // its square is the base colour
  ASSERT_TRUE(s.shapes.at(0).interior);
  const auto& medium = std::get<HomogeneousMedium>(s.media.at(s.shapes[0].interior->value));
  EXPECT_EQ(medium.albedo, (Rgb{0, 0, 0}));
  EXPECT_NEAR(std::exp(-2 * medium.sigma_t[0]), .5, 1e-15);
  EXPECT_EQ(medium.sigma_t[1], 0);
  EXPECT_NEAR(std::exp(-2 * medium.sigma_t[2]), .25, 1e-15);
}

TEST(GltfMaterials, TransmissionWithoutAVolumeIsASheet) {
  GltfFile file;
  file.pbr()["roughnessFactor"] = 0;
  file.material()["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = 1;
  const Scene whole = gltf(file);
  file.material()["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = .5;
  const Scene half = gltf(file);

  only<ThinDielectricBsdf>(whole);
  only<ThinDielectricBsdf>(half);
  only<RoughPlasticBsdf>(half);
  EXPECT_EQ(constant(half, only<BlendBsdf>(half)->weight), (Rgb{.5, .5, .5}));
}

TEST(GltfMaterials, RoughSheetsBlurWhatIsBehindThem) {
  GltfFile file;
  file.pbr()["baseColorFactor"] = {.1, .2, .3, 1};
  file.material()["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = 1;
  file.material()["extensions"]["KHR_materials_ior"]["ior"] = 1.3;
  const Scene s = gltf(file);
  file.pbr()["metallicRoughnessTexture"] = {{"index", 0}};
  file.pbr()["roughnessFactor"] = .5;
  const Scene textured = gltf(file);

  const auto* sheet = only<RoughThinDielectricBsdf>(s);
  EXPECT_EQ(sheet->distribution, Microfacet::ggx);
  EXPECT_EQ(constant(s, sheet->alpha_u), (Rgb{.25, .25, .25}));
  EXPECT_EQ(constant(s, sheet->alpha_v), (Rgb{.25, .25, .25}));
  EXPECT_EQ(sheet->int_ior, 1.3);
  EXPECT_EQ(sheet->ext_ior, 1);
  EXPECT_EQ(constant(s, sheet->specular_transmittance), (Rgb{.1, .2, .3}));
  EXPECT_TRUE(sheet->multiple_scattering);
  const auto* by_image = only<RoughThinDielectricBsdf>(textured);
  EXPECT_FALSE(by_image->multiple_scattering);
  // alpha is the square of the roughness, which is a factor times an image.
  const auto& alpha = product(textured, by_image->alpha_u);
  EXPECT_EQ(constant(textured, alpha.first), (Rgb{.25, .25, .25}));
  const auto& square = product(textured, alpha.second);
  EXPECT_EQ(bitmap(textured, square.first).channel, Channel::green);
  EXPECT_EQ(bitmap(textured, square.second).channel, Channel::green);
}

TEST(GltfMaterials, MetallicShareOfASheetIsOpaque) {
  GltfFile file;
  file.pbr() = {{"metallicFactor", .25}, {"roughnessFactor", 0}};
  file.material()["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = 1;

  const Scene s = gltf(file);

  const auto* blend = only<BlendBsdf>(s);
  EXPECT_EQ(constant(s, blend->weight), (Rgb{.25, .25, .25}));
  EXPECT_TRUE(std::holds_alternative<ThinDielectricBsdf>(s.bsdfs.at(blend->first.value)));
  EXPECT_EQ(constant(s, only<PrincipledBsdf>(s)->metallic), (Rgb{1, 1, 1}));
}

TEST(GltfMaterials, ReadsRoughAndPartlyTransparentBodies) {
  GltfFile file;
  file.material()["extensions"] = {{"KHR_materials_transmission", {{"transmissionFactor", 1}}},
                                   {"KHR_materials_volume", {{"thicknessFactor", 1}}}};
  const Scene rough = gltf(file);
  file.material()["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = .5;
  const Scene partly = gltf(file);

  const auto* glass = only<RoughDielectricBsdf>(rough);
  EXPECT_EQ(constant(rough, glass->alpha_u), (Rgb{.25, .25, .25}));
  EXPECT_FALSE(rough.shapes.at(0).interior);
  EXPECT_EQ(constant(partly, *only<PrincipledBsdf>(partly)->spec_trans), (Rgb{.5, .5, .5}));
}

TEST(GltfMaterials, NormalMapsAreNotColourConverted) {
  GltfFile file;
  file.material()["normalTexture"] = {{"index", 0}};

  const Scene s = gltf(file);

  EXPECT_TRUE(bitmap(s, only<NormalMapBsdf>(s)->normalmap).raw);
  EXPECT_TRUE(only<NormalMapBsdf>(s)->follow_mirroring);
}

TEST(GltfMaterials, SpecularScalesTheReflectionAtNormalIncidence) {
  GltfFile file;
  file.material()["extensions"]["KHR_materials_specular"]["specularFactor"] = .25;

  const Scene s = gltf(file);

  const double eta = only<RoughPlasticBsdf>(s)->int_ior, f0 = std::pow((eta - 1) / (eta + 1), 2);
  EXPECT_NEAR(f0, .04 / 4, 1e-15);
}

TEST(GltfMaterials, ClearCoatIsThatOfPrincipled) {
  GltfFile file;
  file.material()["extensions"]["KHR_materials_clearcoat"] = {{"clearcoatFactor", .5},
                                                              {"clearcoatRoughnessFactor", 0}};

  const Scene s = gltf(file);

  EXPECT_EQ(constant(s, only<PrincipledBsdf>(s)->clearcoat), (Rgb{.5, .5, .5}));
}

TEST(GltfMaterials, UnlitMaterialEmitsItsColour) {
  GltfFile file;
  file.pbr()["baseColorFactor"] = {.2, .4, .6, 1};
  file.material()["extensions"]["KHR_materials_unlit"] = nlohmann::json::object();

  const Scene s = gltf(file);

  ASSERT_TRUE(s.shapes.at(0).emitter);
  EXPECT_EQ(constant(s, s.shapes[0].emitter->radiance), (Rgb{.2, .4, .6}));
  EXPECT_EQ(constant(s, only<DiffuseBsdf>(s)->reflectance), (Rgb{0, 0, 0}));
}

TEST(GltfMaterials, WithoutAMaterialItIsWhiteMetal) {
  GltfFile file;
  file.primitive().erase("material");

  const Scene s = gltf(file);

  EXPECT_EQ(constant(s, only<PrincipledBsdf>(s)->roughness), (Rgb{1, 1, 1}));
  EXPECT_TRUE(only<PrincipledBsdf>(s)->multiple_scattering);
}

TEST(GltfMaterials, MeshesHaveTheTextureCoordinatesThatTheirMaterialUses) {
  GltfFile file;
  file.attributes()["TEXCOORD_0"] = file.add(std::vector<float>{0, 0, 1, 0, 0, 1}, "VEC2");
  file.attributes()["TEXCOORD_1"] = file.add(std::vector<float>{5, 5, 6, 5, 5, 6}, "VEC2");
  file.pbr()["baseColorTexture"] = {{"index", 0}, {"texCoord", 1}};
  KeepingAssets assets;

  const ReadResult r = read_gltf(file.glb(), assets);

  ASSERT_TRUE(r.scene) << messages(r);
  for (const auto& [name, bytes] : assets.memory.files) {
    if (!name.starts_with("mesh-")) continue;
    float u;
    std::memcpy(&u, bytes.data() + bytes.find("end_header\n") + 11 + 12, 4);
    EXPECT_EQ(u, 5);
  }
}

}  // namespace
}  // namespace ls

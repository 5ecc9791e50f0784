// Reading of bsdfs: defaults, nesting, and errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/limits.h"
#include "core/scene/schema/traits.h"
#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

std::string sphere(const std::string& bsdf) {
  return with_sensor("<shape type=\"sphere\">" + bsdf + "</shape>");
}
Scene scene_with_bsdf(const std::string& bsdf) { return must_read(sphere(bsdf)); }
std::string surface_error(const std::string& bsdf) {
  const ReadResult r = read(sphere(bsdf));
  return r.scene ? "" : messages(r);
}
template <class T>
const T& surface_bsdf(const Scene& s) {
  return std::get<T>(s.bsdfs.at(s.shapes.at(0).bsdf.value));
}
template <class T>
const T& at(const Scene& s, BsdfIndex i) {
  return std::get<T>(s.bsdfs.at(i.value));
}
Rgb surface_colour(const Scene& s, TextureIndex i) {
  return std::get<ConstantTexture>(s.textures.at(i.value)).value;
}

constexpr char kDiffuse[] = "<bsdf type=\"diffuse\"/>", kGlass[] = "<bsdf type=\"thindielectric\"/>";

// The expected defaults are those that the plugins of Mitsuba 3.9.1 print.
TEST(Surfaces, MissingParametersHaveMitsubasDefaults) {
  const Scene plastic = scene_with_bsdf("<bsdf type=\"plastic\"/>");
  const auto& p = surface_bsdf<PlasticBsdf>(plastic);
  EXPECT_EQ(p.int_ior, 1.49);
  EXPECT_EQ(p.ext_ior, 1.000277);
  EXPECT_FALSE(p.nonlinear);
  EXPECT_EQ(surface_colour(plastic, p.diffuse_reflectance), (Rgb{.5, .5, .5}));
  EXPECT_EQ(surface_colour(plastic, p.specular_reflectance), (Rgb{1, 1, 1}));

  const Scene rough = scene_with_bsdf("<bsdf type=\"roughdielectric\"/>");
  const auto& r = surface_bsdf<RoughDielectricBsdf>(rough);
  EXPECT_EQ(r.distribution, Microfacet::beckmann);
  EXPECT_EQ(r.int_ior, 1.5046);
  EXPECT_EQ(surface_colour(rough, r.alpha_u), (Rgb{.1, .1, .1}));
  EXPECT_EQ(surface_colour(rough, r.alpha_v), (Rgb{.1, .1, .1}));
  EXPECT_EQ(surface_colour(rough, r.specular_transmittance), (Rgb{1, 1, 1}));

  EXPECT_EQ(surface_bsdf<ThinDielectricBsdf>(scene_with_bsdf(kGlass)).int_ior, 1.5046);
  const Scene mask = scene_with_bsdf(fmt::format("<bsdf type=\"mask\">{}</bsdf>", kDiffuse));
  EXPECT_EQ(surface_colour(mask, surface_bsdf<MaskBsdf>(mask).opacity), (Rgb{.5, .5, .5}));
}

TEST(Surfaces, RoughGlassAcceptsOneOrTwoRoughnessesAndMaterialNames) {
  const Scene one = scene_with_bsdf(
      "<bsdf type=\"roughdielectric\"><float name=\"alpha\" value=\".3\"/><string name=\"int_ior\" "
      "value=\"water\"/><string name=\"distribution\" value=\"ggx\"/></bsdf>");
  const auto& b = surface_bsdf<RoughDielectricBsdf>(one);
  EXPECT_EQ(b.alpha_u, b.alpha_v);
  EXPECT_EQ(surface_colour(one, b.alpha_u), (Rgb{.3, .3, .3}));
  EXPECT_EQ(b.int_ior, 1.333);
  EXPECT_EQ(b.distribution, Microfacet::ggx);
  EXPECT_THAT(surface_error("<bsdf type=\"roughdielectric\"><float name=\"alpha\" value=\".3\"/><float "
                            "name=\"alpha_u\" value=\".3\"/></bsdf>"),
              HasSubstr("gives both alpha and alpha_u"));
}

TEST(Surfaces, DiffuseTransmissionHasPbrtsDefaultsAndDifftransHasMitsubas) {
  const Scene sheet = scene_with_bsdf("<bsdf type=\"diffusetransmission\"/>");
  const auto& s = surface_bsdf<DiffuseTransmissionBsdf>(sheet);
  EXPECT_EQ(surface_colour(sheet, s.reflectance), (Rgb{.25, .25, .25}));
  EXPECT_EQ(surface_colour(sheet, s.transmittance), (Rgb{.25, .25, .25}));
  EXPECT_EQ(must_read(write_xml(sheet)), sheet);

  const Scene older = scene_with_bsdf("<bsdf type=\"difftrans\"/>");
  const auto& d = surface_bsdf<DiffuseTransmissionBsdf>(older);
  EXPECT_EQ(surface_colour(older, d.reflectance), (Rgb{0, 0, 0}));
  EXPECT_EQ(surface_colour(older, d.transmittance), (Rgb{.5, .5, .5}));
  for (const char* name : {"transmittance", "diffuseTransmittance"}) {
    const Scene given = must_read(fmt::format(
        "<scene version=\"0.6.0\"><shape type=\"sphere\"><bsdf type=\"difftrans\"><rgb name=\"{}\" "
        "value=\".1 .2 .3\"/></bsdf></shape>{}</scene>",
        name, kSensor));
    EXPECT_EQ(surface_colour(given, surface_bsdf<DiffuseTransmissionBsdf>(given).transmittance),
              (Rgb{.1, .2, .3}))
        << name;
  }
  EXPECT_THAT(surface_error("<bsdf type=\"difftrans\"><float name=\"reflectance\" value=\".5\"/></bsdf>"),
              HasSubstr("has no parameter 'reflectance'"));
}

TEST(Surfaces, SheetReflectsAndTransmitsAtMostAllLight) {
  const auto sheet = [](const char* reflectance, const char* transmittance) {
    return fmt::format(
        "<bsdf type=\"diffusetransmission\"><rgb name=\"reflectance\" value=\"{}\"/><rgb "
        "name=\"transmittance\" value=\"{}\"/></bsdf>",
        reflectance, transmittance);
  };
  EXPECT_EQ(surface_error(sheet(".1 .9 .333334", ".9 .1 .666667")), "") << "rounded to six digits";
  EXPECT_THAT(surface_error(sheet(".1 .5 .2", ".3 .75 .2")),
              HasSubstr("reflectance and transmittance of bsdf \"diffusetransmission\" sum up to 1.25"));
  EXPECT_THAT(surface_error(sheet(".1 .5 .2", ".3 .75 .2")), HasSubstr("test.xml:2:"));
  EXPECT_THAT(surface_error(sheet("0", "2")), HasSubstr("out of its range"));
}

TEST(Surfaces, RoughSheetAcceptsOneOrTwoRoughnesses) {
  const Scene plain = scene_with_bsdf("<bsdf type=\"roughthindielectric\"/>");
  const auto& p = surface_bsdf<RoughThinDielectricBsdf>(plain);
  EXPECT_EQ(p.int_ior, 1.5046);
  EXPECT_EQ(surface_colour(plain, p.alpha_u), (Rgb{.1, .1, .1}));
  EXPECT_EQ(must_read(write_xml(plain)), plain);
  const Scene one = scene_with_bsdf(
      "<bsdf type=\"roughthindielectric\"><float name=\"alpha\" value=\".3\"/><string name=\"int_ior\" "
      "value=\"water\"/><string name=\"distribution\" value=\"ggx\"/></bsdf>");
  const auto& b = surface_bsdf<RoughThinDielectricBsdf>(one);
  EXPECT_EQ(b.alpha_u, b.alpha_v);
  EXPECT_EQ(surface_colour(one, b.alpha_u), (Rgb{.3, .3, .3}));
  EXPECT_EQ(b.int_ior, 1.333);
  EXPECT_THAT(surface_error("<bsdf type=\"roughthindielectric\"><float name=\"alpha\" value=\".3\"/><float "
                            "name=\"alpha_u\" value=\".3\"/></bsdf>"),
              HasSubstr("gives both alpha and alpha_u"));
  EXPECT_THAT(surface_error("<bsdf type=\"roughthindielectric\"><boolean name=\"multiple_scattering\" "
                            "value=\"true\"/><float name=\"alpha_u\" value=\".3\"/></bsdf>"),
              HasSubstr("needs the same roughness both ways"));
}

TEST(Surfaces, SheetPassesLightStraightOnIfItMayBeSmooth) {
  const auto traits = [](const std::string& alpha) {
    const Scene s = scene_with_bsdf("<bsdf type=\"roughthindielectric\">" + alpha + "</bsdf>");
    return scene::bsdf_traits(s)->at(s.shapes.at(0).bsdf.value);
  };
  const auto number = [](const char* name, const char* value) {
    return fmt::format("<float name=\"{}\" value=\"{}\"/>", name, value);
  };
  const std::string image =
      "<texture type=\"bitmap\" name=\"alpha\"><string name=\"filename\" value=\"wood.png\"/></texture>";
  EXPECT_FALSE(traits(number("alpha", ".1")).passes);
  EXPECT_FALSE(traits(number("alpha_u", ".0005")).passes) << "it is rough along v";
  EXPECT_TRUE(traits(number("alpha", ".0005")).passes);
  EXPECT_TRUE(traits(image).passes);
  for (const auto& one : {number("alpha", ".1"), number("alpha", ".0005"), image}) {
    EXPECT_TRUE(traits(one).transmits);
    EXPECT_FALSE(traits(one).black_behind);
  }
  const Scene leaf = scene_with_bsdf("<bsdf type=\"diffusetransmission\"/>");
  const auto of_leaf = scene::bsdf_traits(leaf)->at(0);
  EXPECT_TRUE(of_leaf.transmits);
  EXPECT_FALSE(of_leaf.passes || of_leaf.black_behind);
}

TEST(Surfaces, OpacityReadsTheImagesAlphaWhileOtherUsesReadItsColour) {
  const Scene s = scene_with_bsdf(
      "<bsdf type=\"mask\"><texture type=\"bitmap\" name=\"opacity\" id=\"leaf\"><string name=\"filename\" "
      "value=\"wood.png\"/></texture><bsdf type=\"diffuse\"><ref name=\"reflectance\" "
      "id=\"leaf\"/></bsdf></bsdf>");
  const auto& m = surface_bsdf<MaskBsdf>(s);
  EXPECT_TRUE(std::get<BitmapTexture>(s.textures.at(m.opacity.value)).alpha);
  EXPECT_FALSE(std::get<BitmapTexture>(s.textures.at(at<DiffuseBsdf>(s, m.bsdf).reflectance.value)).alpha);
  EXPECT_EQ(deserialize_scene(serialize(s)).value(), s);
}

TEST(Surfaces, BlendsAreOrderedByNameOrElseByPlace) {
  const std::string weight = "<float name=\"weight\" value=\".2\"/>";
  const Scene placed = scene_with_bsdf(
      fmt::format("<bsdf type=\"blendbsdf\">{}<bsdf type=\"plastic\"/>{}</bsdf>", weight, kDiffuse));
  EXPECT_EQ(surface_colour(placed, surface_bsdf<BlendBsdf>(placed).weight), (Rgb{.2, .2, .2}));
  at<PlasticBsdf>(placed, surface_bsdf<BlendBsdf>(placed).first);
  at<DiffuseBsdf>(placed, surface_bsdf<BlendBsdf>(placed).second);
  const Scene named =
      scene_with_bsdf(fmt::format("<bsdf type=\"blendbsdf\">{}<bsdf type=\"plastic\" name=\"b\"/><bsdf "
                                  "type=\"diffuse\" name=\"a\"/></bsdf>",
                                  weight));
  at<DiffuseBsdf>(named, surface_bsdf<BlendBsdf>(named).first);
  at<PlasticBsdf>(named, surface_bsdf<BlendBsdf>(named).second);
  EXPECT_EQ(deserialize_scene(serialize(named)).value(), named);
}

TEST(Surfaces, ImpossibleNestingIsRefusedWithItsPlace) {
  EXPECT_THAT(surface_error("<bsdf type=\"mask\"/>"), HasSubstr("needs one nested bsdf, not 0"));
  EXPECT_THAT(surface_error(fmt::format("<bsdf type=\"blendbsdf\">{}</bsdf>", kDiffuse)),
              HasSubstr("needs two nested bsdfs, not 1"));
  for (const char* type : {"roughdielectric", "thindielectric", "roughthindielectric", "diffusetransmission"})
    EXPECT_THAT(surface_error(fmt::format("<bsdf type=\"twosided\"><bsdf type=\"{}\"/></bsdf>", type)),
                HasSubstr("it can't stand in \"twosided\""));
  EXPECT_THAT(
      surface_error(fmt::format("<bsdf type=\"twosided\"><bsdf type=\"mask\">{}</bsdf></bsdf>", kDiffuse)),
      HasSubstr("it can't stand in \"twosided\""));
  EXPECT_THAT(surface_error(fmt::format("<bsdf type=\"mask\"><float name=\"opacity\" value=\"2\"/>{}</bsdf>",
                                        kDiffuse)),
              HasSubstr("out of its range"));
  EXPECT_EQ(surface_error(fmt::format(
                "<bsdf type=\"twosided\"><bsdf type=\"blendbsdf\">{0}<bsdf type=\"plastic\"/></bsdf></bsdf>",
                kDiffuse)),
            "");
}

TEST(Surfaces, NormalMapContainsImageAndBsdf) {
  const Scene s = scene_with_bsdf(
      "<bsdf type=\"twosided\"><bsdf type=\"normalmap\"><texture type=\"bitmap\" name=\"normalmap\"><boolean "
      "name=\"raw\" value=\"true\"/><string name=\"filename\" value=\"wood.png\"/></texture><bsdf "
      "type=\"plastic\"/></bsdf></bsdf>");
  const auto& n = at<NormalMapBsdf>(s, surface_bsdf<TwoSidedBsdf>(s).front);
  EXPECT_TRUE(std::get<BitmapTexture>(s.textures.at(n.normalmap.value)).raw);
  at<PlasticBsdf>(s, n.bsdf);
  EXPECT_TRUE(n.flip_invalid_normals && n.use_shadowing_function);
  const Scene plain = scene_with_bsdf(
      "<bsdf type=\"normalmap\"><rgb name=\"normalmap\" value=\".5 .5 1\"/><bsdf type=\"diffuse\"/>"
      "<boolean name=\"flip_invalid_normals\" value=\"false\"/><boolean name=\"use_shadowing_function\" "
      "value=\"false\"/></bsdf>");
  EXPECT_FALSE(surface_bsdf<NormalMapBsdf>(plain).flip_invalid_normals);
  EXPECT_FALSE(surface_bsdf<NormalMapBsdf>(plain).use_shadowing_function);
  EXPECT_EQ(must_read(write_xml(plain)), plain);
  EXPECT_EQ(deserialize_scene(serialize(s)).value(), s);
}

std::string masks(int count) {
  std::string s = kDiffuse;
  for (int i = 0; i < count; ++i) s = fmt::format("<bsdf type=\"mask\">{}</bsdf>", s);
  return s;
}

TEST(Surfaces, NestingIsLimited) {
  EXPECT_EQ(surface_error(masks(scene::kMaxBsdfNesting - 1)), "");
  EXPECT_THAT(surface_error(masks(scene::kMaxBsdfNesting)), HasSubstr("bsdfs are nested more than 8 deep"));
  // The limit also holds for canonical JSON.
  Scene s = scene_with_bsdf(masks(scene::kMaxBsdfNesting - 1));
  s.bsdfs.push_back(MaskBsdf{{0}, s.shapes[0].bsdf});
  EXPECT_THAT(deserialize_scene(serialize(s)).error().message, HasSubstr("more than 8 deep"));
  s.bsdfs = {BlendBsdf{{0}, {1}, {1}}, MaskBsdf{{0}, {0}}};
  s.shapes[0].bsdf = {0};
  EXPECT_THAT(deserialize_scene(serialize(s)).error().message, HasSubstr("circle"));
}

TEST(Surfaces, TraitsDeriveFromNestedSurfaces) {
  Scene s;
  s.textures = {ConstantTexture{}};
  s.bsdfs = {DiffuseBsdf{},      RoughDielectricBsdf{},  BlendBsdf{{0}, {0}, {1}},
             MaskBsdf{{0}, {2}}, TwoSidedBsdf{{0}, {0}}, NullBsdf{}};
  const auto traits = scene::bsdf_traits(s);
  ASSERT_TRUE(traits);
  EXPECT_EQ((*traits)[0], (scene::BsdfTraits{1, false, false, false, true}));
  EXPECT_EQ((*traits)[1], (scene::BsdfTraits{1, true, false, false, false}));
  EXPECT_EQ((*traits)[2], (scene::BsdfTraits{2, true, false, false, false}));
  EXPECT_EQ((*traits)[3], (scene::BsdfTraits{3, true, true, false, false}));
  EXPECT_EQ((*traits)[4], (scene::BsdfTraits{2, false, false, true, false}));
  EXPECT_EQ((*traits)[5], (scene::BsdfTraits{1, true, true, false, false}));
}

// The expected values are Mitsuba 3's, also for eta as a function of specular.
TEST(Surfaces, PrincipledHasMitsubasDefaults) {
  const Scene plain = scene_with_bsdf("<bsdf type=\"principled\"/>");
  const auto& p = surface_bsdf<PrincipledBsdf>(plain);
  EXPECT_EQ(p.eta, 1.5);
  EXPECT_EQ(surface_colour(plain, p.base_color), (Rgb{.5, .5, .5}));
  EXPECT_EQ(surface_colour(plain, p.roughness), (Rgb{.5, .5, .5}));
  for (const TextureIndex none : {p.anisotropic, p.metallic, p.spec_tint, p.sheen, p.sheen_tint, p.flatness,
                                  p.clearcoat, p.clearcoat_gloss})
    EXPECT_EQ(surface_colour(plain, none), (Rgb{0, 0, 0}));
  EXPECT_FALSE(p.spec_trans);
  const Scene given = scene_with_bsdf(
      "<bsdf type=\"principled\"><float name=\"specular\" value=\".8\"/><float name=\"spec_trans\" "
      "value=\".25\"/><float name=\"main_specular_sampling_rate\" value=\"2\"/></bsdf>");
  const auto& g = surface_bsdf<PrincipledBsdf>(given);
  EXPECT_DOUBLE_EQ(g.eta, 2 / (1 - std::sqrt(.08 * .8)) - 1);
  EXPECT_EQ(surface_colour(given, g.spec_trans.value()), (Rgb{.25, .25, .25}));
  EXPECT_EQ(deserialize_scene(serialize(given)).value(), given);
  EXPECT_THAT(surface_error("<bsdf type=\"principled\"><float name=\"eta\" value=\"1.3\"/><float "
                            "name=\"specular\" value=\".5\"/></bsdf>"),
              HasSubstr("gives both eta and specular"));
}

TEST(Surfaces, CoatedConductorDefaultsToASmoothCoatAndAPerfectMirror) {
  const Scene plain = scene_with_bsdf("<bsdf type=\"coatedconductor\"/>");
  const auto& p = surface_bsdf<CoatedConductorBsdf>(plain);
  EXPECT_EQ(p.int_ior, 1.49);
  EXPECT_EQ(p.ext_ior, 1.000277);
  EXPECT_EQ(p.coat_alpha, 0);
  EXPECT_EQ(p.alpha_u, .1);
  EXPECT_EQ(p.alpha_v, .1);
  EXPECT_EQ(p.eta, (Rgb{0, 0, 0}));
  EXPECT_EQ(p.k, (Rgb{1, 1, 1}));
  EXPECT_EQ(surface_colour(plain, p.specular_reflectance), (Rgb{1, 1, 1}));
  const Scene given = scene_with_bsdf(
      "<bsdf type=\"coatedconductor\"><string name=\"material\" value=\"Au\"/><string name=\"int_ior\" "
      "value=\"water\"/><float name=\"alpha\" value=\"0\"/><float name=\"coat_alpha\" value=\".2\"/></bsdf>");
  const auto& g = surface_bsdf<CoatedConductorBsdf>(given);
  EXPECT_EQ(g.int_ior, 1.333);
  EXPECT_EQ(g.coat_alpha, .2);
  EXPECT_EQ(g.alpha_u, 0);
  EXPECT_EQ(g.alpha_v, 0);
  EXPECT_EQ(g.eta[0], .14304);
  EXPECT_EQ(deserialize_scene(serialize(given)).value(), given);
  EXPECT_EQ(must_read(write_xml(given)), given);
}

TEST(Surfaces, CoatedConductorRefusesInvalidParameters) {
  const auto error = [](const char* parameters) {
    return surface_error(fmt::format("<bsdf type=\"coatedconductor\">{}</bsdf>", parameters));
  };
  EXPECT_THAT(error("<float name=\"alpha\" value=\".1\"/><float name=\"alpha_u\" value=\".1\"/>"),
              HasSubstr("gives both alpha and alpha_u, alpha_v"));
  EXPECT_THAT(error("<float name=\"alpha\" value=\"-.1\"/>"), HasSubstr("0 <= alpha"));
  EXPECT_THAT(error("<float name=\"coat_alpha\" value=\"-.1\"/>"), HasSubstr("0 <= coat_alpha"));
  EXPECT_THAT(error("<float name=\"int_ior\" value=\"0\"/>"), HasSubstr("int_ior"));
  EXPECT_THAT(error("<string name=\"material\" value=\"Au\"/><rgb name=\"k\" value=\"1\"/>"),
              HasSubstr("gives both a material and eta or k"));
}

TEST(Surfaces, PrincipledIsTwoSidedOnlyByItsGlass) {
  EXPECT_EQ(surface_error("<bsdf type=\"twosided\"><bsdf type=\"principled\"><float name=\"spec_trans\" "
                          "value=\"0\"/></bsdf></bsdf>"),
            "");
  EXPECT_THAT(surface_error("<bsdf type=\"twosided\"><bsdf type=\"principled\"><float name=\"spec_trans\" "
                            "value=\".1\"/></bsdf></bsdf>"),
              HasSubstr("has two sides of its own"));
}

TEST(Surfaces, BumpMapAcceptsItsTextureUnderAnyName) {
  const std::string image =
      "<string name=\"filename\" value=\"wood.png\"/><boolean name=\"raw\" value=\"true\"/></texture>";
  for (const char* name : {"", " name=\"texture\"", " name=\"arbitrary\""}) {
    const Scene s = scene_with_bsdf(fmt::format(
        "<bsdf type=\"bumpmap\"><texture type=\"bitmap\"{}>{}<float name=\"scale\" value=\"3\"/>{}</bsdf>",
        name, image, kDiffuse));
    const auto& b = surface_bsdf<BumpMapBsdf>(s);
    EXPECT_EQ(b.scale, 3);
    EXPECT_TRUE(std::get<BitmapTexture>(s.textures.at(b.texture.value)).raw);
    EXPECT_TRUE(std::holds_alternative<DiffuseBsdf>(s.bsdfs.at(b.bsdf.value)));
    EXPECT_EQ(must_read(write_xml(s)), s);
  }
}

TEST(Surfaces, BumpMapNeedsABitmapAndOneBsdf) {
  EXPECT_THAT(surface_error(fmt::format("<bsdf type=\"bumpmap\">{}</bsdf>", kDiffuse)),
              HasSubstr("needs a texture \"bitmap\""));
  EXPECT_THAT(surface_error(
                  fmt::format("<bsdf type=\"bumpmap\"><texture type=\"checkerboard\"/>{}</bsdf>", kDiffuse)),
              HasSubstr("needs a texture \"bitmap\""));
  EXPECT_THAT(surface_error("<bsdf type=\"bumpmap\"><texture type=\"bitmap\"><string name=\"filename\" "
                            "value=\"wood.png\"/></texture></bsdf>"),
              HasSubstr("needs one nested bsdf"));
}

}  // namespace
}  // namespace ls

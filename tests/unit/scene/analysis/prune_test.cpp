// Pruning removes the parts of a scene that no pixel depends on, and keeps all others. Also tests the needs
// of the pruned scenes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/analysis/needs.h"
#include "core/scene/analysis/prune.h"
#include "core/scene/schema/integrators.h"
#include "core/scene/schema/validate.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using scene::Needs;
using scene::Pruned;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;

Pruned pruned_text(std::string_view objects, bool sees_media = true) {
  const Pruned p = scene::pruned(must_read(with_sensor(objects)), {sees_media});
  EXPECT_EQ(scene::find_inconsistency(p.scene), "");
  EXPECT_EQ(scene::pruned(p.scene, {sees_media}).scene, p.scene);
  EXPECT_EQ(serialize(deserialize_scene(serialize(p.scene)).value()), serialize(p.scene));
  return p;
}
Needs needs(std::string_view objects, bool sees_media = true) {
  return scene::needs_of(pruned_text(objects, sees_media).scene, sees_media);
}
std::vector<std::string> names(const Scene& s) {
  std::vector<std::string> out;
  for (const Asset& a : s.assets) out.push_back(a.name);
  return out;
}
std::string sphere(std::string_view inside) {
  return fmt::format("<shape type=\"sphere\">{}</shape>\n", inside);
}
std::string weighted(const char* plugin, const char* number, const char* value, std::string_view inside) {
  return fmt::format(R"(<bsdf type="{}"><rgb name="{}" value="{}"/>{}</bsdf>)", plugin, number, value,
                     inside);
}
const std::string kWood =
    R"(<bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="wood.png"/></texture></bsdf>)";
const std::string kGreyMaterial = R"(<bsdf type="diffuse"/>)";
const std::string kMetal = R"(<bsdf type="conductor"/>)";
std::string grid_medium(std::string_view more, std::string_view file = "cloud.vol") {
  return fmt::format(
      R"(<medium type="heterogeneous" name="interior"><volume type="gridvolume" name="sigma_t"><string name="filename" value="{}"/></volume>{}</medium>)",
      file, more);
}
const std::string kNull = R"(<bsdf type="null"/>)";

TEST(Prune, BlendOfWeight0Or1KeepsOneBranchAndDropsTheOthersFiles) {
  const Pruned first = pruned_text(sphere(weighted("blendbsdf", "weight", "0", kMetal + kWood)));
  ASSERT_EQ(first.scene.bsdfs.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<ConductorBsdf>(first.scene.bsdfs[0]));
  EXPECT_TRUE(first.scene.assets.empty());
  EXPECT_THAT(first.left_out, Contains(AllOf(Field(&scene::LeftOut::what, "branch of a blend"),
                                             Field(&scene::LeftOut::why, "its weight is 0"))));
  EXPECT_THAT(first.left_out,
              Contains(AllOf(Field(&scene::LeftOut::what, "wood.png"), Field(&scene::LeftOut::bytes, 6u))));

  const Pruned second = pruned_text(sphere(weighted("blendbsdf", "weight", "1", kMetal + kWood)));
  EXPECT_TRUE(std::holds_alternative<DiffuseBsdf>(second.scene.bsdfs.at(0)));
  EXPECT_EQ(names(second.scene), (std::vector<std::string>{"wood.png"}));

  const Pruned both = pruned_text(sphere(weighted("blendbsdf", "weight", "0.001", kMetal + kWood)));
  EXPECT_EQ(both.scene.bsdfs.size(), 3u);
  EXPECT_TRUE(both.left_out.empty());
}

TEST(Prune, WeightWithDifferentChannelsKeepsBothBranches) {
  EXPECT_EQ(pruned_text(sphere(weighted("blendbsdf", "weight", "0, 0, 1", kMetal + kGreyMaterial)))
                .scene.bsdfs.size(),
            3u);
}

TEST(Prune, RemovesNestedBranchesLevelByLevel) {
  const std::string inner = weighted("blendbsdf", "weight", "0", kGreyMaterial + kWood);
  const std::string mask = weighted("mask", "opacity", "1", inner);
  const Pruned p = pruned_text(sphere(weighted("blendbsdf", "weight", "1", kMetal + mask)));
  ASSERT_EQ(p.scene.bsdfs.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<DiffuseBsdf>(p.scene.bsdfs[0]));
  EXPECT_TRUE(p.scene.assets.empty());
}

TEST(Prune, TwoSidedMaterialKeepsTheVisibleBranchOfItsBlend) {
  const std::string two = R"(<bsdf type="twosided">)" + kMetal + kWood + "</bsdf>";
  const std::string blend = weighted("blendbsdf", "weight", "0", two + kGreyMaterial);
  const Pruned p = pruned_text(sphere(R"(<bsdf type="twosided">)" + blend + "</bsdf>"));
  ASSERT_EQ(p.scene.bsdfs.size(), 2u);  // the front is shown to both sides
  EXPECT_TRUE(p.scene.assets.empty());
}

TEST(Prune, RemovesAMaskOfOpacity0) {
  const Pruned p = pruned_text(sphere(weighted("mask", "opacity", "0", kWood)) + sphere(kGreyMaterial));
  EXPECT_EQ(p.scene.shapes.size(), 1u);
  EXPECT_TRUE(p.scene.assets.empty());
  EXPECT_FALSE(scene::needs_of(p.scene, true).null_transmission);
}

TEST(Prune, RemovesSurfacesWithoutEffectUnlessTheyEmitOrSeparateMedia) {
  const std::string lit = R"(<emitter type="area"><rgb name="radiance" value="1"/></emitter>)";
  const std::string fog = R"(<medium type="homogeneous" name="interior"/>)";
  EXPECT_EQ(pruned_text(sphere(kNull)).scene.shapes.size(), 0u);
  EXPECT_EQ(pruned_text(sphere(kNull + lit)).scene.shapes.size(), 1u);
  EXPECT_EQ(pruned_text(sphere(kNull + fog)).scene.shapes.size(), 1u);
  EXPECT_EQ(pruned_text(sphere(kGreyMaterial)).scene.shapes.size(), 1u);
}

std::string hidden_from(std::initializer_list<std::string_view> rays) {
  std::string flags;
  for (const auto ray : rays) flags += fmt::format("<boolean name=\"visible_{}\" value=\"false\"/>", ray);
  return flags;
}

TEST(Prune, RemovesShapesAndLightsThatAreHiddenFromAllRays) {
  const std::string all = hidden_from({"camera", "shadow", "reflection", "volume"}),
                    some = hidden_from({"camera", "reflection", "volume"}),
                    receivers = hidden_from({"reflection", "volume"});
  EXPECT_EQ(pruned_text(sphere(kGreyMaterial + all)).scene.shapes.size(), 0u);
  EXPECT_EQ(pruned_text(sphere(kGreyMaterial + some)).scene.shapes.size(), 1u) << "it casts shadows";
  EXPECT_EQ(pruned_text(sphere(kGreyMaterial + all + R"(<medium type="homogeneous" name="interior"/>)"))
                .scene.shapes.size(),
            1u)
      << "the medium inside stays";
  const auto lights = [](const std::string& type, const std::string& flags) {
    return pruned_text("<emitter type=\"" + type + "\">" + flags + "</emitter>").scene.emitters.size();
  };
  EXPECT_EQ(lights("point", receivers), 0u);
  EXPECT_EQ(lights("point", hidden_from({"volume"})), 1u);
  EXPECT_EQ(lights("constant", receivers), 1u) << "the camera sees it";
  EXPECT_EQ(lights("constant", receivers + hidden_from({"camera"})), 0u);
}

TEST(Prune, RemovesAGroupOfInvisibleShapesWithItsInstances) {
  const std::string group = "<shape type=\"shapegroup\" id=\"g\">" + sphere(kNull) + "</shape>";
  const std::string instance = R"(<shape type="instance"><ref id="g"/></shape>)";
  const Pruned p = pruned_text(group + instance + sphere(kGreyMaterial));
  EXPECT_EQ(p.scene.groups.size() + p.scene.instances.size(), 0u);
  EXPECT_EQ(p.scene.shapes.size(), 1u);
}

TEST(Prune, RemovesLightsWithoutPowerAndTheirFiles) {
  const std::string dark = R"(<emitter type="area"><rgb name="radiance" value="0"/></emitter>)";
  const Pruned p = pruned_text(sphere(kGreyMaterial + dark) +
                               R"(<emitter type="point"><rgb name="intensity" value="0"/></emitter>
                             <emitter type="constant"><rgb name="radiance" value="0"/></emitter>
                             <emitter type="point"/>)");
  EXPECT_EQ(p.scene.emitters.size(), 1u);
  EXPECT_FALSE(p.scene.shapes.at(0).emitter);
  EXPECT_THAT(p.left_out,
              Contains(AllOf(Field(&scene::LeftOut::what, "light"), Field(&scene::LeftOut::count, 3u))));

  const Pruned map = pruned_text(
      R"(<emitter type="envmap"><string name="filename" value="wood.png"/><float name="scale" value="0"/></emitter>)");
  EXPECT_TRUE(map.scene.emitters.empty());
  EXPECT_TRUE(map.scene.assets.empty());
}

TEST(Prune, RemovesAnEmptyMediumWithItsGrid) {
  const Pruned p =
      pruned_text(sphere(kNull + grid_medium(R"(<float name="scale" value="0"/>)")) + sphere(kGreyMaterial));
  EXPECT_TRUE(p.scene.media.empty());
  EXPECT_TRUE(p.scene.assets.empty());
  EXPECT_EQ(p.scene.shapes.size(), 1u);
  const Pruned live = pruned_text(sphere(kNull + grid_medium("")));
  EXPECT_EQ(live.scene.assets.size(), 1u);
}

TEST(Prune, EmptyMediumBesideAnotherKeepsItsBoundary) {
  const std::string dead =
      R"(<medium type="homogeneous" name="interior"><float name="scale" value="0"/></medium>)";
  const std::string live = R"(<medium type="homogeneous" name="exterior"/>)";
  const Pruned p = pruned_text(sphere(kNull + dead + live));
  ASSERT_EQ(p.scene.shapes.size(), 1u);
  EXPECT_FALSE(p.scene.shapes[0].interior);
  EXPECT_TRUE(p.scene.shapes[0].exterior && p.scene.shapes[0].is_medium_transition);
}

TEST(Prune, EmptyMediumStaysWhereItDisplacesOthers) {
  const std::string gap =
      R"(<medium type="homogeneous" name="interior"><float name="scale" value="0"/><integer name="priority" value="1"/></medium>)";
  const std::string fog = R"(<medium type="homogeneous" name="interior"/>)";
  const Pruned p = pruned_text(sphere(kNull + gap) + sphere(kNull + fog));
  EXPECT_EQ(p.scene.media.size(), 2u);
  EXPECT_TRUE(p.scene.shapes.at(0).interior);
}

TEST(Prune, IntegratorWithoutMediaNeedsNoFilesOfMedia) {
  const std::string objects = sphere(kNull + grid_medium("")) + sphere(kGreyMaterial);
  EXPECT_EQ(pruned_text(objects, true).scene.assets.size(), 1u);
  const Pruned p = pruned_text(objects, false);
  EXPECT_TRUE(p.scene.assets.empty());
  EXPECT_EQ(p.scene.shapes.size(), 1u);
  EXPECT_FALSE(scene::sees_media("path"));
  EXPECT_FALSE(scene::sees_media("direct"));
  EXPECT_TRUE(scene::sees_media("volpath"));
  EXPECT_TRUE(scene::sees_media("volpath_distant_mis"));
}

TEST(Prune, KeepsSurfacesThatCountForMaxDepth) {
  const Scene s = must_read(with_sensor(sphere(kNull) + sphere(kGreyMaterial)));
  EXPECT_EQ(scene::pruned(s, scene::pruned_for("path", 3)).scene.shapes.size(), 2u);
  EXPECT_EQ(scene::pruned(s, scene::pruned_for("path", -1)).scene.shapes.size(), 1u);
  EXPECT_EQ(scene::pruned(s, scene::pruned_for("volpath", 3)).scene.shapes.size(), 1u);
}

TEST(Prune, LightOfStrength0NeedsNoGrid) {
  const std::string set_emission =
      R"(<volume type="gridvolume" name="emission"><string name="filename" value="steam.vdb"/></volume><float name="emission_scale" value="0"/>)";
  const Pruned p = pruned_text(sphere(kNull + grid_medium(set_emission)));
  EXPECT_EQ(names(p.scene), (std::vector<std::string>{"cloud.vol"}));
  EXPECT_FALSE(scene::needs_of(p.scene, true).emission);
}

TEST(Prune, KeepsTheExampleWithEveryFeature) {
  const Scene s = must_read(kExample);
  EXPECT_EQ(scene::pruned(s, {}).scene, s);
}

TEST(Needs, MatchTheScene) {
  const Needs none = needs(sphere(kGreyMaterial));
  EXPECT_FALSE(none.media || none.grids || none.chromatic || none.emission || none.boundaries ||
               none.null_transmission);
  EXPECT_EQ(none.shapes, (std::map<std::string, std::uint32_t>{{"sphere", 1}}));
  EXPECT_EQ(none.sampled_lights(), 0u);

  const Needs fog = needs(
      sphere(kNull +
             R"(<medium type="homogeneous" name="interior"><rgb name="sigma_t" value="1, 2, 3"/></medium>)"));
  EXPECT_TRUE(fog.media && fog.chromatic && fog.boundaries);
  EXPECT_FALSE(fog.grids || fog.emission || fog.anisotropic);

  const Needs cloud = needs(sphere(kNull + grid_medium(R"(<phase type="hg"/>)")) +
                            R"(<emitter type="point"/><emitter type="constant"/>)");
  EXPECT_TRUE(cloud.media && cloud.grids && cloud.anisotropic);
  EXPECT_FALSE(cloud.chromatic);
  EXPECT_EQ(cloud.sampled_lights(), 1u);
  EXPECT_FALSE(cloud.only_delta_lights);
  ASSERT_EQ(cloud.files.size(), 1u);
  EXPECT_EQ(cloud.files[0].uses, (std::vector<std::string>{"grid"}));
  EXPECT_TRUE(needs(R"(<emitter type="point"/>)").only_delta_lights);
}

TEST(Needs, CountWhatIsHiddenFromSomeRays) {
  EXPECT_EQ(needs(sphere(kGreyMaterial + hidden_from({"camera"}))).ray_flags, 0u);
  const Needs some = needs(sphere(kGreyMaterial + hidden_from({"shadow"})) + "<emitter type=\"point\">" +
                           hidden_from({"volume"}) + "</emitter>");
  EXPECT_EQ(some.ray_flags, 2u);
  EXPECT_EQ(some.flagged_shapes, 0u);
  EXPECT_THAT(canonical_json(some), HasSubstr("\"ray_flags\":2"));
  EXPECT_EQ(canonical_json(needs(sphere(kGreyMaterial))).find("ray_flags"), std::string::npos);
}

TEST(Needs, IntegratorWithoutMediaNeedsNone) {
  const Scene s = must_read(with_sensor(sphere(kNull + grid_medium(""))));
  EXPECT_TRUE(scene::needs_of(s, true).media);
  EXPECT_FALSE(scene::needs_of(s, false).media);
}

TEST(Needs, HaveOneCanonicalTextAndNameDifferences) {
  const std::string a = canonical_json(needs(sphere(kGreyMaterial))),
                    b = canonical_json(needs(sphere(kGreyMaterial) + sphere(kMetal)));
  EXPECT_EQ(a, canonical_json(needs(sphere(kGreyMaterial))));
  EXPECT_EQ(scene::first_difference(a, a), "");
  EXPECT_THAT(scene::first_difference(a, b),
              HasSubstr("materials: {\"diffuse\":1} here, {\"conductor\":1,\"diffuse\":1} there"));
  EXPECT_NE(scene::first_difference(a, "{"), "");
  EXPECT_NE(scene::first_difference(a, "[]"), "");
  EXPECT_NE(scene::first_difference(a, "{\"future\":true}"), "");
}

TEST(Needs, ExplainEveryPart) {
  for (const scene::Need& n : in_words(needs(sphere(kNull + grid_medium("")) + kGreyMaterial))) {
    EXPECT_FALSE(n.part.empty());
    EXPECT_FALSE(n.why.empty()) << n.part;
    if (n.part == "volume grids") {
      EXPECT_TRUE(n.used);
      EXPECT_EQ(n.why, "grid of cloud.vol");
    }
    if (n.part == "light given off by media") {
      EXPECT_FALSE(n.used);
      EXPECT_EQ(n.why, "no medium glows");
    }
  }
}

// Lamps without extent beside smooth glass and mirrors.
TEST(Needs, NameTheLightThatNoPathFinds) {
  const auto missing = [](const std::string& shapes) {
    for (const scene::Need& n : in_words(needs(shapes)))
      if (n.part == "light of lamps without extent by way of smooth surfaces") return n.used ? "used" : n.why;
    return std::string();
  };
  const std::string sun = R"(<emitter type="directional"/>)", point = R"(<emitter type="point"/>)",
                    sky = R"(<emitter type="constant"/>)", glass = sphere(R"(<bsdf type="dielectric"/>)");

  EXPECT_THAT(missing(glass + sun + point),
              AllOf(HasSubstr("missing in the image"), HasSubstr("extent: 2"), HasSubstr("coats: 1")));
  EXPECT_NE(missing(sphere(kMetal) + sun), "");
  EXPECT_EQ(missing(glass + sky), "") << "paths that leave the glass find the sky";
  EXPECT_EQ(missing(sphere(R"(<bsdf type="thindielectric"/>)") + sun), "") << "light passes straight";
  EXPECT_EQ(missing(sphere(R"(<bsdf type="roughdielectric"/>)") + sun), "");
  EXPECT_EQ(missing(sphere(kGreyMaterial) + point), "");
  const auto with = [](std::string_view type, std::string_view more) {
    return fmt::format(R"(<emitter type="{}">{}</emitter>)", type, more);
  };
  EXPECT_EQ(missing(glass + with("directional", R"(<float name="angular_radius" value="0.5"/>)")), "");
  EXPECT_EQ(missing(glass + with("point", R"(<boolean name="visible_reflection" value="false"/>)")), "");
}

}  // namespace
}  // namespace ls

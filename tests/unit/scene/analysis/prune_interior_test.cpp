// Pruning removes media that no camera path enters, and the phase functions of media that do not scatter. All
// other media stay.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/analysis/needs.h"
#include "core/scene/analysis/prune.h"
#include "core/scene/schema/validate.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using scene::Pruned;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Field;

Pruned pruned(const Scene& s) {
  const Pruned p = scene::pruned(s, {});
  EXPECT_EQ(scene::find_inconsistency(p.scene), "");
  EXPECT_EQ(scene::pruned(p.scene, {}).scene, p.scene);
  return p;
}
Pruned pruned(std::string_view objects) { return pruned(must_read(with_sensor(objects))); }

// The camera is at the origin and looks along +z.
const std::string kAhead = R"(<transform name="to_world"><translate z="5"/></transform>)";
const std::string kGrid =
    R"(<medium type="heterogeneous" name="interior"><volume type="gridvolume" name="sigma_t"><string name="filename" value="cloud.vol"/></volume></medium>)";
const std::string kFog = R"(<medium type="homogeneous" name="interior"/>)";
const std::string kFire =
    R"(<medium type="homogeneous" name="interior"><rgb name="emission" value="1"/></medium>)";
const std::string kGrey = R"(<bsdf type="diffuse"/>)";
const std::string kWhole = R"(<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>)";
const std::string kGlassWithInterior = R"(<bsdf type="dielectric"/>)";
const std::string kArea = R"(<emitter type="area"><rgb name="radiance" value="1"/></emitter>)";

std::string shape(std::string_view type, std::string_view inside) {
  return fmt::format("<shape type=\"{}\">{}</shape>\n", type, inside);
}
std::string cube(std::string_view inside) { return shape("cube", kAhead + std::string(inside)); }
std::string at(double x, double y, double z, double size = 1) {
  return fmt::format(
      R"(<transform name="to_world"><scale value="{}"/><translate x="{}" y="{}" z="{}"/></transform>)", size,
      x, y, z);
}
std::string bsdf(std::string_view type, std::string_view inside = "") {
  return fmt::format("<bsdf type=\"{}\">{}</bsdf>", type, inside);
}

std::size_t media(std::string_view objects) { return pruned(objects).scene.media.size(); }

TEST(PruneInteriors, InteriorThatSomeRaysLookIntoStays) {
  EXPECT_EQ(media(cube(kWhole + kFog) + R"(<emitter type="point"/>)"), 0u);
  for (const char* flag : {"visible_camera", "visible_shadow", "visible_reflection", "visible_volume"}) {
    const std::string hidden = fmt::format("<boolean name=\"{}\" value=\"false\"/>", flag);
    EXPECT_EQ(media(cube(kWhole + kFog + hidden) + R"(<emitter type="point"/>)"), 1u) << flag;
  }
}

TEST(PruneInteriors, InteriorOfAnOpaqueBodyIsRemovedWithItsGrid) {
  const Pruned p = pruned(cube(kWhole + kGrid) + R"(<emitter type="point"/>)");
  EXPECT_TRUE(p.scene.media.empty());
  EXPECT_TRUE(p.scene.assets.empty());
  ASSERT_EQ(p.scene.shapes.size(), 1u);
  EXPECT_FALSE(p.scene.shapes[0].interior);
  EXPECT_FALSE(scene::needs_of(p.scene, true).media || scene::needs_of(p.scene, true).grids);
  EXPECT_THAT(p.left_out, Contains(AllOf(Field(&scene::LeftOut::what, "medium"),
                                         Field(&scene::LeftOut::why, "no light gets into what it fills"),
                                         Field(&scene::LeftOut::count, 1u))));
  EXPECT_THAT(p.left_out,
              Contains(AllOf(Field(&scene::LeftOut::what, "cloud.vol"), Field(&scene::LeftOut::bytes, 6u))));
}

TEST(PruneInteriors, InteriorsOfAllOpaqueMaterialsAreRemoved) {
  const std::string rough = bsdf("roughconductor");
  for (const std::string& b :
       {kGrey, bsdf("conductor"), rough, bsdf("plastic"), bsdf("roughplastic"), bsdf("principled"), kWhole,
        bsdf("twosided", rough + kGrey), bsdf("blendbsdf", kGrey + rough),
        bsdf("twosided", bsdf("blendbsdf", kGrey + rough)),
        bsdf("mask", R"(<float name="opacity" value="1"/>)" + kWhole),
        bsdf("blendbsdf", R"(<float name="weight" value="0"/>)" + kGrey + kGlassWithInterior)}) {
    EXPECT_EQ(media(cube(b + kGrid)), 0u) << b;
    EXPECT_EQ(media(shape("sphere", kAhead + b + kGrid)), 0u) << b;
  }
}

TEST(PruneInteriors, ExteriorOfABodyStays) {
  const std::string outside = R"(<medium type="homogeneous" name="exterior"/>)";
  const Pruned p = pruned(cube(kWhole + kGrid + outside));
  ASSERT_EQ(p.scene.media.size(), 1u);
  EXPECT_FALSE(p.scene.shapes.at(0).interior);
  EXPECT_TRUE(p.scene.shapes.at(0).exterior && p.scene.shapes.at(0).is_medium_transition);
}

TEST(PruneInteriors, InteriorsThatLightReachesStay) {
  const std::string opacity =
      R"(<texture type="bitmap" name="opacity"><string name="filename" value="wood.png"/></texture>)";
  for (const std::string& b :
       {kGlassWithInterior, bsdf("null"), bsdf("roughdielectric"), bsdf("thindielectric"),
        bsdf("mask", R"(<float name="opacity" value="0.9"/>)" + kGrey), bsdf("mask", opacity + kWhole),
        bsdf("blendbsdf", R"(<float name="weight" value="0.01"/>)" + kGrey + kGlassWithInterior),
        bsdf("principled", R"(<float name="spec_trans" value="0.5"/>)")})
    EXPECT_EQ(media(cube(b + kGrid)), 1u) << b;
}

TEST(PruneInteriors, StayWhereSomethingElseNamesTheMedium) {
  const std::string named =
      R"(<medium type="homogeneous" id="fog"/>)" + cube(kWhole + R"(<ref name="interior" id="fog"/>)");
  EXPECT_EQ(media(named), 0u);
  EXPECT_EQ(
      media(named + shape("sphere", at(9, 0, 9) + kGlassWithInterior + R"(<ref name="interior" id="fog"/>)")),
      1u);
  EXPECT_EQ(media(named + shape("sphere", at(9, 0, 9) + kGrey + R"(<ref name="exterior" id="fog"/>)")), 1u);
  EXPECT_EQ(media(named + shape("sphere", at(9, 0, 9) + kWhole + R"(<ref name="interior" id="fog"/>)")), 0u);

  Scene s = must_read(with_sensor(cube(kWhole + kFog)));
  s.sensor.medium = s.shapes.at(0).interior;
  EXPECT_EQ(pruned(s).scene.media.size(), 1u);
}

TEST(PruneInteriors, StayAroundTheCamera) {
  for (const char* body : {"cube", "sphere"}) {
    EXPECT_EQ(media(shape(body, kWhole + kFog)), 1u);
    EXPECT_EQ(media(shape(body, at(0, 0, .5) + kGrey + kFog)), 1u);
    EXPECT_EQ(media(shape(body, at(0, 0, -1.5) + kWhole + kFog)), 0u);
  }
}

// Camera rays begin on the near plane.
TEST(PruneInteriors, StayWhereTheCamerasNearPlaneMayBe) {
  Scene s = must_read(with_sensor(cube(kWhole + kFog)));
  EXPECT_EQ(pruned(s).scene.media.size(), 0u);
  s.sensor.near_clip = 5;
  EXPECT_EQ(pruned(s).scene.media.size(), 1u);
  s.sensor.projection = Projection::orthographic;
  EXPECT_EQ(pruned(s).scene.media.size(), 1u);
  s.sensor.projection = Projection::spherical;  // has no near plane
  EXPECT_EQ(pruned(s).scene.media.size(), 0u);
}

TEST(PruneInteriors, StayAroundLights) {
  const std::string body = cube(kWhole + kFog);
  const auto lit = [](const char* type, double z) {
    return fmt::format(R"(<emitter type="{}">{}</emitter>)", type, at(0, 0, z));
  };
  EXPECT_EQ(media(body + R"(<emitter type="point"><point name="position" x="0" y="0" z="5.5"/></emitter>)"),
            1u);
  EXPECT_EQ(media(body + R"(<emitter type="point"><point name="position" x="0" y="0" z="3"/></emitter>)"),
            0u);
  EXPECT_EQ(media(body + lit("spot", 4.5)), 1u);
  EXPECT_EQ(media(body + lit("spot", 8)), 0u);
  EXPECT_EQ(media(body + shape("sphere", at(0, 0, 5, .5) + kGrey + kArea)), 1u);
  EXPECT_EQ(media(body + shape("rectangle", at(0, 0, 4, 3) + kGrey + kArea)), 1u);
  EXPECT_EQ(media(body + shape("rectangle", at(0, 0, 3, 3) + kGrey + kArea)), 0u);
  EXPECT_EQ(media(body + shape("sphere", at(0, 0, 0, 50) + kGrey + kArea)), 0u);  // encloses the cube
  EXPECT_EQ(media(cube(kWhole + kFog + kArea)), 1u);
  EXPECT_EQ(media(cube(kWhole + kFire)), 1u);
  EXPECT_EQ(media(body + shape("sphere", at(0, 1, 5) + kWhole + kFire)), 2u);
}

// Where two surfaces coincide, a path may pass through the one that transmits.
TEST(PruneInteriors, StayWhereASurfaceThatLightPassesTouchesTheBody) {
  const std::string body = cube(kWhole + kFog);
  EXPECT_EQ(media(body + cube(kGlassWithInterior)), 1u);
  EXPECT_EQ(media(body + shape("cube", at(2, 0, 5) + kGlassWithInterior)), 1u);
  EXPECT_EQ(media(body + shape("cube", at(2.1, 0, 5) + kGlassWithInterior)), 0u);
  EXPECT_EQ(media(body + shape("cylinder", at(0, 0, 5) + kGlassWithInterior)), 1u);
  EXPECT_EQ(media(body + shape("sphere", at(0, 0, 5, 9) + kGlassWithInterior)), 0u);  // encloses the cube
  EXPECT_EQ(media(body + shape("obj", R"(<string name="filename" value="mesh.obj"/>)" + kGlassWithInterior)),
            1u);
  EXPECT_EQ(media(body + shape("obj", R"(<string name="filename" value="mesh.obj"/>)" + kGrey)), 0u);
  EXPECT_EQ(media(body + cube(bsdf("null"))), 0u);  // prune.cpp removes this surface
  const std::string group =
      "<shape type=\"shapegroup\" id=\"g\">" + shape("disk", kGlassWithInterior) + "</shape>";
  EXPECT_EQ(media(body + group), 0u);  // has no instance
  EXPECT_EQ(media(body + group + R"(<shape type="instance"><ref id="g"/></shape>)"), 1u);
}

// If the back of a surface is black, no path leaves the surface to that side, whatever is there.
TEST(PruneInteriors, AreRemovedBehindABlackBack) {
  const std::string mesh = R"(<string name="filename" value="mesh.obj"/>)",
                    flat = R"(<boolean name="face_normals" value="true"/>)";
  const std::string glass = shape("obj", mesh + kGlassWithInterior);
  EXPECT_EQ(media(cube(kGrey + kFog) + glass), 0u);
  EXPECT_EQ(media(cube(kGrey + kFire) + cube(kGlassWithInterior)), 0u);
  EXPECT_EQ(media(shape("rectangle", kAhead + kGrey + kFog)), 0u);
  EXPECT_EQ(media(shape("rectangle", kAhead + kWhole + kFog)), 1u);
  EXPECT_EQ(media(shape("obj", mesh + flat + kGrey + kFog)), 0u);
  EXPECT_EQ(media(shape("obj", mesh + flat + kWhole + kFog)), 1u);
  EXPECT_EQ(media(shape("obj", mesh + kGrey + kFog)), 1u);  // normals in its file may swap its sides
}

// Flipped normals put the interior medium on the outside of a shape, and mirroring may put it in front.
TEST(PruneInteriors, InteriorsOfInvertedBodiesStay) {
  const std::string flip = R"(<boolean name="flip_normals" value="true"/>)";
  EXPECT_EQ(media(cube(flip + kWhole + kFog)), 1u);
  const std::string mirrored = R"(<transform name="to_world"><scale x="-1"/><translate z="5"/></transform>)";
  EXPECT_EQ(media(shape("sphere", mirrored + kWhole + kFog)), 1u);
  EXPECT_EQ(media(shape("sphere", mirrored + flip + kGrey + kFog)), 1u);
  EXPECT_EQ(media(shape("rectangle", mirrored + kGrey + kFog)), 1u);
}

TEST(PruneInteriors, InteriorsOfBodiesInGroupsStay) {
  const std::string group = "<shape type=\"shapegroup\" id=\"g\">" + cube(kWhole + kFog) + "</shape>";
  EXPECT_EQ(media(group + R"(<shape type="instance"><ref id="g"/></shape>)"), 1u);
}

// A medium without effect is kept only if it displaces other media. After these are removed, it is removed
// too.
TEST(PruneInteriors, RemovalIncludesMediaThatOnlyTheyNeed) {
  const std::string gap =
      R"(<medium type="homogeneous" name="interior"><float name="scale" value="0"/><integer name="priority" value="1"/></medium>)";
  EXPECT_EQ(media(cube(kWhole + kFog) + shape("sphere", at(9, 0, 9) + bsdf("null") + gap)), 0u);
}

// ---- phase functions

const std::string kForward = R"(<phase type="hg"><float name="g" value="0.7"/></phase>)";
std::string medium(std::string_view type, std::string_view inside) {
  return shape("sphere", kAhead + bsdf("null") +
                             fmt::format("<medium type=\"{}\" name=\"interior\">{}</medium>", type, inside));
}

TEST(PrunePhases, MediaWithoutScatteringNeedNoPhaseFunction) {
  const std::string
      black = R"(<rgb name="albedo" value="0"/>)",
      grid =
          R"(<volume type="gridvolume" name="sigma_t"><string name="filename" value="cloud.vol"/></volume>)",
      fire = R"(<float name="scale" value="0"/><rgb name="emission" value="1"/>)";
  for (const std::string& m :
       {medium("homogeneous", black + kForward), medium("heterogeneous", grid + black + kForward),
        medium("homogeneous", fire + kForward)}) {
    const Pruned p = pruned(m);
    ASSERT_EQ(p.scene.phases.size(), 1u) << m;
    EXPECT_TRUE(std::holds_alternative<IsotropicPhase>(p.scene.phases[0])) << m;
    EXPECT_FALSE(scene::needs_of(p.scene, true).anisotropic) << m;
    EXPECT_THAT(p.left_out, Contains(AllOf(Field(&scene::LeftOut::what, "phase function"),
                                           Field(&scene::LeftOut::why, "its medium scatters no light"))))
        << m;
  }
}

TEST(PrunePhases, PhaseFunctionsOfScatteringMediaStay) {
  const std::string albedo =
      R"(<volume type="gridvolume" name="albedo"><string name="filename" value="cloud.vol"/></volume>)";
  for (const std::string& m :
       {medium("homogeneous", R"(<rgb name="albedo" value="0, 0, 0.01"/>)" + kForward),
        medium("heterogeneous", R"(<float name="sigma_t" value="1"/>)" + albedo + kForward)}) {
    const Pruned p = pruned(m);
    EXPECT_TRUE(scene::needs_of(p.scene, true).anisotropic) << m;
    EXPECT_TRUE(p.left_out.empty()) << m;
  }
}

}  // namespace
}  // namespace ls

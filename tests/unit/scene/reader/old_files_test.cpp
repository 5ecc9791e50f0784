// Files of Mitsuba 0.5 and 0.6, with their names, defaults and meanings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/scene/diagnostic.h"
#include "formats/reader/upgrade.h"
#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

// Returns a scene of version 0.x of these objects and a camera. The objects begin in line 2, column 1.
std::string old(std::string_view objects) {
  return fmt::format("<scene version=\"0.6.0\">\n{}\n{}</scene>\n", objects, kSensor);
}
std::string old_with_sensor(std::string_view inside) {
  return fmt::format("<scene version=\"0.6.0\">\n<sensor type=\"perspective\">{}</sensor></scene>\n", inside);
}
std::string in_a_medium(std::string_view medium) {
  return old(fmt::format("<medium id=\"m\" {}</medium><sensor type=\"perspective\"><ref id=\"m\"/></sensor>",
                         medium));
}
const Bsdf& bsdf_of(const Scene& s, std::size_t shape) { return s.bsdfs.at(s.shapes.at(shape).bsdf.value); }
Rgb colour(const Scene& s, TextureIndex i) { return std::get<ConstantTexture>(s.textures.at(i.value)).value; }
Rgb radiance_of(const std::string& property, const char* version) {
  const Scene s = must_read(fmt::format(
      "<scene version=\"{}\"><emitter type=\"constant\">{}</emitter>{}</scene>", version, property, kSensor));
  return std::get<ConstantEmitter>(s.emitters.at(0)).radiance;
}

TEST(OldFiles, EqualTheirNewForm) {
  const Scene before = must_read(R"(<scene version="0.5.0">
    <default name="maxDepth" value="9"/>
    <integrator type="volpath"><integer name="maxDepth" value="$maxDepth"/><integer name="rrDepth" value="3"/>
      <boolean name="hideEmitters" value="true"/></integrator>
    <sensor type="thinlens">
      <string name="fovAxis" value="smaller"/><float name="fov" value="40"/><float name="apertureRadius" value="0.1"/>
      <float name="focusDistance" value="3"/><float name="nearClip" value=".5"/><float name="farClip" value="50"/>
      <transform name="toWorld"><lookAt origin="0,0,4" target="0 0 0" up="0, 1, 0"/></transform>
      <sampler type="independent"><integer name="sampleCount" value="7"/></sampler>
    </sensor>
    <texture type="bitmap" id="wood"><string name="filename" value="wood.png"/><string name="filterType" value="trilinear"/>
      <string name="wrapMode" value="mirror"/></texture>
    <bsdf type="dielectric" id="glass"><string name="intIOR" value="water"/><float name="extIOR" value="1"/></bsdf>
    <bsdf type="twosided" id="floor"><bsdf type="diffuse"><ref name="diffuseReflectance" id="wood"/></bsdf></bsdf>
    <shape type="sphere"><transform name="toWorld"><matrix value="1,0,0,1, 0,1,0,2, 0,0,1,3, 0,0,0,1"/></transform>
      <boolean name="flipNormals" value="true"/><ref id="glass"/></shape>
    <shape type="obj"><string name="filename" value="mesh.obj"/><boolean name="faceNormals" value="true"/>
      <boolean name="flipTexCoords" value="false"/><ref id="floor"/></shape>
    <emitter type="spot"><float name="cutoffAngle" value="30"/><float name="beamWidth" value="10"/>
      <transform name="toWorld"><translate y="2"/></transform><spectrum name="intensity" value="3"/></emitter>
    <emitter type="directional"><vector name="direction" x="0" y="-1" z="0"/><color name="irradiance" value="1 2 3"/></emitter>
  </scene>)");
  const Scene now = must_read(R"(<scene version="3.0.0">
    <integrator type="volpath"><integer name="max_depth" value="9"/><integer name="rr_depth" value="3"/>
      <boolean name="hide_emitters" value="true"/></integrator>
    <sensor type="thinlens">
      <string name="fov_axis" value="smaller"/><float name="fov" value="40"/><float name="aperture_radius" value="0.1"/>
      <float name="focus_distance" value="3"/><float name="near_clip" value=".5"/><float name="far_clip" value="50"/>
      <transform name="to_world"><lookat origin="0,0,4" target="0 0 0" up="0, 1, 0"/></transform>
      <sampler type="independent"><integer name="sample_count" value="7"/></sampler>
    </sensor>
    <texture type="bitmap" id="wood"><string name="filename" value="wood.png"/><string name="wrap_mode" value="mirror"/></texture>
    <bsdf type="dielectric" id="glass"><string name="int_ior" value="water"/><float name="ext_ior" value="1"/></bsdf>
    <bsdf type="twosided" id="floor"><bsdf type="diffuse"><ref name="reflectance" id="wood"/></bsdf></bsdf>
    <shape type="sphere"><transform name="to_world"><translate value="1 2 3"/></transform>
      <boolean name="flip_normals" value="true"/><ref id="glass"/></shape>
    <shape type="obj"><string name="filename" value="mesh.obj"/><boolean name="face_normals" value="true"/>
      <boolean name="flip_tex_coords" value="false"/><ref id="floor"/></shape>
    <emitter type="spot"><float name="cutoff_angle" value="30"/><float name="beam_width" value="10"/>
      <transform name="to_world"><translate y="2"/></transform><rgb name="intensity" value="3"/></emitter>
    <emitter type="directional"><vector name="direction" value="0 -1 0"/><rgb name="irradiance" value="1 2 3"/></emitter>
  </scene>)");

  EXPECT_EQ(before, now);
  EXPECT_EQ(digest_of(before), digest_of(now));
}

TEST(OldFiles, AreRecognisedByTheirVersion) {
  for (const char* version : {"0.5.0", "0.6", "1.0.0", "0"})
    EXPECT_TRUE(scene::is_old_version(version)) << version;
  for (const char* version : {"2.0.0", "3.5.2", "10.0.0", ""})
    EXPECT_FALSE(scene::is_old_version(version)) << version;
  const auto r =
      read(with_sensor("<integrator type=\"path\"><integer name=\"maxDepth\" value=\"3\"/></integrator>"));
  EXPECT_FALSE(r.scene);
  EXPECT_THAT(messages(r), HasSubstr("did you mean 'max_depth'?"));
}

TEST(OldFiles, CamelCaseNamesAreConverted) {
  EXPECT_EQ(scene::snake_case("toWorld"), "to_world");
  EXPECT_EQ(scene::snake_case("intIOR"), "int_ior");
  EXPECT_EQ(scene::snake_case("sigmaA"), "sigma_a");
  EXPECT_EQ(scene::snake_case("high_quality_edges"), "high_quality_edges");
}

TEST(OldFiles, AreUpgradedFromTheirVersion) {
  MemoryAssets assets;
  assets.files["new.xml"] =
      "<scene version=\"3.0.0\"><shape type=\"sphere\"><boolean name=\"flip_normals\" "
      "value=\"true\"/></shape></scene>";
  assets.files["old.xml"] =
      "<scene version=\"0.6.0\"><shape type=\"sphere\"><boolean name=\"flipNormals\" "
      "value=\"true\"/></shape></scene>";
  for (const char* version : {"0.6.0", "3.0.0"}) {
    const auto r = read_scene("main.xml",
                              fmt::format("<scene version=\"{}\"><include filename=\"new.xml\"/><include "
                                          "filename=\"old.xml\"/>{}</scene>",
                                          version, kSensor),
                              assets);
    ASSERT_TRUE(r.scene) << messages(r);
    EXPECT_TRUE(r.scene->shapes.at(0).flip_normals);
    EXPECT_TRUE(r.scene->shapes.at(1).flip_normals);
  }
}

TEST(OldFiles, MediumBoundaryWithoutABsdfPassesLight) {
  const std::string medium =
      "<medium type=\"homogeneous\" id=\"m\"><float name=\"sigmaT\" value=\"1\"/><float name=\"albedo\" "
      "value=\".5\"/></medium>";
  const auto r = read(
      old(medium + "<shape type=\"cube\"><ref name=\"interior\" id=\"m\"/></shape>"
                   "<shape type=\"cube\"><ref name=\"exterior\" id=\"m\"/><emitter type=\"area\"/></shape>"
                   "<shape type=\"cube\"/>"));
  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_TRUE(quiet(r)) << messages(r);
  EXPECT_TRUE(std::holds_alternative<NullBsdf>(bsdf_of(*r.scene, 0)));
  EXPECT_EQ(colour(*r.scene, std::get<DiffuseBsdf>(bsdf_of(*r.scene, 1)).reflectance), (Rgb{0, 0, 0}));
  EXPECT_EQ(colour(*r.scene, std::get<DiffuseBsdf>(bsdf_of(*r.scene, 2)).reflectance), (Rgb{.5, .5, .5}));
}

TEST(OldFiles, MetalsDefaultToCopper) {
  const auto k = [](const std::string& text) {
    return std::get<ConductorBsdf>(bsdf_of(must_read(text), 0)).k;
  };
  const std::string
      plain = "<shape type=\"cube\"><bsdf type=\"conductor\"/></shape>",
      copper =
          "<shape type=\"cube\"><bsdf type=\"conductor\"><string name=\"material\" "
          "value=\"Cu\"/></bsdf></shape>",
      given =
          "<shape type=\"cube\"><bsdf type=\"conductor\"><spectrum name=\"eta\" value=\"1\"/><spectrum "
          "name=\"k\" value=\"2\"/></bsdf></shape>";
  EXPECT_EQ(k(old(plain)), k(with_sensor(copper)));
  EXPECT_EQ(k(with_sensor(plain)), (Rgb{1, 1, 1}));
  EXPECT_EQ(k(old(given)), (Rgb{2, 2, 2}));
}

TEST(OldFiles, MediaMayUseAbsorptionAndScattering) {
  const Scene s =
      must_read(in_a_medium("type=\"homogeneous\"><rgb name=\"sigmaA\" value=\"0.5 0 0.25\"/><rgb "
                            "name=\"sigmaS\" value=\"0.5, 0, 0.75\"/><float "
                            "name=\"scale\" value=\"3\"/>"));
  const auto& m = std::get<HomogeneousMedium>(s.media.at(0));
  EXPECT_EQ(m.sigma_t, (Rgb{1, 0, 1}));
  EXPECT_EQ(m.albedo, (Rgb{.5, 0, .75}));
  EXPECT_EQ(m.scale, 3);
  const Scene t = must_read(in_a_medium(
      "type=\"homogeneous\"><rgb name=\"sigmaT\" value=\"2\"/><rgb name=\"albedo\" value=\"0.25\"/>"));
  EXPECT_EQ(std::get<HomogeneousMedium>(t.media.at(0)).albedo, (Rgb{.25, .25, .25}));
}

TEST(OldFiles, GridsAreNodesInTheBoxOfTheirFile) {
  const Scene s = must_read(in_a_medium(
      "type=\"heterogeneous\"><volume type=\"gridvolume\" name=\"density\"><string name=\"filename\" "
      "value=\"cloud.vol\"/></volume><volume type=\"constvolume\" name=\"albedo\"><spectrum name=\"value\" "
      "value=\"0.9\"/></volume><float name=\"scale\" value=\"100\"/>"));
  const auto& m = std::get<HeterogeneousMedium>(s.media.at(0));
  const auto& grid = std::get<GridVolume>(s.volumes.at(m.sigma_t.value));
  EXPECT_TRUE(grid.use_grid_bbox);
  EXPECT_TRUE(grid.node_centred);
  EXPECT_EQ(std::get<ConstVolume>(s.volumes.at(m.albedo.value)).value, (Rgb{.9, .9, .9}));
  EXPECT_EQ(m.scale, 100);
}

TEST(OldFiles, ConstantDensityIsUnbounded) {
  const Scene s = must_read(in_a_medium(
      "type=\"heterogeneous\"><volume type=\"constvolume\" name=\"density\"><float name=\"value\" "
      "value=\"2\"/></volume><volume type=\"constvolume\" name=\"albedo\"><rgb name=\"value\" value=\".1 .2 "
      ".3\"/></volume><float name=\"scale\" value=\"3\"/>"));
  const auto& m = std::get<HomogeneousMedium>(s.media.at(0));
  EXPECT_EQ(m.sigma_t, (Rgb{2, 2, 2}));
  EXPECT_EQ(m.albedo, (Rgb{.1, .2, .3}));
  EXPECT_EQ(m.scale, 3);
  EXPECT_TRUE(s.volumes.empty());
}

TEST(OldFiles, IncompleteAndContradictoryMediaAreRefused) {
  const auto said = [](const std::string& medium) {
    const auto r = read(in_a_medium(medium));
    EXPECT_FALSE(r.scene);
    return messages(r);
  };
  EXPECT_THAT(said("type=\"homogeneous\">"), HasSubstr("needs its coefficients: sigma_a and sigma_s, or"));
  EXPECT_THAT(said("type=\"homogeneous\"><rgb name=\"sigmaS\" value=\"1\"/>"),
              HasSubstr("needs sigma_a and sigma_s"));
  EXPECT_THAT(said("type=\"homogeneous\"><rgb name=\"albedo\" value=\"1\"/>"),
              HasSubstr("needs sigma_t and albedo"));
  EXPECT_THAT(
      said("type=\"homogeneous\"><rgb name=\"albedo\" value=\"1\"/><rgb name=\"sigmaS\" value=\"1\"/>"),
      HasSubstr("gives both sigma_a or sigma_s and sigma_t or albedo"));
  EXPECT_THAT(said("type=\"homogeneous\"><string name=\"material\" value=\"skin1\"/>"),
              HasSubstr("measured media are not known by name"));
  EXPECT_THAT(
      said("type=\"homogeneous\"><rgb name=\"sigmaA\" value=\"-1\"/><rgb name=\"sigmaS\" value=\"1\"/>"),
      HasSubstr("out of its range 0 <= sigma_a"));
  EXPECT_THAT(said("type=\"heterogeneous\">"), HasSubstr("needs density"));
  EXPECT_THAT(
      said(
          "type=\"heterogeneous\"><volume type=\"constvolume\" name=\"density\"/><volume type=\"gridvolume\" "
          "name=\"albedo\"><string name=\"filename\" value=\"cloud.vol\"/></volume>"),
      HasSubstr("but its albedo is a grid"));
}

TEST(OldFiles, TexturesAreScaledBeforeTheyAreMoved) {
  const auto to_uv = [](const std::string& inside) {
    const Scene s =
        must_read(old("<shape type=\"cube\"><bsdf type=\"diffuse\"><texture type=\"bitmap\" "
                      "name=\"reflectance\"><string name=\"filename\" value=\"wood.png\"/>" +
                      inside + "</texture></bsdf></shape>"));
    return std::get<BitmapTexture>(s.textures.at(0));
  };
  EXPECT_EQ(
      to_uv(
          "<float name=\"uscale\" value=\"3\"/><float name=\"voffset\" value=\".5\"/><float name=\"vscale\" "
          "value=\"2\"/>")
          .to_uv.m,
      (std::array<double, 9>{3, 0, 0, 0, 2, .5, 0, 0, 1}));
  EXPECT_EQ(to_uv("").to_uv, UvTransform());
  EXPECT_TRUE(to_uv("<float name=\"gamma\" value=\"1\"/>").raw);
  EXPECT_FALSE(to_uv("<float name=\"gamma\" value=\"-1\"/>").raw);
  EXPECT_EQ(
      to_uv("<string name=\"wrapModeU\" value=\"clamp\"/><string name=\"wrapModeV\" value=\"clamp\"/>").wrap,
      Wrap::clamp);
}

// In version 0.x a checkerboard shows the same squares as a number and as a colour. In version 3 a number
// needs another checkerboard, with the colours swapped.
TEST(OldFiles, CheckerboardsServeAsNumbersAndColours) {
  const auto objects = [](std::string_view rough, std::string_view other) {
    return fmt::format(R"(
      <texture type="checkerboard" id="inner"><float name="color0" value=".5"/><float name="color1" value=".6"/></texture>
      <texture type="checkerboard" id="checks"><float name="color0" value=".1"/><ref name="color1" id="inner"/></texture>
      {}
      <shape type="disk"><bsdf type="roughconductor"><ref name="alpha" id="{}"/><string name="material" value="Au"/></bsdf></shape>
      <shape type="disk"><bsdf type="roughdielectric"><ref name="alpha" id="{}"/></bsdf></shape>
      <shape type="disk"><bsdf type="blendbsdf"><ref name="weight" id="{}"/><bsdf type="diffuse"/><bsdf type="plastic"/></bsdf></shape>
      <shape type="disk"><bsdf type="mask"><ref name="opacity" id="{}"/>
        <bsdf type="diffuse"><ref name="reflectance" id="checks"/></bsdf></bsdf></shape>)",
                       other, rough, rough, rough, rough);
  };
  const Scene before = must_read(old(objects("checks", "")));
  const Scene now = must_read(with_sensor(objects("numbers", R"(
      <texture type="checkerboard" id="inner_numbers"><float name="color0" value=".6"/><float name="color1" value=".5"/></texture>
      <texture type="checkerboard" id="numbers"><ref name="color0" id="inner_numbers"/><float name="color1" value=".1"/></texture>)")));

  const auto board = [](const Scene& s, TextureIndex i) {
    return std::get<CheckerboardTexture>(s.textures.at(i.value));
  };
  for (const Scene* s : {&before, &now}) {
    const auto& metal = std::get<RoughConductorBsdf>(bsdf_of(*s, 0));
    const auto& mask = std::get<MaskBsdf>(bsdf_of(*s, 3));
    const auto& inside = std::get<DiffuseBsdf>(s->bsdfs.at(mask.bsdf.value));
    EXPECT_EQ(colour(*s, board(*s, metal.alpha_u).color1)[0], .1);
    EXPECT_EQ(colour(*s, board(*s, board(*s, metal.alpha_u).color0).color0)[0], .6);
    EXPECT_EQ(colour(*s, board(*s, inside.reflectance).color0)[0], .1);
    EXPECT_EQ(metal.alpha_v, metal.alpha_u);
    EXPECT_EQ(std::get<RoughDielectricBsdf>(bsdf_of(*s, 1)).alpha_u, metal.alpha_u);
    EXPECT_EQ(std::get<BlendBsdf>(bsdf_of(*s, 2)).weight, metal.alpha_u);
    EXPECT_EQ(mask.opacity, metal.alpha_u);
  }
  // The scene is written in the format of version 3, and reads back to an equal one.
  const Scene again = must_read(write_xml(before));
  EXPECT_EQ(serialize(again), serialize(before));
}

TEST(OldFiles, NormalMapsAreUnchanged) {
  const std::string map =
      "<shape type=\"disk\"><bsdf type=\"normalmap\">{}<rgb name=\"normalmap\" value=\".5 .5 1\"/><bsdf "
      "type=\"diffuse\"/></bsdf></shape>";
  const auto read_map = [](const Scene& s) { return std::get<NormalMapBsdf>(bsdf_of(s, 0)); };
  const auto plain = read_map(must_read(old(fmt::format(fmt::runtime(map), ""))));
  const auto asked = read_map(must_read(
      old(fmt::format(fmt::runtime(map), "<boolean name=\"useShadowingFunction\" value=\"true\"/>"))));
  const auto now = read_map(must_read(with_sensor(fmt::format(fmt::runtime(map), ""))));
  EXPECT_FALSE(plain.flip_invalid_normals || plain.use_shadowing_function);
  EXPECT_FALSE(asked.flip_invalid_normals);
  EXPECT_TRUE(asked.use_shadowing_function);
  EXPECT_TRUE(now.flip_invalid_normals && now.use_shadowing_function);
}

TEST(OldFiles, ImpossibleTexturesAreReportedWithTheirPlace) {
  const auto r = read(old("<texture type=\"checkerboard\"><float name=\"uscale\" value=\"big\"/></texture>"));
  EXPECT_FALSE(r.scene);
  EXPECT_EQ(r.diagnostics.at(0).place, (SourcePlace{"test.xml", 2, 58}));
  EXPECT_THAT(r.diagnostics[0].text, HasSubstr("'x' of <scale> wants a number, not \"big\""));
  EXPECT_THAT(
      messages(read(old("<texture type=\"bitmap\"><string name=\"filename\" value=\"wood.png\"/><float "
                        "name=\"gamma\" value=\"1.8\"/></texture>"))),
      HasSubstr("'gamma': only 1 is understood"));
}

TEST(OldFiles, ColoursAreLinearUnlessTheyAreSrgb) {
  const double half = 128 / 255., linear = std::pow((half + .055) / 1.055, 2.4);
  EXPECT_EQ(radiance_of("<rgb name=\"radiance\" value=\"#800080\"/>", "0.6.0"), (Rgb{half, 0, half}));
  EXPECT_EQ(radiance_of("<rgb name=\"radiance\" value=\"#800080\"/>", "3.0.0"), (Rgb{linear, 0, linear}));
  EXPECT_EQ(radiance_of("<srgb name=\"radiance\" value=\"#800080\"/>", "0.6.0"), (Rgb{linear, 0, linear}));
  EXPECT_EQ(radiance_of("<srgb name=\"radiance\" value=\"0, 1 0\"/>", "0.6.0"), (Rgb{0, 1, 0}));
  EXPECT_EQ(radiance_of("<srgb name=\"radiance\" value=\"1\"/>", "0.6.0"), (Rgb{1, 1, 1}));
  EXPECT_EQ(radiance_of("<spectrum name=\"radiance\" value=\"1 2 3\" intent=\"illuminant\"/>", "0.6.0"),
            (Rgb{1, 2, 3}));
  EXPECT_EQ(radiance_of("<color name=\"radiance\" value=\"2\"/>", "0.6.0"), (Rgb{2, 2, 2}));
  EXPECT_THAT(messages(read(
                  with_sensor("<emitter type=\"constant\"><srgb name=\"radiance\" value=\"1\"/></emitter>"))),
              HasSubstr("there is no element <srgb>; did you mean <rgb>?"));
}

TEST(OldFiles, AxesOfRotationsAreDirections) {
  const auto r = read(old(
      "<shape type=\"cube\"><transform name=\"toWorld\"><rotate y=\"2\" angle=\"90\"/></transform></shape>"));
  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_TRUE(r.diagnostics.empty()) << messages(r);
  EXPECT_EQ(r.scene->shapes.at(0).to_world.m[2], 1);
}

TEST(OldFiles, FilmsOfOtherNamesGiveSizeAndFilter) {
  const auto r = read(old_with_sensor(
      "<film type=\"ldrfilm\"><integer name=\"width\" value=\"20\"/><integer name=\"height\" value=\"10\"/>"
      "<string name=\"fileFormat\" value=\"png\"/><string name=\"pixelFormat\" value=\"rgb\"/><float "
      "name=\"gamma\" "
      "value=\"2.2\"/><boolean name=\"banner\" value=\"false\"/><rfilter name=\"rfilter\" "
      "type=\"tent\"/></film>"));
  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(r.scene->film, (FilmSettings{{20, 10}, TentFilter{1}}));
  for (const char* named : {"film \"ldrfilm\"", "'file_format'", "'pixel_format'", "'gamma'", "'banner'"})
    EXPECT_THAT(messages(r), HasSubstr(named));
  EXPECT_EQ(r.diagnostics.size(), 5u);

  EXPECT_EQ(must_read(old_with_sensor("<film type=\"mfilm\"/>")).film, (FilmSettings{{1, 1}, BoxFilter{.5}}));
  EXPECT_EQ(must_read(old_with_sensor("<film type=\"tiledhdrfilm\"/>")).film, FilmSettings());
  EXPECT_THAT(messages(read(old_with_sensor("<film type=\"specfilm\"/>"))), HasSubstr("is not supported"));
}

TEST(OldFiles, TheSensorsMediumNeedsNoName) {
  const Scene s =
      must_read(old("<medium type=\"homogeneous\" id=\"fog\"><rgb name=\"sigmaA\" value=\"1\"/><rgb "
                    "name=\"sigmaS\" value=\"1\"/></medium>"
                    "<sensor type=\"perspective\"><ref id=\"fog\"/></sensor>"));
  EXPECT_TRUE(s.sensor.medium.has_value());
}

}  // namespace
}  // namespace ls

// A Nori scene and its equivalent in Mitsuba's format read to equal scenes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "formats/reader/xml_write.h"
#include "tests/unit/scene/nori_testing.h"

namespace ls {
namespace {

// Reads a scene that causes no diagnostics. Checks that the XML written of it reads back to an equal scene.
Scene must_read_quietly(const std::string& text) {
  const ReadResult r = read(text);
  EXPECT_TRUE(quiet(r)) << messages(r);
  if (!r.scene) throw std::runtime_error(messages(r));
  const ReadResult again = read(write_xml(*r.scene));
  EXPECT_TRUE(again.scene && digest_of(*again.scene) == digest_of(*r.scene)) << write_xml(*r.scene);
  return *r.scene;
}

void expect_same(const std::string& nori, const std::string& mitsuba) {
  const Scene a = must_read_quietly(nori), b = must_read_quietly(mitsuba);
  EXPECT_EQ(serialize(a), serialize(b));
  EXPECT_EQ(digest_of(a), digest_of(b));
}

// kNoriCamera in Mitsuba's format, with its defaults written out.
const std::string kSameCamera = R"(<integrator type="path"/>
  <sensor type="perspective">
    <float name="fov" value="30"/>
    <float name="near_clip" value="0.0001"/>
    <float name="far_clip" value="10000"/>
    <transform name="to_world"><scale x="-1"/></transform>
    <sampler type="independent"><integer name="sample_count" value="1"/></sampler>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>
      <rfilter type="gaussian"><float name="stddev" value="0.5"/></rfilter></film>
  </sensor>)";

void expect_same_objects(const std::string& nori, const std::string& mitsuba) {
  expect_same(nori_scene(nori), "<scene version=\"3.0.0\">" + mitsuba + kSameCamera + "</scene>");
}

TEST(NoriScene, EqualsTheMitsubaSceneWithNorisDefaults) { expect_same_objects("", ""); }

TEST(NoriScene, MeshesMayBeCalledShapes) {
  const std::string inside =
      R"(type="sphere"><emitter type="area"><color name="radiance" value="1 1 1"/></emitter>)";
  const Scene meshes = must_read_quietly(nori_scene("<mesh " + inside + "</mesh>"));

  const Scene shapes = must_read_quietly(nori_scene("<shape " + inside + "</shape>"));

  EXPECT_EQ(digest_of(shapes), digest_of(meshes));
}

TEST(NoriScene, SceneWithEveryFeatureMatchesMitsuba) {
  const double quarter = 1 / (4 * std::numbers::pi);
  expect_same(kNoriExample, fmt::format(R"(<scene version="3.0.0">
  <integrator type="volpath_distant_mis"><string name="distance" value="equiangular"/><string name="heuristic" value="balance"/></integrator>
  <sensor type="thinlens">
    <float name="fov" value="40"/><float name="near_clip" value="0.01"/><float name="far_clip" value="1000"/>
    <float name="aperture_radius" value="0.05"/><float name="focus_distance" value="5"/>
    <transform name="to_world"><lookat origin="0 1 -5" target="0 1 0" up="0 1 0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="32"/></sampler>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/>
      <rfilter type="gaussian"><float name="stddev" value="0.4"/></rfilter></film>
  </sensor>
  <shape type="obj"><string name="filename" value="mesh.obj"/><boolean name="flat_without_normals" value="true"/>
    <transform name="to_world"><scale value="2"/><rotate y="1" angle="90"/><translate x="0.5"/></transform>
    <bsdf type="diffuse"><texture type="checkerboard" name="reflectance">
      <rgb name="color0" value="0.1 0.2 0.3"/><rgb name="color1" value="0.8 0.7 0.6"/>
      <transform name="to_uv"><matrix value="1 0 0 -0.25  0 -2 0 2  0 0 1 0  0 0 0 1"/></transform></texture></bsdf></shape>
  <shape type="obj"><string name="filename" value="mesh.obj"/><boolean name="flat_without_normals" value="true"/>
    <bsdf type="blendbsdf"><float name="weight" value="0.4"/>
      <bsdf type="roughconductor"><float name="alpha" value="0.2"/><float name="eta" value="1.5"/><float name="k" value="0"/></bsdf>
      <bsdf type="diffuse"><rgb name="reflectance" value="0.5 1 0.25"/></bsdf></bsdf></shape>
  <shape type="obj"><string name="filename" value="mesh.obj"/><boolean name="flat_without_normals" value="true"/>
    <bsdf type="blendbsdf">
      <texture type="peak" name="weight"><ref name="texture" id="wood"/></texture>
      <bsdf type="roughconductor"><float name="alpha" value="0.1"/><float name="eta" value="{}"/><float name="k" value="0"/></bsdf>
      <bsdf type="diffuse"><texture type="peak" name="reflectance"><ref name="texture" id="wood2"/><boolean name="hue" value="true"/></texture></bsdf></bsdf></shape>
  <texture type="bitmap" id="wood"><string name="filename" value="wood.png"/><boolean name="raw" value="true"/>
    <string name="wrap_mode" value="mirror"/><string name="filter_type" value="nearest"/></texture>
  <texture type="bitmap" id="wood2"><string name="filename" value="wood.png"/><boolean name="raw" value="true"/>
    <string name="wrap_mode" value="mirror"/><string name="filter_type" value="nearest"/></texture>
  <shape type="obj"><string name="filename" value="mesh.obj"/><boolean name="flat_without_normals" value="true"/>
    <bsdf type="roughconductor"><rgb name="eta" value="0.2 0.9 1.1"/><rgb name="k" value="3.9 2.5 2.1"/>
      <float name="alpha" value="0.3"/><string name="distribution" value="ggx"/></bsdf></shape>
  <shape type="sphere"><point name="center" x="1" y="2" z="3"/><float name="radius" value="0.5"/><bsdf type="null"/>
    <medium type="homogeneous" name="interior"><rgb name="sigma_t" value="0.5 0.6 0.7"/><rgb name="albedo" value="0.9 0.8 0.7"/>
      <float name="scale" value="2"/><phase type="hg"><float name="g" value="0.5"/></phase></medium></shape>
  <shape type="sphere"><bsdf type="dielectric"><float name="int_ior" value="1.33"/><float name="ext_ior" value="1"/></bsdf></shape>
  <shape type="sphere"><bsdf type="conductor"/>
    <emitter type="area"><rgb name="radiance" value="5 4 3"/><float name="cutoff_angle" value="30"/>
      <float name="beam_width" value="10"/><float name="falloff" value="4"/></emitter></shape>
  <shape type="obj"><string name="filename" value="mesh.obj"/><boolean name="flat_without_normals" value="true"/><bsdf type="diffuse"/>
    <emitter type="area"><rgb name="radiance" value="15"/></emitter></shape>
  <shape type="sphere"><bsdf type="null"/>
    <medium type="heterogeneous" name="interior">
      <volume type="gridvolume" name="sigma_t"><string name="filename" value="cloud.vol"/><boolean name="node_centred" value="true"/>
        <transform name="to_world"><scale value="2"/><translate value="-1 -1 -1"/></transform></volume>
      <float name="albedo" value="0.6"/></medium></shape>
  <emitter type="point"><point name="position" x="1" y="2" z="3"/><rgb name="intensity" value="{} {} {}"/></emitter>
  <emitter type="directional"><vector name="direction" x="0" y="-1" z="0"/><rgb name="irradiance" value="2"/>
    <float name="angular_radius" value="0.267"/></emitter>
  <emitter type="spot"><transform name="to_world"><lookat origin="0 5 0" target="0 4 0"/></transform><rgb name="intensity" value="9"/>
    <float name="cutoff_angle" value="40"/></emitter>
  <emitter type="envmap"><string name="filename" value="wood.png"/><float name="scale" value="0.5"/>
    <transform name="to_world"><matrix value="0 0 -1 1 0 0 0 1 0"/></transform></emitter>
</scene>)",
                                        1.5046 / 1.000277, 4 * quarter, 5 * quarter, 6 * quarter));
}

TEST(NoriScene, CameraWithoutItsMirrorScaleShowsTheWorldMirrored) {
  const Scene s = must_read_quietly(R"(<scene><integrator type="path"/><camera type="perspective">
    <transform name="toWorld"><lookat origin="0 0 0" target="0 0 1" up="0 1 0"/></transform></camera></scene>)");
  EXPECT_EQ(s.sensor.to_world.m[0], -1);  // +x of the world is on the right of the image, unlike in Mitsuba
  EXPECT_EQ(s.sensor.fov_axis, FovAxis::x);
  EXPECT_EQ(s.film.size, (FrameSize{1280, 720}));
}

TEST(NoriScene, DefaultSurfaceDependsOnTheOtherObjectsInAMesh) {
  expect_same_objects(
      R"(<mesh type="sphere"/><mesh type="sphere"><emitter type="area"><color name="radiance" value="1 1 1"/></emitter></mesh>)",
      R"(<shape type="sphere"/><shape type="sphere"><bsdf type="diffuse"/><emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>)");
  expect_same_objects(
      R"(<mesh type="sphere"><bsdf type="dielectric"><float name="intIOR" value="1.3"/><float name="extIOR" value="1.3"/></bsdf></mesh>)",
      R"(<shape type="sphere"><bsdf type="null"/></shape>)");
}

TEST(NoriScene, MicrofacetIsAllGlossOrAllDiffuseAtTheEndsOfItsRange) {
  expect_same_objects(
      R"(<mesh type="sphere"><bsdf type="microfacet"><color name="kd" value="0 0 0"/><float name="intIOR" value="2"/><float name="extIOR" value="1"/></bsdf></mesh>)",
      R"(<shape type="sphere"><bsdf type="roughconductor"><float name="alpha" value="0.1"/><float name="eta" value="2"/><float name="k" value="0"/></bsdf></shape>)");
  const Scene s = must_read_quietly(nori_scene(
      R"(<mesh type="sphere"><bsdf type="microfacet"><color name="kd" value="1 0.5 0"/></bsdf></mesh>)"));
  const auto& blend = std::get<BlendBsdf>(s.bsdfs[s.shapes[0].bsdf.value]);
  EXPECT_EQ(std::get<ConstantTexture>(s.textures[blend.weight.value]).value, (Rgb{1, 1, 1}));
}

TEST(NoriScene, BlendsMatchMitsuba) {
  const std::string mitsuba_parts =
      R"(<bsdf type="conductor"/><bsdf type="diffuse"><rgb name="reflectance" value="0.2 0.4 0.6"/></bsdf>)";
  const std::string nori_parts =
      R"(<bsdf name="bsdf2" type="diffuse"><color name="albedo" value="0.2 0.4 0.6"/></bsdf><bsdf name="bsdf1" type="mirror"/>)";
  const auto nori = [&](const std::string& weight) {
    return "<mesh type=\"sphere\"><bsdf type=\"blendbsdf\">" + weight + nori_parts + "</bsdf></mesh>";
  };
  const auto mitsuba = [&](const std::string& weight) {
    return "<shape type=\"sphere\"><bsdf type=\"blendbsdf\">" + weight + mitsuba_parts + "</bsdf></shape>";
  };
  expect_same_objects(nori(R"(<float name="weight" value="0.3"/>)"),
                      mitsuba(R"(<float name="weight" value="0.3"/>)"));
  expect_same_objects(nori(R"(<boolean name="fresnel" value="false"/>)"), mitsuba(""));
  expect_same_objects(
      nori(R"(<texture type="constant_color"><color name="value" value="0.1 0.2 0.3"/></texture>)"),
      mitsuba(R"(<rgb name="weight" value="0.1 0.2 0.3"/>)"));
  expect_same_objects("<mesh type=\"sphere\"><bsdf type=\"blendbsdf\"/></mesh>",
                      "<shape type=\"sphere\"><bsdf type=\"blendbsdf\"><bsdf type=\"diffuse\"/><bsdf "
                      "type=\"diffuse\"/></bsdf></shape>");
  const ReadResult r = read(nori_scene(nori(R"(<boolean name="fresnel" value="true"/>)")));
  EXPECT_FALSE(r.scene);
  EXPECT_THAT(messages(r), ::testing::HasSubstr("weight follows the angle (fresnel) is not supported"));
}

TEST(NoriScene, ReadsTheThreeNotationsOfMedia) {
  const auto same = [](const std::string& nori, const std::string& mitsuba) {
    expect_same_objects(
        fmt::format(R"(<mesh type="sphere"><medium type="homogeneous">{}</medium></mesh>)", nori),
        fmt::format(
            R"(<shape type="sphere"><bsdf type="null"/><medium type="homogeneous" name="interior">{}</medium></shape>)",
            mitsuba));
  };
  const std::string two = R"(<rgb name="sigma_t" value="2 4 1"/><rgb name="albedo" value="0.5 0.25 0"/>)";
  same(R"(<color name="sigma_a" value="1 3 1"/><color name="sigma_s" value="1 1 0"/>)", two);
  same(
      R"(<color name="absorption" value="1 3 1"/><color name="scattering" value="1 1 0"/><float name="phase_g" value="-0.3"/>)",
      two + R"(<phase type="hg"><float name="g" value="-0.3"/></phase>)");
  same(
      R"(<color name="sigma_t" value="2 4 1"/><color name="albedo" value="0.5 0.25 0"/><phase type="isotropic"/>)",
      two);
  same(
      R"(<color name="sigma_a" value="0 0 0"/><color name="emission" value="1 2 3"/>)",
      R"(<float name="sigma_t" value="0"/><float name="albedo" value="0"/><rgb name="emission" value="1 2 3"/>)");
}

TEST(NoriScene, ReadsGridsOfDensities) {
  expect_same_objects(
      R"(<mesh type="obj"><string name="filename" value="mesh.obj"/>
         <medium type="heterogeneous"><string name="filename" value="steam.vdb"/><color name="sigma_a" value="1 2 3"/>
         <color name="sigma_s" value="3 2 1"/><float name="density_scale" value="0.5"/><float name="phase_g" value="0.2"/></medium></mesh>)",
      R"(<shape type="obj"><string name="filename" value="mesh.obj"/><boolean name="flat_without_normals" value="true"/><bsdf type="null"/>
         <medium type="heterogeneous" name="interior"><volume type="gridvolume" name="sigma_t"><string name="filename" value="steam.vdb"/></volume>
         <rgb name="albedo" value="0.75 0.5 0.25"/><float name="scale" value="2"/><phase type="hg"><float name="g" value="0.2"/></phase></medium></shape>)");
  expect_same_objects(
      R"(<mesh type="sphere"><medium type="heterogeneous"><volume type="constvolume" name="sigma_t"><float name="value" value="10"/></volume>
         <volume type="constvolume" name="albedo"><float name="value" value="0.6"/></volume></medium></mesh>)",
      R"(<shape type="sphere"><bsdf type="null"/><medium type="homogeneous" name="interior"><float name="sigma_t" value="10"/>
         <float name="albedo" value="0.6"/></medium></shape>)");
}

TEST(NoriScene, TopLevelMediumFillsTheRest) {
  const Scene s = must_read_quietly(nori_scene(
      R"(<medium type="homogeneous"><color name="sigma_a" value="1 1 1"/></medium>
         <mesh type="sphere"><medium type="homogeneous"><color name="sigma_s" value="2 2 2"/></medium></mesh>)"));
  ASSERT_TRUE(s.sensor.medium && s.shapes[0].interior && s.shapes[0].exterior);
  EXPECT_EQ(*s.sensor.medium, *s.shapes[0].exterior);
  EXPECT_NE(*s.sensor.medium, *s.shapes[0].interior);
}

TEST(NoriScene, CameraCanBeInsideAMeshWithAMedium) {
  const std::string spheres = R"(
    <mesh type="sphere"><point name="center" value="9 0 0"/><medium type="homogeneous"><color name="sigma_s" value="1 1 1"/></medium></mesh>
    <mesh type="sphere"><float name="radius" value="5"/><medium type="homogeneous"><color name="sigma_s" value="2 2 2"/></medium></mesh>)";
  const auto scene = [&](const std::string& origin) {
    return fmt::format(
        R"(<scene><integrator type="vol_path_mis"><boolean name="inmedium" value="true"/></integrator>
      <camera type="perspective"><transform name="toWorld"><translate value="{}"/></transform></camera>{}</scene>)",
        origin, spheres);
  };
  const Scene s = must_read_quietly(scene("1 2 3"));
  EXPECT_EQ(s.sensor.medium, s.shapes[1].interior);
  EXPECT_THAT(messages(read(scene("0 0 50"))),
              ::testing::HasSubstr("no mesh with a medium is known to be around"));
}

TEST(NoriScene, ImagesAreUprightOnMeshesOfBothLanguages) {
  const auto scene = [](const std::string& mesh, const std::string& texture) {
    return nori_scene(fmt::format(
        R"(<mesh type="{}">{}<bsdf type="diffuse"><texture type="imagetexture" name="albedo">{}</texture></bsdf></mesh>)",
        mesh, mesh == "obj" ? R"(<string name="filename" value="mesh.obj"/>)" : "", texture));
  };
  const auto to_uv = [](const std::string& text) {
    return std::get<BitmapTexture>(must_read_quietly(text).textures[0]).to_uv.m;
  };
  using Matrix = std::array<double, 9>;
  EXPECT_EQ(to_uv(scene("obj", R"(<string name="filename" value="wood.png"/>)")),
            (Matrix{1, 0, 0, 0, 1, 0, 0, 0, 1}));
  EXPECT_EQ(to_uv(scene("sphere", R"(<string name="filename" value="wood.png"/>)")),
            (Matrix{1, 0, .5, 0, 1, 0, 0, 0, 1}));
  // Kombu's u goes to the left and its v down; v of a mesh is 1 - v in Mitsuba.
  EXPECT_EQ(
      to_uv(scene("obj", R"(<string name="fileName" value="wood.png"/><vector name="scale" value="2,4"/>)")),
      (Matrix{-.5, 0, .5, 0, -.25, .25, 0, 0, 1}));
}

TEST(NoriScene, ReadsIntegratorsByName) {
  const auto of = [](const std::string& name) {
    const ReadResult r =
        read(fmt::format(R"(<scene><integrator type="{}"/><camera type="perspective"/></scene>)", name));
    return r.scene ? fmt::format("{} {} {}", r.scene->integrator.name, r.scene->integrator.max_depth,
                                 r.diagnostics.size())
                   : messages(r);
  };
  EXPECT_EQ(of("path_mats"), "path -1 0");
  EXPECT_EQ(of("path_mis"), "path -1 0");
  EXPECT_EQ(of("direct_ems"), "path 2 0");
  EXPECT_EQ(of("vol_path_mis"), "volpath -1 0");
  EXPECT_EQ(of("vol_path_ems"), "volpath -1 0");
  EXPECT_EQ(of("volpath_distant_mis"), "volpath_distant_mis -1 0");
  EXPECT_EQ(of("whitted"), "whitted -1 0");
  EXPECT_EQ(of("photonmapper"), "path -1 1");
  EXPECT_EQ(of("progressive_photonmapper"), "path -1 1");
  EXPECT_THAT(of("normals"), ::testing::HasSubstr("it does not render light"));
  EXPECT_THAT(of("path_miss"), ::testing::HasSubstr("did you mean 'path_mis'?"));
}

TEST(NoriScene, FullDiskOfLightIsAConstantEmitter) {
  expect_same_objects(
      R"(<emitter type="distantdisk"><color name="radiance" value="5 5 5"/><float name="thetaA" value="180"/></emitter>)",
      R"(<emitter type="constant"><rgb name="radiance" value="5"/></emitter>)");
  const Scene s = must_read_quietly(nori_scene(
      R"(<emitter type="distantdisk"><color name="radiance" value="5 5 5"/><float name="thetaA" value="30"/></emitter>)"));
  const auto& sun = std::get<DirectionalEmitter>(s.emitters[0]);
  EXPECT_EQ(sun.direction, (Vec3{{0, 0, -1}}));
  // The integral of cos theta over a cap of 30 degrees is pi sin^2 (30 degrees) = pi / 4.
  EXPECT_DOUBLE_EQ(sun.irradiance[0], 5 * std::numbers::pi / 4);
}

// Some descendants of Nori write a version. Mitsuba called its sensors cameras before 0.4.
TEST(NoriScenes, AreRecognisedByTheirElements) {
  const std::string objects = R"(<mesh type="sphere"/>)" + kNoriCamera;
  const ReadResult with = read("<scene version=\"0.5.0\">" + objects + "</scene>"),
                   without = read("<scene>" + objects + "</scene>");

  ASSERT_TRUE(with.scene) << messages(with);
  ASSERT_TRUE(without.scene) << messages(without);
  EXPECT_EQ(*with.scene, *without.scene);
  EXPECT_THAT(
      messages(read(R"(<scene version="0.3.0"><shape type="sphere"/><camera type="perspective"/></scene>)")),
      ::testing::HasSubstr("there is no element <camera>"));
}

TEST(NoriScenes, FiltersThatDifferAreWarnings) {
  for (const auto& [filter, said] :
       {std::pair<std::string, std::string>{
            R"(<rfilter type="mitchell"><float name="radius" value="2"/></rfilter>)",
            "is read as \"gaussian\""},
        {R"(<rfilter type="gaussian"><float name="radius" value="3"/></rfilter>)",
         "here it always ends at four times its stddev, 2"}}) {
    const ReadResult r = read(R"(<scene><integrator type="path_mis"/><camera type="perspective">)" + filter +
                              R"(</camera><mesh type="sphere"/></scene>)");

    ASSERT_TRUE(r.scene) << messages(r);
    EXPECT_EQ(r.scene->film.filter, ReconstructionFilter(GaussianFilter{}));
    EXPECT_THAT(messages(r), ::testing::HasSubstr(said));
  }
}

}  // namespace
}  // namespace ls

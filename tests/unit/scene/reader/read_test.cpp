// The scenes that files of Mitsuba become.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/scene/schema/integrators.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

template <class T, class List>
const T& only(const List& list) {
  const T* found = nullptr;
  for (const auto& x : list)
    if (const T* t = std::get_if<T>(&x)) found = t;
  if (!found) throw std::runtime_error("none of this type");
  return *found;
}

Rgb read_colour(const Scene& s, TextureIndex i) {
  return std::get<ConstantTexture>(s.textures.at(i.value)).value;
}
const Bsdf& read_bsdf(const Scene& s, std::size_t shape) { return s.bsdfs.at(s.shapes.at(shape).bsdf.value); }
Scene with_bsdf(const std::string& bsdf) {
  return must_read(with_sensor("<shape type=\"sphere\">" + bsdf + "</shape>"));
}

TEST(Reading, ReadsTheExample) {
  const Scene s = must_read(kExample);

  EXPECT_EQ(s.integrator, (IntegratorSettings{"volpath", 12, 4, true}));
  EXPECT_EQ(s.sample_count, 16u);
  EXPECT_EQ(s.film, (FilmSettings{{32, 24}, TentFilter{1.5}}));
  EXPECT_EQ(s.sensor.fov_axis, FovAxis::smaller);
  EXPECT_EQ(s.sensor.to_world.m[11], -5);
  EXPECT_EQ(s.sensor.aperture_radius, .1);
  EXPECT_EQ(s.shapes.size(), 6u);
  EXPECT_EQ(s.emitters.size(), 4u);
  EXPECT_EQ(s.media.size(), 2u);
  const auto& fog = only<HomogeneousMedium>(s.media);
  EXPECT_EQ(fog.sigma_t, (Rgb{.5, .6, .7}));
  EXPECT_EQ(fog.albedo, (Rgb{.9, .9, .9}));
  EXPECT_EQ(std::get<HgPhase>(s.phases.at(fog.phase.value)).g, .5);
  EXPECT_EQ(s.shapes[1].interior, s.sensor.medium);
  EXPECT_EQ(s.shapes[1].exterior, s.shapes[2].interior);
  EXPECT_TRUE(s.shapes[2].is_medium_transition);
  EXPECT_EQ(std::get<SphereShape>(s.shapes[1].geometry), (SphereShape{{1, 2, 3}, .5}));
  EXPECT_EQ(only<DielectricBsdf>(s.bsdfs).int_ior, 1.5046);
  EXPECT_EQ(only<RoughPlasticBsdf>(s.bsdfs).int_ior, 1.333);
  EXPECT_EQ(only<ConductorBsdf>(s.bsdfs).eta, (Rgb{.14304, .37531, 1.442}));
  EXPECT_EQ(only<BitmapTexture>(s.textures).wrap, Wrap::mirror);
  EXPECT_EQ(only<CheckerboardTexture>(s.textures).to_uv.m,
            (std::array<double, 9>{12, 0, .5, 0, 6, 0, 0, 0, 1}));
}

// Mitsuba 3.9.1's defaults, as its plugins print them.
TEST(Reading, MissingParametersHaveMitsubasDefaults) {
  const Scene s = must_read(R"(<scene version="3.0.0"><sensor type="perspective"/>
    <medium type="homogeneous" id="a"/><medium type="heterogeneous" id="b"/>
    <shape type="sphere"><ref name="interior" id="a"/><ref name="exterior" id="b"/></shape>
    <shape type="disk"><emitter type="area"/></shape>
    <emitter type="spot"/><emitter type="point"/><emitter type="directional"/><emitter type="constant"/></scene>)");

  EXPECT_EQ(s.film, (FilmSettings{{768, 576}, GaussianFilter{.5}}));
  EXPECT_EQ(s.sample_count, 4u);
  EXPECT_EQ(s.integrator, (IntegratorSettings{"volpath", -1, 5, false}));
  EXPECT_EQ(only<HomogeneousMedium>(s.media).sigma_t, (Rgb{1, 1, 1}));
  EXPECT_EQ(only<HomogeneousMedium>(s.media).albedo, (Rgb{.75, .75, .75}));
  const auto& b = only<HeterogeneousMedium>(s.media);
  EXPECT_EQ(std::get<ConstVolume>(s.volumes.at(b.sigma_t.value)).value, (Rgb{1, 1, 1}));
  EXPECT_EQ(std::get<ConstVolume>(s.volumes.at(b.albedo.value)).value, (Rgb{.75, .75, .75}));
  EXPECT_TRUE(std::holds_alternative<IsotropicPhase>(s.phases.at(b.phase.value)));
  EXPECT_EQ(read_colour(s, std::get<DiffuseBsdf>(read_bsdf(s, 0)).reflectance), (Rgb{.5, .5, .5}));
  EXPECT_EQ(read_colour(s, std::get<DiffuseBsdf>(read_bsdf(s, 1)).reflectance), (Rgb{0, 0, 0}))
      << "black under an emitter";
  EXPECT_EQ(only<SpotEmitter>(s.emitters).cutoff_angle, 20);
  EXPECT_EQ(only<SpotEmitter>(s.emitters).beam_width, 15);
  EXPECT_EQ(only<DirectionalEmitter>(s.emitters).direction, (Vec3{0, 0, 1}));
  EXPECT_EQ(only<PointEmitter>(s.emitters).intensity, (Rgb{1, 1, 1}));
  // x_fov = 38.1848 at 4:3, printed with six digits.
  EXPECT_EQ(s.sensor.fov_axis, FovAxis::diagonal);
  const double half = std::tan(s.sensor.fov * M_PI / 360) * .8;
  EXPECT_NEAR(2 * std::atan(half) * 180 / M_PI, 38.1848, .00005);
}

TEST(Reading, BsdfDefaultsAreMitsubas) {
  const Scene rough = with_bsdf("<bsdf type=\"roughconductor\"/>");
  const auto& r = std::get<RoughConductorBsdf>(read_bsdf(rough, 0));
  EXPECT_EQ(read_colour(rough, r.alpha_u), (Rgb{.1, .1, .1}));
  EXPECT_EQ(r.distribution, Microfacet::beckmann);
  EXPECT_EQ(r.eta, (Rgb{0, 0, 0}));
  EXPECT_EQ(r.k, (Rgb{1, 1, 1}));

  const Scene glass = with_bsdf("<bsdf type=\"dielectric\"/>");
  EXPECT_EQ(std::get<DielectricBsdf>(read_bsdf(glass, 0)).int_ior, 1.5046);
  EXPECT_EQ(std::get<DielectricBsdf>(read_bsdf(glass, 0)).ext_ior, 1.000277);

  const Scene plastic = with_bsdf("<bsdf type=\"roughplastic\"/>");
  EXPECT_EQ(std::get<RoughPlasticBsdf>(read_bsdf(plastic, 0)).int_ior, 1.49);

  const Scene checks =
      with_bsdf("<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"checkerboard\"/></bsdf>");
  const auto& c = only<CheckerboardTexture>(checks.textures);
  EXPECT_EQ(read_colour(checks, c.color0), (Rgb{.4, .4, .4}));
  EXPECT_EQ(read_colour(checks, c.color1), (Rgb{.2, .2, .2}));
}

TEST(Reading, AlphaSetsBothRoughnesses) {
  const Scene s = with_bsdf("<bsdf type=\"roughconductor\"><float name=\"alpha\" value=\".3\"/></bsdf>");
  const auto& r = std::get<RoughConductorBsdf>(read_bsdf(s, 0));
  EXPECT_EQ(read_colour(s, r.alpha_u), (Rgb{.3, .3, .3}));
  EXPECT_EQ(r.alpha_u, r.alpha_v);
}

TEST(Reading, SingleBsdfInTwosidedServesBothSides) {
  const Scene s = with_bsdf("<bsdf type=\"twosided\"><bsdf type=\"diffuse\"/></bsdf>");
  const auto& two = std::get<TwoSidedBsdf>(read_bsdf(s, 0));
  EXPECT_EQ(two.front, two.back);
}

TEST(Reading, BeamWidthFollowsTheCutoff) {
  const Scene s =
      must_read(with_sensor("<emitter type=\"spot\"><float name=\"cutoff_angle\" value=\"40\"/></emitter>"));
  EXPECT_EQ(only<SpotEmitter>(s.emitters).beam_width, 30);
}

TEST(Reading, MeshesFlipTexturesAsTheirFormatsDo) {
  const Scene s = must_read(kExample);
  EXPECT_TRUE(std::get<MeshShape>(s.shapes[4].geometry).flip_tex_coords) << "obj";
  EXPECT_FALSE(std::get<MeshShape>(s.shapes[5].geometry).flip_tex_coords) << "ply";
}

TEST(Reading, EmittersFollowTheirTransform) {
  const Scene s =
      must_read(with_sensor("<emitter type=\"directional\"><transform name=\"to_world\"><rotate x=\"1\" "
                            "angle=\"90\"/><translate x=\"5\"/></transform></emitter>"
                            "<emitter type=\"point\"><transform name=\"to_world\"><scale "
                            "value=\"3\"/><translate x=\"5\"/></transform></emitter>"));
  const Vec3 d = only<DirectionalEmitter>(s.emitters).direction;
  EXPECT_EQ(d[1], -1);
  EXPECT_NEAR(d[2], 0, 1e-16) << "cos 90 degrees in double: half an ulp of pi/2";
  EXPECT_EQ(only<PointEmitter>(s.emitters).position, (Vec3{5, 0, 0}));
}

TEST(Reading, FocalLengthIsAnAngleOverTheDiagonalOf35mmFilm) {
  const Scene s = must_read(
      "<scene version=\"3.0.0\"><sensor type=\"perspective\"><string name=\"focal_length\" "
      "value=\"35mm\"/></sensor></scene>");
  EXPECT_DOUBLE_EQ(s.sensor.fov, 2 * std::atan(std::hypot(36, 24) / 70) * 180 / M_PI);
}

TEST(Reading, FocusIsAtTheFarClipUnlessGiven) {
  const Scene s = must_read(
      R"(<scene version="3.0.0"><sensor type="thinlens"><float name="aperture_radius" value="1"/><float name="far_clip" value="70"/></sensor></scene>)");
  EXPECT_EQ(s.sensor.focus_distance, 70);
}

TEST(Reading, ReferencesReachForwardsBackwardsAndInto) {
  const Scene s = must_read(with_sensor(
      "<shape type=\"cube\"><ref id=\"later\"/></shape><bsdf type=\"twosided\" id=\"later\"><bsdf "
      "type=\"diffuse\" id=\"inner\"><rgb name=\"reflectance\" value=\".1\"/></bsdf></bsdf>"
      "<alias id=\"inner\" as=\"again\"/><shape type=\"cube\"><ref id=\"again\"/></shape>"));
  const auto& two = std::get<TwoSidedBsdf>(read_bsdf(s, 0));
  EXPECT_EQ(two.front, s.shapes[1].bsdf);
  EXPECT_EQ(s.bsdfs.size(), 2u);
}

TEST(Reading, UnusedObjectsAreLeftOutAndDefinitionsMayComeInAnyOrder) {
  const std::string a = "<bsdf type=\"diffuse\" id=\"a\"><rgb name=\"reflectance\" value=\".1\"/></bsdf>",
                    b = "<bsdf type=\"null\" id=\"b\"/>";
  const std::string unused =
      "<bsdf type=\"diffuse\" id=\"c\"><texture name=\"reflectance\" type=\"bitmap\"><string "
      "name=\"filename\" value=\"wood.png\"/></texture></bsdf>";
  const std::string shapes =
      "<shape type=\"cube\"><ref id=\"a\"/></shape><shape type=\"cube\"><ref id=\"b\"/></shape>";

  const Scene one = must_read(with_sensor(a + b + shapes)),
              other = must_read(with_sensor(unused + b + shapes + a));

  EXPECT_EQ(one, other);
  EXPECT_TRUE(other.assets.empty());
  EXPECT_EQ(digest_of(one), digest_of(other));
}

TEST(Reading, DefinesOverrideDefaultsAndFirstDefaultsWin) {
  const std::string text =
      "<scene version=\"3.0.0\"><default name=\"n\" value=\"3\"/><default name=\"n\" value=\"4\"/><default "
      "name=\"nn\" value=\"77\"/>"
      "<sensor type=\"perspective\"><sampler type=\"independent\"><integer name=\"sample_count\" "
      "value=\"$n\"/></sampler>"
      "<film type=\"hdrfilm\"><integer name=\"width\" value=\"$nn\"/><integer name=\"height\" "
      "value=\"1$n\"/></film></sensor></scene>";
  EXPECT_EQ(must_read(text).sample_count, 3u);
  EXPECT_EQ(must_read(text).film.size, (FrameSize{77, 13}));
  EXPECT_EQ(must_read(text, {.defines = {{"n", "9"}}}).sample_count, 9u);
}

TEST(Reading, IncludesAddObjectsAndDefaults) {
  MemoryAssets assets;
  assets.files["parts/base.xml"] =
      "<scene version=\"3.0.0\"><include filename=\"more.xml\"/><default name=\"spp\" value=\"7\"/></scene>";
  assets.files["parts/more.xml"] = "<bsdf version=\"3.0.0\" type=\"null\" id=\"b\"/>";
  const auto r = read_scene("main.xml",
                            "<scene version=\"3.0.0\"><include filename=\"parts/base.xml\"/><shape "
                            "type=\"cube\"><ref id=\"b\"/></shape>"
                            "<sensor type=\"perspective\"><sampler type=\"independent\"><integer "
                            "name=\"sample_count\" value=\"$spp\"/></sampler></sensor></scene>",
                            assets);
  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(r.scene->sample_count, 7u);
  EXPECT_TRUE(std::holds_alternative<NullBsdf>(read_bsdf(*r.scene, 0)));
}

TEST(Reading, PathElementsAreSearchedBeforeTheScenesFolder) {
  MemoryAssets assets;
  assets.files["more/mesh.obj"] = "another";
  const auto r = read_scene(
      "main.xml",
      with_sensor(
          "<path value=\"more\"/><shape type=\"obj\"><string name=\"filename\" value=\"mesh.obj\"/></shape>"
          "<shape type=\"ply\"><string name=\"filename\" value=\"./mesh.ply\"/></shape>"),
      assets);
  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(r.scene->assets[0].name, "more/mesh.obj");
  EXPECT_EQ(r.scene->assets[0].digest, sha256("another"));
  EXPECT_EQ(r.scene->assets[1].name, "mesh.ply");
}

TEST(Reading, OldCamelCaseNamesAreUnderstood) {
  const Scene s = must_read(
      R"(<scene version="0.6.0"><integrator type="path"><integer name="maxDepth" value="9"/></integrator>
    <sensor type="perspective"><transform name="toWorld"><lookAt origin="0,0,1" target="0,0,0" up="0,1,0"/></transform>
    <sampler type="sobol"><integer name="sampleCount" value="5"/></sampler></sensor></scene>)");
  EXPECT_EQ(s.integrator.max_depth, 9);
  EXPECT_EQ(s.sample_count, 5u);
  EXPECT_EQ(s.sensor.to_world.m[11], 1);
}

TEST(Reading, ColoursComeInManyForms) {
  const auto value = [](const std::string& property) {
    const Scene s = with_bsdf("<bsdf type=\"diffuse\">" + property + "</bsdf>");
    return read_colour(s, std::get<DiffuseBsdf>(read_bsdf(s, 0)).reflectance);
  };
  EXPECT_EQ(value("<rgb name=\"reflectance\" value=\".25\"/>"), (Rgb{.25, .25, .25}));
  EXPECT_EQ(value("<rgb name=\"reflectance\" value=\" .1,.2\t.3 \"/>"), (Rgb{.1, .2, .3}));
  EXPECT_EQ(value("<float name=\"reflectance\" value=\"1e-1\"/>"), (Rgb{.1, .1, .1}));
  EXPECT_EQ(value("<spectrum name=\"reflectance\" value=\".5\"/>"), (Rgb{.5, .5, .5}));
  EXPECT_EQ(value("<color name=\"reflectance\" value=\".5, .6 .7\"/>"), (Rgb{.5, .6, .7}));
  EXPECT_EQ(
      value(
          "<spectrum name=\"reflectance\" type=\"uniform\"><float name=\"value\" value=\".3\"/></spectrum>"),
      (Rgb{.3, .3, .3}));
  EXPECT_EQ(value("<rgb name=\"reflectance\" value=\"#ff0000\"/>"), (Rgb{1, 0, 0}));
  // sRGB 0x80: ((128 / 255 + 0.055) / 1.055)^2.4
  EXPECT_DOUBLE_EQ(value("<rgb name=\"reflectance\" value=\"#800000\"/>")[0],
                   std::pow((128 / 255. + .055) / 1.055, 2.4));
}

TEST(Reading, OtherIntegratorsMapToLightshafts) {
  const auto name = [](const std::string& type) {
    return must_read(with_sensor("<integrator type=\"" + type + "\"/>")).integrator;
  };
  for (const char* type : {"volpath", "volpathmis", "volpath_simple"}) EXPECT_EQ(name(type).name, "volpath");
  // Every name of the table is accepted in a scene.
  for (const auto& row : scene::integrators()) EXPECT_EQ(name(std::string(row.name)).name, row.ours);
  EXPECT_EQ(name("path").name, "path");
  EXPECT_EQ(name("volpath_distant_mis").name, "volpath_distant_mis");
  EXPECT_EQ(name("direct").max_depth, 2);
  const auto wrapped =
      read(with_sensor("<integrator type=\"moment\"><integrator type=\"path\"><integer name=\"max_depth\" "
                       "value=\"3\"/></integrator></integrator>"));
  ASSERT_TRUE(wrapped.scene);
  EXPECT_EQ(wrapped.scene->integrator.max_depth, 3);
  EXPECT_EQ(wrapped.diagnostics.size(), 1u) << "a warning about the moments";
}

TEST(Reading, HomogeneousMediumAcceptsConstantVolumes) {
  const Scene s = must_read(with_sensor(
      "<volume type=\"constvolume\" id=\"v\"><rgb name=\"value\" value=\"1 2 3\"/></volume>"
      "<shape type=\"cube\"><bsdf type=\"null\"/><medium type=\"homogeneous\" name=\"interior\">"
      "<ref name=\"sigma_t\" id=\"v\"/><volume type=\"constvolume\" name=\"albedo\"><float name=\"value\" "
      "value=\"0.5\"/></volume></medium></shape>"));
  const auto& m = only<HomogeneousMedium>(s.media);
  EXPECT_EQ(m.sigma_t, (Rgb{1, 2, 3}));
  EXPECT_EQ(m.albedo, (Rgb{.5, .5, .5}));
  EXPECT_TRUE(s.volumes.empty());
}

TEST(Reading, UnreferencedPartsOfSensorsChangeNothing) {
  const std::string part =
      "<film type=\"hdrfilm\" id=\"f\"><integer name=\"width\" value=\"99\"/></film>"
      "<sampler type=\"stratified\" id=\"s\"><integer name=\"sample_count\" "
      "value=\"99\"/></sampler>";
  EXPECT_EQ(must_read(with_sensor(part)), must_read(with_sensor("")));
}

TEST(Reading, SensorMayBeMirrored) {
  const Scene s = must_read(
      "<scene version=\"3.0.0\"><sensor type=\"perspective\"><transform name=\"to_world\">"
      "<scale x=\"-1\"/><lookat origin=\"0,0,1\" target=\"3,1,2\" up=\"0,1,0\"/>"
      "</transform></sensor></scene>");
  EXPECT_EQ(s.sensor.to_world.m[11], 1);
}

}  // namespace
}  // namespace ls

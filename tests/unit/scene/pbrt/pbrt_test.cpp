// Translation of pbrt's directives.
#include <cmath>
#include <cstring>
#include <numbers>

#include "formats/xml/transform_element.h"
#include "tests/unit/scene/pbrt/pbrt_testing.h"

namespace ls {
namespace {

using ::testing::Test;

bool says(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

TEST(Pbrt, IsTheSameSceneAsItsTranslation) {
  const std::string pbrt = R"(
LookAt 0 0 -4  0 0 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 16 "integer yresolution" 8
Sampler "independent" "integer pixelsamples" 32
Integrator "volpath" "integer maxdepth" 7
WorldBegin
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [ 0.5 0.5 0.5 ] "rgb sigma_s" [ 1.5 1.5 1.5 ] "float g" 0.5
LightSource "infinite" "rgb L" [ 0.25 0.5 1 ]
AttributeBegin
  MediumInterface "fog" ""
  Material "interface"
  Shape "sphere" "float radius" 2
AttributeEnd
Translate 1 2 3
Material "diffuse" "rgb reflectance" [ 0.1 0.2 0.3 ]
Shape "plymesh" "string filename" "mesh.ply"
)";
  const std::string xml = R"(<scene version="3.0.0">
<integrator type="volpath"><integer name="max_depth" value="8"/></integrator>
<medium type="homogeneous" id="fog"><float name="sigma_t" value="2"/><float name="albedo" value="0.75"/>
  <phase type="hg"><float name="g" value="0.5"/></phase></medium>
<emitter type="constant"><rgb name="radiance" value="0.25 0.5 1"/></emitter>
<shape type="sphere"><float name="radius" value="2"/><bsdf type="null"/><ref name="interior" id="fog"/></shape>
<shape type="ply"><string name="filename" value="mesh.ply"/><boolean name="flat_without_normals" value="true"/><transform name="to_world"><translate x="1" y="2" z="3"/></transform>
  <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.1 0.2 0.3"/></bsdf></bsdf></shape>
<sensor type="perspective"><float name="fov" value="40"/><string name="fov_axis" value="smaller"/>
  <float name="near_clip" value="0.0001"/><float name="far_clip" value="1e7"/>
  <transform name="to_world"><scale x="-1"/><translate z="-4"/></transform>
  <sampler type="independent"><integer name="sample_count" value="32"/></sampler>
  <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="8"/></film></sensor></scene>)";

  const ReadResult one = read_pbrt(pbrt), other = read(xml);

  ASSERT_TRUE(one.scene) << messages(one);
  ASSERT_TRUE(other.scene) << messages(other);
  EXPECT_TRUE(one.diagnostics.empty()) << messages(one);
  EXPECT_EQ(one.scene->sensor, other.scene->sensor);
  EXPECT_EQ(digest_of(*one.scene), digest_of(*other.scene))
      << serialize(*one.scene) << serialize(*other.scene);
}

TEST(Pbrt, MayBeginWithAByteOrderMark) {
  KeepingAssets assets;
  const std::string mark = "\xef\xbb\xbf";
  assets.memory.files["more.pbrt"] = mark + "Shape \"sphere\"";

  const ReadResult r = read_pbrt(mark + pbrt_scene("Include \"more.pbrt\""), assets);

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(r.scene->shapes.size(), 1u);
  EXPECT_NE(messages(read_pbrt(std::string("\xff\xfe#\0", 4))).find("is text in UTF-16"), std::string::npos);
}

TEST(Pbrt, MeshesMayBePackedByGzip) {
  KeepingAssets assets;
  assets.memory.files["a.ply.gz"] = "a mesh";

  const ReadResult r = read_pbrt(pbrt_scene("Shape \"plymesh\" \"string filename\" \"a.ply.gz\""), assets);

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(r.scene->assets.at(0).name, "a.ply.gz");
}

TEST(Pbrt, RotationsMatchTheXml) {
  const Scene s = pbrt("Rotate 90 0 1 0\nScale 2 3 4\nShape \"plymesh\" \"string filename\" \"mesh.ply\"");
  const ReadResult other = read(with_sensor(
      R"(<shape type="ply"><string name="filename" value="mesh.ply"/><boolean name="flat_without_normals" value="true"/><transform name="to_world"><scale x="2" y="3" z="4"/><rotate y="1" angle="90"/></transform></shape>)"));

  ASSERT_TRUE(other.scene);
  for (std::size_t i = 0; i < 16; ++i)  // a few roundings of doubles up to 4
    EXPECT_NEAR(s.shapes.at(0).to_world.m[i], other.scene->shapes.at(0).to_world.m[i], 16 * 2.3e-16);
}

TEST(Pbrt, MatricesAreColumnMajor) {
  const Scene s = pbrt("Transform [ 1 0 0 0  0 1 0 0  0 0 1 0  5 6 7 1 ]\nShape \"sphere\"");

  EXPECT_EQ(s.shapes.at(0).to_world.m[3], 5);
  EXPECT_EQ(s.shapes.at(0).to_world.m[11], 7);
}

TEST(Pbrt, CameraLooksAlongZWithXOnTheRight) {
  const Scene s = pbrt("Shape \"sphere\"", "LookAt 1 2 3  1 2 8  0 1 0\nCamera \"perspective\"");

  const Transform want{{-1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1}};
  EXPECT_EQ(s.sensor.to_world, want);
  EXPECT_EQ(s.sensor.fov_axis, FovAxis::smaller);
  EXPECT_EQ(s.sensor.fov, 90);
}

TEST(Pbrt, ScaleBeforeTheCameraMirrorsIt) {
  const Scene s = pbrt("Shape \"sphere\"", "Scale -1 1 1\nCamera \"perspective\"");

  EXPECT_EQ(s.sensor.to_world, Transform{});
}

TEST(Pbrt, LensesScaleWithTheCamera) {
  const Scene s =
      pbrt("Shape \"sphere\"",
           "Scale 0.5 0.5 0.5\nCamera \"perspective\" \"float lensradius\" 0.25 \"float focaldistance\" 3");

  EXPECT_DOUBLE_EQ(s.sensor.aperture_radius, .5);
  EXPECT_DOUBLE_EQ(s.sensor.focus_distance, 6);
}

TEST(Pbrt, OrthographicShorterSideIsTwoUnits) {
  const Scene s = [] {
    const ReadResult r = read_pbrt(
        "Camera \"orthographic\" Film \"rgb\" \"integer xresolution\" 30 \"integer yresolution\" "
        "10\nWorldBegin\n"
        "Shape \"sphere\"");
    EXPECT_TRUE(r.scene) << messages(r);
    return r.scene.value_or(Scene{});
  }();

  EXPECT_EQ(s.sensor.projection, Projection::orthographic);
  EXPECT_EQ(s.sensor.to_world.m[0], -3);
  EXPECT_EQ(s.sensor.to_world.m[5], 3);
}

TEST(Pbrt, CropsRoundUp) {
  const ReadResult r = read_pbrt(
      R"(Film "rgb" "integer xresolution" 10 "integer yresolution" 10 "float cropwindow" [ 0.11 0.5 0.3 1 ]
Camera "perspective" WorldBegin Shape "sphere")");

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(r.scene->film.crop_offset, (std::array<int, 2>{2, 3}));
  EXPECT_EQ(r.scene->film.crop_size, (FrameSize{3, 7}));
}

TEST(Pbrt, ExposureMultipliesAllLight) {
  const ReadResult r = read_pbrt(
      R"(Film "rgb" "float iso" 200 "float exposuretime" 3
Camera "perspective" WorldBegin
LightSource "infinite" "rgb L" [ 1 2 4 ] "float scale" 0.5
AreaLightSource "diffuse" "rgb L" [ 1 1 1 ] Shape "sphere")");

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(std::get<ConstantEmitter>(r.scene->emitters.at(0)).radiance, (Rgb{3, 6, 12}));
  const auto& area = r.scene->shapes.at(0).emitter;
  ASSERT_TRUE(area);
  EXPECT_EQ(std::get<ConstantTexture>(r.scene->textures.at(area->radiance.value)).value, (Rgb{6, 6, 6}));
}

// A source that keeps no files (the coordinator's) has no need of one.
TEST(Pbrt, CloudNeedsNoFile) {
  const std::string scene = pbrt_scene(
      R"(MakeNamedMedium "c" "string type" "cloud" MediumInterface "c" "" Material "interface" Shape "sphere")");
  MemoryAssets nothing;

  const ReadResult r = read_scene("t.pbrt", scene, nothing);

  EXPECT_TRUE(r.scene) << messages(r);
}

// pbrt multiplies light by the time for which the shutter is open, here 1/2.
TEST(Pbrt, ShorterShutterDarkensAllLight) {
  const ReadResult r = read_pbrt(
      R"(Camera "perspective" "float shutteropen" 0.25 "float shutterclose" 0.75 Film "rgb" "float iso" 400
WorldBegin
MakeNamedMedium "glow" "string type" "homogeneous" "rgb Le" [ 1 2 4 ] "rgb sigma_a" [ 1 1 1 ] "rgb sigma_s" [ 0 0 0 ]
LightSource "infinite" "rgb L" [ 1 2 4 ] MediumInterface "glow" "" Material "interface" Shape "sphere")");

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(std::get<ConstantEmitter>(r.scene->emitters.at(0)).radiance, (Rgb{2, 4, 8}));
  const auto& medium = std::get<HomogeneousMedium>(r.scene->media.at(0));
  EXPECT_EQ(medium.source_radiance, (Rgb{2, 4, 8}));
}

TEST(Pbrt, ExposureAppliesOnlyToLaterLights) {
  const std::string medium = R"(MakeNamedMedium "glow" "string type" "homogeneous" "rgb Le" [ 1 2 4 ] )",
                    camera = R"(Camera "perspective" "float shutterclose" 0.5 )";

  const ReadResult late = read_pbrt(medium + camera + "WorldBegin Shape \"sphere\"");
  EXPECT_FALSE(late.scene);
  EXPECT_TRUE(says(messages(late), "Camera changes the exposure of media that stand before it"));
  EXPECT_TRUE(read_pbrt(camera + medium + "WorldBegin Shape \"sphere\"").scene);
}

TEST(Pbrt, ShutterThatNeverOpensIsRefused) {
  const ReadResult r =
      read_pbrt("Camera \"perspective\" \"float shutteropen\" 1 WorldBegin Shape \"sphere\"");

  EXPECT_FALSE(r.scene);
  EXPECT_TRUE(says(messages(r), "the shutter closes at 1 and opens at 1"));
}

TEST(Pbrt, BlackBodiesHaveLuminanceOne) {
  const Scene s = pbrt("LightSource \"infinite\" \"blackbody L\" 3000 Shape \"sphere\"");

  const Rgb c = std::get<ConstantEmitter>(s.emitters.at(0)).radiance;
  // The luminance weights of ITU-R BT.709 differ from those of the observer's table by less than 1e-4.
  EXPECT_NEAR(.2126 * c[0] + .7152 * c[1] + .0722 * c[2], 1, 1e-4 * (c[0] + c[1] + c[2]));
  EXPECT_GT(c[0], c[1]);
  EXPECT_GT(c[1], c[2]);
}

TEST(Pbrt, PowerOfAPointIsFourPiTimesItsIntensity) {
  const Scene s = pbrt(
      "Translate 0 0 1\nLightSource \"point\" \"point3 from\" [ 1 2 3 ] \"float power\" 8 Shape \"sphere\"");

  const auto& point = std::get<PointEmitter>(s.emitters.at(0));
  EXPECT_EQ(point.position, (Vec3{{1, 2, 4}}));
  EXPECT_DOUBLE_EQ(point.intensity[0], 8 / (4 * std::numbers::pi));
}

// The radiance is power / (pi area). The area is that of a quadric in its own space, or that of one triangle
// of a mesh in the world.
TEST(Pbrt, PowerOfAnAreaIsSpreadOverIt) {
  const auto radiance = [](std::string_view world) {
    KeepingAssets assets;
    const ReadResult r = read_scene(
        "t.pbrt",
        pbrt_scene(fmt::format(
            "AreaLightSource \"diffuse\" \"rgb L\" [ 1 2 4 ] \"float power\" 8 Scale 3 3 3 {}", world)),
        assets);
    EXPECT_TRUE(r.scene) << messages(r);
    if (!r.scene) return Rgb{};
    const auto& light = r.scene->shapes.at(0).emitter;
    return std::get<ConstantTexture>(r.scene->textures.at(light->radiance.value)).value;
  };
  const auto expect = [](const Rgb& got, double area) {
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(got[i] * area, (1 << i) * 8 / std::numbers::pi, 1e-5) << area;
  };
  expect(radiance("Shape \"sphere\" \"float radius\" 2"), 16 * std::numbers::pi);
  expect(radiance("Shape \"disk\" \"float radius\" 2"), 4 * std::numbers::pi);
  expect(radiance("Shape \"cylinder\" \"float radius\" 2 \"float zmax\" 0"), 4 * std::numbers::pi);
  expect(radiance(
             "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ] \"integer indices\" [ 0 1 2 2 "
             "1 3 ]"),
         4.5);
  expect(radiance("Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ]"), 9);
}

TEST(Pbrt, SquareMapsKeepTheirAxes) {
  const ReadResult r = read_pbrt(
      R"(Film "rgb" "float iso" 200 Camera "perspective" WorldBegin
Rotate 90 1 0 0 LightSource "infinite" "string filename" "wood.png" "float scale" 3 Shape "sphere")");

  ASSERT_TRUE(r.scene) << messages(r);
  const auto& map = std::get<EnvmapEmitter>(r.scene->emitters.at(0));
  EXPECT_EQ(map.mapping, SkyMapping::equal_area);
  EXPECT_EQ(map.scale, 6);
  EXPECT_NEAR(map.to_world.m[6], -1, 1e-15) << "its +z, the image's centre, becomes -y";
  EXPECT_NEAR(map.to_world.m[0], 1, 1e-15);
}

TEST(Pbrt, LatitudeMapsHaveTheirTopAtZ) {
  const Scene s =
      pbrt("LightSource \"infinite\" \"string mapname\" \"wood.png\" \"rgb L\" [ 2 2 2 ] Shape \"sphere\"");

  const auto& map = std::get<EnvmapEmitter>(s.emitters.at(0));
  EXPECT_EQ(map.mapping, SkyMapping::latlong);
  EXPECT_EQ(map.scale, 2);
  EXPECT_EQ(map.to_world.m[9], 1) << "its +y becomes +z";
}

TEST(Pbrt, PortalIsAWarningAndTheWholeMapIsUsed) {
  const std::string corners = R"( "point3 portal" [ 0 0 0  1 0 0  1 1 0  0 1 0 ])";
  for (const std::string light : {R"(LightSource "infinite" "string filename" "wood.png")",
                                  R"(LightSource "infinite" "rgb L" [ 1 2 3 ])"}) {
    const ReadResult with = read_pbrt(pbrt_scene(light + corners + "\nShape \"sphere\"")),
                     without = read_pbrt(pbrt_scene(light + "\nShape \"sphere\""));

    ASSERT_TRUE(with.scene && without.scene) << messages(with) << messages(without);
    EXPECT_TRUE(without.diagnostics.empty()) << messages(without);
    EXPECT_EQ(digest_of(*with.scene), digest_of(*without.scene));
    ASSERT_EQ(with.diagnostics.size(), 1) << messages(with);
    EXPECT_TRUE(says(messages(with),
                     "warning: 'portal' of LightSource \"infinite\" is ignored: pbrt shows the light only "
                     "through the portal, here it comes "
                     "from all directions. Both are the same in a closed room whose only "
                     "opening is the portal"))
        << messages(with);
  }
}

TEST(Pbrt, ProjectionsHaveEqualIntensityAtAllAngles) {
  const Scene s = pbrt(
      "Translate 1 2 3 Scale 2 2 2 LightSource \"projection\" \"string filename\" \"wood.png\" \"float fov\" "
      "40 "
      "\"float scale\" 5 Shape \"sphere\"");

  const auto& light = std::get<ProjectorEmitter>(s.emitters.at(0));
  EXPECT_TRUE(light.as_intensity);
  EXPECT_EQ(light.scale, 5);
  EXPECT_EQ(light.fov, 40);
  EXPECT_EQ(light.fov_axis, FovAxis::smaller);
  const std::array<double, 16> want{-1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1};
  for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(light.to_world.m[i], want[i], 1e-15) << i;
  const auto& image = std::get<BitmapTexture>(s.textures.at(light.irradiance.value));
  EXPECT_EQ(image.filter, TextureFilter::nearest);
}

TEST(Pbrt, EquivalentIntegratorsAreRead) {
  for (const std::string_view type : {"simplepath", "simplevolpath", "bdpt", "lightpath", "mlt", "sppm"}) {
    const ReadResult r = read_pbrt(
        pbrt_scene("Shape \"sphere\"",
                   fmt::format(R"(Camera "perspective" Integrator "{}" "integer maxdepth" 7)", type)));
    ASSERT_TRUE(r.scene) << messages(r);
    EXPECT_EQ(r.scene->integrator.name, "volpath");
    EXPECT_EQ(r.scene->integrator.max_depth, 8);
    EXPECT_NE(messages(r).find(fmt::format("Integrator \"{}\" is read as \"volpath\"", type)),
              std::string::npos);
    EXPECT_EQ(messages(r).find("from the light and") != std::string::npos, type == "sppm");
  }
}

// pbrt ignores power and illuminance unless they are above 0. Exporters write 0 or -1 for "not given".
TEST(Pbrt, PowerAndIlluminanceOfZeroOrLessAreNotGiven) {
  const Scene s = pbrt(R"(LightSource "point" "rgb I" [ 1 2 3 ] "float power" 0
LightSource "distant" "rgb L" [ 1 2 3 ] "float illuminance" -1
LightSource "infinite" "rgb L" [ 1 2 3 ] "float illuminance" -1 Shape "sphere")");

  EXPECT_EQ(std::get<PointEmitter>(s.emitters.at(0)).intensity, (Rgb{1, 2, 3}));
  EXPECT_EQ(std::get<DirectionalEmitter>(s.emitters.at(1)).irradiance, (Rgb{1, 2, 3}));
  EXPECT_EQ(std::get<ConstantEmitter>(s.emitters.at(2)).radiance, (Rgb{1, 2, 3}));
}

TEST(Pbrt, WarnsWhereTexturesAndAlphaDifferFromPbrt) {
  const std::string pattern =
      R"(Texture "t" "spectrum" "checkerboard" Material "diffuse" "texture reflectance" "t")";

  const auto told = [](const std::string& world) { return messages(read_pbrt(pbrt_scene(world))); };

  EXPECT_TRUE(says(told(pattern + " Shape \"disk\""), "lies otherwise on a disk"));
  EXPECT_FALSE(says(told("Shape \"disk\""), "lies otherwise"));
  EXPECT_TRUE(
      says(told(R"(AreaLightSource "diffuse" Shape "sphere" "float alpha" 0)"), "does not mask its light"));
}

TEST(Pbrt, InterfaceMaterialsEmitNoLight) {
  const std::string lamp = "AreaLightSource \"diffuse\" Shape \"sphere\" ";
  EXPECT_TRUE(pbrt(lamp).shapes.at(0).emitter);

  const ReadResult r = read_pbrt(pbrt_scene("Material \"interface\" " + lamp));

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_FALSE(r.scene->shapes.at(0).emitter);
  EXPECT_TRUE(says(messages(r), "give no light"));
}

// In pbrt `encoding` applies to PNG files only.
TEST(Pbrt, EncodingAppliesOnlyToPng) {
  const auto is_raw = [](std::string_view file) {
    KeepingAssets assets;
    assets.memory.files[std::string(file)] = "pixels";
    const ReadResult r =
        read_pbrt(pbrt_scene(fmt::format(R"(Texture "t" "spectrum" "imagemap" "string filename" "{}"
"string encoding" "linear" Material "diffuse" "texture reflectance" "t" Shape "sphere")",
                                         file)),
                  assets);
    EXPECT_TRUE(r.scene) << messages(r);
    if (!r.scene) return false;
    const auto& all = r.scene->textures;
    const auto found = std::find_if(
        all.begin(), all.end(), [](const Texture& t) { return std::holds_alternative<BitmapTexture>(t); });
    return found != all.end() && std::get<BitmapTexture>(*found).raw;
  };

  EXPECT_TRUE(is_raw("wood.png"));
  EXPECT_FALSE(is_raw("wood.jpg"));
}

// A sphere with a texture is mirrored to get pbrt's uv. This must not exchange its media.
TEST(Pbrt, SphereWithATextureKeepsItsMedia) {
  for (const std::string_view reversed : {"", "ReverseOrientation "}) {
    const auto media = [&](std::string_view alpha) {
      const Scene s = pbrt(fmt::format(
          R"(MakeNamedMedium "fog" "string type" "homogeneous" {}MediumInterface "fog" "" Material "dielectric"
Shape "sphere" {})",
          reversed, alpha));
      const Shape& shape = s.shapes.at(0);
      // In the renderer flip_normals exchanges interior and exterior, except on a mirrored sphere.
      const bool mirrored = scene::determinant3(shape.to_world) < 0;
      const bool swapped = !mirrored && shape.flip_normals;
      return std::pair{(swapped ? shape.exterior : shape.interior).has_value(),
                       (swapped ? shape.interior : shape.exterior).has_value()};
    };
    EXPECT_EQ(media(R"("float alpha" 1)"), media("")) << reversed;
    EXPECT_NE(media("").first, media("").second);
  }
}

TEST(Pbrt, DistantLightTravelsFromItsFirstPoint) {
  const Scene s = pbrt(
      "LightSource \"distant\" \"point3 from\" [ 0 5 0 ] \"point3 to\" [ 0 0 0 ] \"rgb L\" [ 2 2 2 ] Shape "
      "\"sphere\"");

  const auto& light = std::get<DirectionalEmitter>(s.emitters.at(0));
  EXPECT_LT(light.direction[1], 0);
  EXPECT_EQ(light.irradiance, (Rgb{2, 2, 2}));
}

TEST(Pbrt, SpotsAimAtTheirTarget) {
  const Scene s = pbrt(
      "LightSource \"spot\" \"point3 from\" [ 1 5 0 ] \"point3 to\" [ 1 0 0 ] \"float conedeltaangle\" 0 "
      "Shape \"sphere\"");

  const auto& spot = std::get<SpotEmitter>(s.emitters.at(0));
  EXPECT_EQ(spot.cutoff_angle, 30);
  EXPECT_EQ(spot.beam_width, 30);
  EXPECT_NEAR(spot.to_world.m[6], -1, 1e-12);  // its +z points down
  EXPECT_NEAR(spot.to_world.m[7], 5, 1e-12);
}

TEST(Pbrt, GoniometricLightsHaveTheirYAxisInTheMiddleOfTheImage) {
  const Scene s = pbrt(
      "Translate 1 2 3\nLightSource \"goniometric\" \"string filename\" \"wood.png\" \"rgb I\" [ 1 2 3 ] "
      "\"float scale\" 2 Shape \"sphere\"");

  const auto& light = std::get<GoniometricEmitter>(s.emitters.at(0));
  EXPECT_EQ(light.intensity, (Rgb{2, 4, 6}));
  const auto& m = light.to_world.m;
  EXPECT_EQ((Vec3{m[2], m[6], m[10]}), (Vec3{0, 1, 0})) << "where +z goes";
  EXPECT_EQ((Vec3{m[1], m[5], m[9]}), (Vec3{0, 0, 1}));
  EXPECT_EQ((Vec3{m[3], m[7], m[11]}), (Vec3{1, 2, 3}));
  const auto& image = std::get<BitmapTexture>(s.textures.at(light.texture.value));
  EXPECT_EQ(image.filter, TextureFilter::nearest);
  EXPECT_EQ(image.wrap, Wrap::clamp);
}

TEST(Pbrt, LeavesReflectAndTransmit) {
  const Scene s = pbrt(R"(Texture "t" "spectrum" "imagemap" "string filename" "wood.png"
Material "diffusetransmission" Shape "sphere"
Material "diffusetransmission" "rgb reflectance" [ 0.1 0.2 0.3 ] "rgb transmittance" [ 0.4 0.3 0.2 ] "float scale" 2 Shape "sphere"
Material "diffusetransmission" "texture transmittance" "t" "float scale" 0.5 Shape "sphere")");

  const auto leaf = [&](std::size_t shape) {
    return std::get<DiffuseTransmissionBsdf>(s.bsdfs.at(s.shapes.at(shape).bsdf.value));
  };
  const auto of = [&](TextureIndex t) { return std::get<ConstantTexture>(s.textures.at(t.value)).value; };
  EXPECT_EQ(of(leaf(0).reflectance), (Rgb{.25, .25, .25}));
  EXPECT_EQ(of(leaf(0).transmittance), (Rgb{.25, .25, .25}));
  EXPECT_EQ(of(leaf(1).reflectance), (Rgb{.2, .4, .6}));
  EXPECT_EQ(of(leaf(1).transmittance), (Rgb{.8, .6, .4}));
  EXPECT_EQ(of(leaf(2).reflectance), (Rgb{.125, .125, .125}));
  const auto& product = std::get<ProductTexture>(s.textures.at(leaf(2).transmittance.value));
  EXPECT_EQ(of(product.first), (Rgb{.5, .5, .5}));
  EXPECT_TRUE(std::holds_alternative<BitmapTexture>(s.textures.at(product.second.value)));
}

TEST(Pbrt, RoughnessIsRemappedByItsRoot) {
  const Scene s = pbrt(R"(
Material "conductor" "float roughness" 0.25 "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" Shape "sphere"
Material "dielectric" "float roughness" 0.25 "bool remaproughness" false Shape "sphere"
Material "conductor" Shape "sphere")");

  const auto of = [&](TextureIndex t) { return std::get<ConstantTexture>(s.textures.at(t.value)).value[0]; };
  const auto& gold = std::get<RoughConductorBsdf>(
      s.bsdfs.at(std::get<TwoSidedBsdf>(s.bsdfs.at(s.shapes.at(0).bsdf.value)).front.value));
  EXPECT_EQ(of(gold.alpha_u), .5);
  EXPECT_EQ(gold.distribution, Microfacet::ggx);
  EXPECT_EQ(gold.eta[0], .14304);
  const auto& glass = std::get<RoughDielectricBsdf>(s.bsdfs.at(s.shapes.at(1).bsdf.value));
  EXPECT_EQ(of(glass.alpha_u), .25);
  EXPECT_EQ(glass.int_ior, 1.5);
  EXPECT_EQ(glass.ext_ior, 1);
  const auto& copper = std::get<ConductorBsdf>(
      s.bsdfs.at(std::get<TwoSidedBsdf>(s.bsdfs.at(s.shapes.at(2).bsdf.value)).front.value));
  EXPECT_EQ(copper.eta[0], .20101);
}

// The reflectance at normal incidence for eta = 1 and k is k^2 / (4 + k^2).
TEST(Pbrt, ReflectanceOfAConductorIsAtNormalIncidence) {
  const Scene s = pbrt("Material \"conductor\" \"rgb reflectance\" [ 0.2 0.5 0.8 ] Shape \"sphere\"");

  const auto& metal = std::get<ConductorBsdf>(
      s.bsdfs.at(std::get<TwoSidedBsdf>(s.bsdfs.at(s.shapes.at(0).bsdf.value)).front.value));
  const Rgb want{.2, .5, .8};
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(metal.k[i] * metal.k[i] / (4 + metal.k[i] * metal.k[i]), want[i], 1e-12);
}

const CoatedConductorBsdf& coated(const Scene& s, std::size_t shape) {
  return std::get<CoatedConductorBsdf>(
      s.bsdfs.at(std::get<TwoSidedBsdf>(s.bsdfs.at(s.shapes.at(shape).bsdf.value)).front.value));
}

TEST(Pbrt, CoatedConductorsHaveACoatAndAMetal) {
  const Scene s = pbrt(R"(
Material "coatedconductor" Shape "sphere"
Material "coatedconductor" "float interface.eta" 1.3 "float interface.roughness" 0.04 "spectrum conductor.eta" "metal-Au-eta"
  "spectrum conductor.k" "metal-Au-k" "float conductor.uroughness" 0.25 "float conductor.vroughness" 0.01 "float thickness" 2
  "integer maxdepth" 5 "integer nsamples" 2 "float g" 0.3 Shape "sphere"
Material "coatedconductor" "bool remaproughness" false "float interface.roughness" 0.25 "float conductor.roughness" 0.125
  "rgb reflectance" [ 0.2 0.5 0.8 ] Shape "sphere"
Material "coatedconductor" "spectrum interface.eta" "glass-BK7" Shape "sphere")");

  const CoatedConductorBsdf& plain = coated(s, 0);
  EXPECT_EQ(plain.int_ior, 1.5);
  EXPECT_EQ(plain.ext_ior, 1);
  EXPECT_EQ(plain.coat_alpha, 0);
  EXPECT_EQ(plain.alpha_u, 0);
  EXPECT_EQ(plain.alpha_v, 0);
  EXPECT_EQ(plain.eta[0], .20101) << "copper";
  const CoatedConductorBsdf& gold = coated(s, 1);
  EXPECT_EQ(gold.int_ior, 1.3);
  EXPECT_EQ(gold.coat_alpha, .2);
  EXPECT_EQ(gold.alpha_u, .5);
  EXPECT_EQ(gold.alpha_v, .1);
  EXPECT_EQ(gold.eta[0], .14304);
  const CoatedConductorBsdf& given = coated(s, 2);
  EXPECT_EQ(given.coat_alpha, .25);
  EXPECT_EQ(given.alpha_u, .125);
  EXPECT_EQ(given.alpha_v, .125);
  const Rgb want{.2, .5, .8};
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(given.k[i] * given.k[i] / (4 + given.k[i] * given.k[i]), want[i], 1e-12);
  EXPECT_EQ(given.eta, (Rgb{1, 1, 1}));
  EXPECT_EQ(coated(s, 3).int_ior, 1.5168);
}

TEST(Pbrt, OnlyRoughCoatedConductorsWarnOfTheirModel) {
  const auto said = [](const std::string& parameters) {
    return messages(
        read_pbrt(pbrt_scene("Material \"coatedconductor\" " + parameters + " Shape \"sphere\"")));
  };
  EXPECT_EQ(said(""), "");
  EXPECT_EQ(said("\"float interface.roughness\" 0.0000001"), "") << "alpha is below 0.001";
  for (const char* rough : {"\"float interface.roughness\" 0.1", "\"float conductor.roughness\" 0.1",
                            "\"float conductor.vroughness\" 0.1"})
    EXPECT_TRUE(says(said(rough), "warning: a rough \"coatedconductor\" is approximated")) << rough;
}

TEST(Pbrt, TwoSidedLightsHalveTheirPower) {
  const Scene s = pbrt(R"(
AreaLightSource "diffuse" "rgb L" [ 1 1 1 ] "bool twosided" true Shape "disk"
AreaLightSource "diffuse" "rgb L" [ 1 1 1 ] Shape "disk"
AreaLightSource "diffuse" "float power" 12 "bool twosided" true Shape "disk" "float radius" 2
Scale -1 1 1 Shape "sphere")");

  const auto value = [&](std::size_t i) {
    return std::get<ConstantTexture>(s.textures.at(s.shapes.at(i).emitter->radiance.value)).value[1];
  };
  EXPECT_TRUE(s.shapes.at(0).emitter->two_sided);
  EXPECT_FALSE(s.shapes.at(1).emitter->two_sided);
  EXPECT_TRUE(s.shapes.at(2).emitter->two_sided);
  EXPECT_EQ(value(0), value(1));
  // Radiance is power / (pi area) / 2 for a disk of the area 4 pi that emits white of luminance 1 on both
  // sides.
  EXPECT_NEAR(value(2), 12 / (8 * std::numbers::pi * std::numbers::pi), 1e-5);
  EXPECT_TRUE(s.shapes.at(3).emitter->two_sided) << "a mirrored one is read, as its sides do not matter";
}

TEST(Pbrt, MixAmountWeighsTheSecondMaterial) {
  const Scene s = pbrt(R"(MakeNamedMaterial "a" "string type" "diffuse"
MakeNamedMaterial "b" "string type" "conductor"
Material "mix" "string materials" [ "a" "b" ] "float amount" 0.25 Shape "sphere")");

  const auto& blend = std::get<BlendBsdf>(s.bsdfs.at(s.shapes.at(0).bsdf.value));
  EXPECT_EQ(std::get<ConstantTexture>(s.textures.at(blend.weight.value)).value[0], .25);
}

TEST(Pbrt, ImagesAreUpright) {
  const Scene s = pbrt(R"(Texture "t" "spectrum" "imagemap" "string filename" "wood.png" "float uscale" 2
Material "diffuse" "texture reflectance" "t" Shape "sphere")");

  const auto found = std::find_if(s.textures.begin(), s.textures.end(),
                                  [](const Texture& t) { return std::holds_alternative<BitmapTexture>(t); });
  ASSERT_NE(found, s.textures.end());
  const UvTransform want{{2, 0, 0, 0, -1, 1, 0, 0, 1}};
  EXPECT_EQ(std::get<BitmapTexture>(*found).to_uv, want);
  EXPECT_FALSE(std::get<BitmapTexture>(*found).raw);
}

// At the north pole of a sphere, +z, v is 1 in pbrt and 0 in Mitsuba's format. The reader mirrors the sphere
// along z.
TEST(Pbrt, ImagesAreUprightOnSpheres) {
  const std::string image = R"(Texture "t" "spectrum" "imagemap" "string filename" "wood.png"
Material "diffuse" "texture reflectance" "t" Scale 2 2 2 Shape "sphere" ReverseOrientation Shape "sphere"
MakeNamedMaterial "image" "string type" "diffuse" "texture reflectance" "t"
MakeNamedMaterial "grey" "string type" "diffuse"
Material "mix" "string materials" [ "grey" "image" ] Shape "sphere" NamedMaterial "grey" Shape "sphere")";

  const Scene s = pbrt(image);

  const Transform mirrored{{2, 0, 0, 0, 0, 2, 0, 0, 0, 0, -2, 0, 0, 0, 0, 1}};
  EXPECT_EQ(s.shapes.at(0).to_world, mirrored);
  EXPECT_TRUE(s.shapes.at(0).flip_normals);  // since its to_world mirrors it
  EXPECT_EQ(s.shapes.at(1).to_world, mirrored);
  EXPECT_FALSE(s.shapes.at(1).flip_normals);
  EXPECT_EQ(s.shapes.at(2).to_world, mirrored);
  EXPECT_EQ(s.shapes.at(3).to_world.m[10], 2);
  EXPECT_TRUE(s.shapes.at(3).flip_normals);  // by ReverseOrientation
}

TEST(Pbrt, NamedObjectsAreInstanced) {
  const Scene s = pbrt(R"(ObjectBegin "ball" Translate 1 0 0 Shape "sphere" ObjectEnd
Translate 0 5 0 ObjectInstance "ball" ObjectInstance "ball")");

  ASSERT_EQ(s.instances.size(), 2u);
  EXPECT_EQ(s.instances[0].to_world.m[7], 5);
  EXPECT_EQ(s.shapes.at(0).to_world.m[3], 1);
}

TEST(Pbrt, AttributesEndAtAttributeEnd) {
  const Scene s = pbrt(R"(AttributeBegin Translate 1 0 0 ReverseOrientation
TransformBegin Translate 0 1 0 Shape "sphere" TransformEnd Shape "sphere" AttributeEnd Shape "sphere")");

  EXPECT_EQ(s.shapes.at(0).to_world.m[7], 1);
  EXPECT_EQ(s.shapes.at(1).to_world.m[7], 0);
  EXPECT_TRUE(s.shapes.at(1).flip_normals);
  EXPECT_EQ(s.shapes.at(2).to_world, Transform{});
  EXPECT_FALSE(s.shapes.at(2).flip_normals);
}

// pbrt-v4 reads TransformBegin as AttributeBegin, and TransformEnd as AttributeEnd.
TEST(Pbrt, TransformEndEndsAttributesToo) {
  const Scene s = pbrt(R"(TransformBegin Translate 1 0 0 ReverseOrientation TransformBegin AttributeEnd
Shape "sphere" TransformEnd Shape "sphere")");

  EXPECT_EQ(s.shapes.at(0).to_world.m[3], 1);
  EXPECT_TRUE(s.shapes.at(0).flip_normals);
  EXPECT_EQ(s.shapes.at(1).to_world, Transform{});
  EXPECT_FALSE(s.shapes.at(1).flip_normals);
}

TEST(Pbrt, CameraMediumIsTheOneOutside) {
  const Scene s = pbrt(R"(Shape "sphere")", R"(MakeNamedMedium "fog" "string type" "homogeneous"
MediumInterface "" "fog" Camera "perspective")");

  ASSERT_TRUE(s.sensor.medium);
  const auto& fog = std::get<HomogeneousMedium>(s.media.at(s.sensor.medium->value));
  EXPECT_EQ(fog.sigma_t, (Rgb{2, 2, 2}));
  EXPECT_EQ(fog.albedo, (Rgb{.5, .5, .5}));
}

TEST(Pbrt, LightOfAMediumIsPerAbsorption) {
  const Scene s =
      pbrt(R"(MakeNamedMedium "glow" "string type" "homogeneous" "rgb Le" [ 1 2 3 ] "float Lescale" 2
MediumInterface "glow" "" Material "interface" Shape "sphere")");

  EXPECT_EQ(std::get<HomogeneousMedium>(s.media.at(0)).source_radiance, (Rgb{2, 4, 6}));
}

float float_at(const std::string& bytes, std::size_t at) {
  float x = 0;
  std::memcpy(&x, bytes.data() + at, sizeof x);
  return x;
}

TEST(Pbrt, GridsArePaddedWithZeros) {
  KeepingAssets assets;
  const ReadResult r = read_scene("t.pbrt", pbrt_scene(R"(MakeNamedMedium "smoke" "string type" "uniformgrid"
"integer nx" 2 "integer ny" 1 "integer nz" 1 "float density" [ 3 4 ] "point3 p0" [ 0 0 0 ] "point3 p1" [ 2 1 1 ]
MediumInterface "smoke" "" Material "interface" Shape "sphere")"),
                                  assets);

  ASSERT_TRUE(r.scene) << messages(r);
  const auto& medium = std::get<HeterogeneousMedium>(r.scene->media.at(0));
  EXPECT_EQ(medium.scale, 2);
  const auto& grid = std::get<GridVolume>(r.scene->volumes.at(medium.sigma_t.value));
  const Transform want{{2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
  EXPECT_EQ(grid.to_world, want);
  EXPECT_TRUE(grid.border);
  const std::string bytes = assets.memory.files.at(r.scene->assets.at(grid.file.value).name);
  ASSERT_EQ(bytes.size(), 48u + 4 * 4 * 3 * 3);
  const auto value = [&](int x, int y, int z) {
    return float_at(bytes, std::size_t(48 + 4 * (x + 4 * (y + 3 * z))));
  };
  EXPECT_EQ(value(1, 1, 1), 3);
  EXPECT_EQ(value(2, 1, 1), 4);
  EXPECT_EQ(value(0, 1, 1) + value(3, 1, 1) + value(1, 0, 1) + value(2, 1, 2), 0);
}

TEST(Pbrt, MeshesInTheTextBecomeFiles) {
  KeepingAssets assets;
  const ReadResult r = read_scene("t.pbrt", pbrt_scene(R"(Scale -1 1 1 AreaLightSource "diffuse"
Shape "trianglemesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 ] "integer indices" [ 0 1 2 ])"),
                                  assets);

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_TRUE(r.scene->shapes.at(0).flip_normals);  // mirroring reverses the normal, unlike in pbrt
  const std::string bytes = assets.memory.files.at(r.scene->assets.at(0).name);
  EXPECT_TRUE(bytes.starts_with("ply\nformat binary_little_endian 1.0\nelement vertex 3\n"));
  EXPECT_TRUE(bytes.ends_with(std::string("\3\0\0\0\0\1\0\0\0\2\0\0\0", 13)));
}

TEST(Pbrt, FlatPatchesAreTriangles) {
  const std::string flat = R"(Shape "bilinearmesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 1 1 0 ])";
  EXPECT_EQ(pbrt(flat).shapes.size(), 1u);
  EXPECT_TRUE(says(refusal(R"(Shape "bilinearmesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 1 1 1 ])"), "is bent"));
}

// The corners of each patch have the uv (0, 0), (1, 0), (0, 1) and (1, 1), even if two patches share corners.
TEST(Pbrt, PatchesHaveTheirUv) {
  KeepingAssets assets;
  const ReadResult r =
      read_scene("t.pbrt", pbrt_scene(R"(Shape "bilinearmesh" "integer indices" [ 0 1 2 3 1 4 3 5 ]
"point3 P" [ 0 0 0 1 0 0 0 1 0 1 1 0 2 0 0 2 1 0 ])"),
                 assets);

  ASSERT_TRUE(r.scene) << messages(r);
  const std::string& bytes = assets.memory.files.at(r.scene->assets.at(0).name);
  const std::size_t begin = bytes.find("end_header\n") + 11;
  constexpr std::size_t kCorner = 5 * sizeof(float);  // x y z u v
  EXPECT_NE(bytes.find("element vertex 8\n"), std::string::npos);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(float_at(bytes, begin + i * kCorner), static_cast<float>(i / 4 + i % 2));
    EXPECT_EQ(float_at(bytes, begin + i * kCorner + 12), static_cast<float>(i % 2));
    EXPECT_EQ(float_at(bytes, begin + i * kCorner + 16), static_cast<float>(i % 4 / 2));
  }
}

// In pbrt the corners of a triangle without uv have (0, 0), (1, 0) and (1, 1). Only a textured mesh needs
// them.
TEST(Pbrt, TrianglesWithoutUvHaveThoseOfPbrt) {
  const auto corners = [](std::string_view material) {
    KeepingAssets assets;
    const std::string mesh = fmt::format(R"({} Shape "trianglemesh" "integer indices" [ 0 1 2 2 1 3 ]
"point3 P" [ 0 0 0 1 0 0 0 1 0 1 1 0 ])",
                                         material);
    const ReadResult r = read_scene("t.pbrt", pbrt_scene(mesh), assets);
    EXPECT_TRUE(r.scene) << messages(r);
    return assets.memory.files.at(r.scene->assets.at(0).name);
  };
  EXPECT_NE(corners("Material \"diffuse\"").find("element vertex 4\n"), std::string::npos);

  const std::string bytes = corners(R"(Texture "t" "spectrum" "checkerboard"
Material "diffuse" "texture reflectance" "t")");

  const std::size_t begin = bytes.find("end_header\n") + 11;
  constexpr std::size_t kCorner = 5 * sizeof(float);  // x y z u v
  ASSERT_NE(bytes.find("element vertex 6\n"), std::string::npos);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(float_at(bytes, begin + i * kCorner + 12), i % 3 == 0 ? 0 : 1);
    EXPECT_EQ(float_at(bytes, begin + i * kCorner + 16), i % 3 == 2 ? 1 : 0);
  }
  EXPECT_EQ(float_at(bytes, begin + 3 * kCorner + 4), 1);  // corner 2
}

TEST(Pbrt, IncludesAreReadInPlace) {
  KeepingAssets assets;
  assets.memory.files["part.pbrt"] = "Translate 1 0 0 Shape \"sphere\"";
  const ReadResult r = read_scene(
      "t.pbrt", pbrt_scene("Import \"part.pbrt\" Shape \"sphere\" Include \"part.pbrt\" Shape \"sphere\""),
      assets);

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(r.scene->shapes.at(0).to_world.m[3], 1);
  EXPECT_EQ(r.scene->shapes.at(1).to_world.m[3], 0);
  EXPECT_EQ(r.scene->shapes.at(3).to_world.m[3], 1);
}

TEST(Pbrt, FilesThatIncludeThemselvesAreRefused) {
  KeepingAssets assets;
  assets.memory.files["a.pbrt"] = "Include \"b.pbrt\"";
  assets.memory.files["b.pbrt"] = "Include \"a.pbrt\"";
  const ReadResult r = read_scene("t.pbrt", pbrt_scene("Include \"a.pbrt\""), assets);

  EXPECT_FALSE(r.scene);
  EXPECT_TRUE(says(messages(r), "b.pbrt:1:10: error: \"a.pbrt\" includes itself")) << messages(r);
}

}  // namespace
}  // namespace ls

// What files of pbrt's exporters have besides the objects themselves: windows of cameras, colour spaces,
// mirrored shapes, options, and parameters without an effect here.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "core/scene/spectrum.h"
#include "formats/pbrt/vocabulary.h"
#include "formats/xml/transform_element.h"
#include "tests/unit/scene/pbrt/pbrt_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kDegree = std::numbers::pi / 180;

// Returns the scene of a camera with this film, and its messages.
ReadResult seen(int width, int height, std::string_view camera) {
  return read_pbrt(fmt::format(R"(Film "rgb" "integer xresolution" {} "integer yresolution" {}
Camera {} WorldBegin Shape "sphere")",
                               width, height, camera));
}

Sensor sensor_of(int width, int height, std::string_view camera) {
  const ReadResult r = seen(width, height, camera);
  EXPECT_TRUE(r.scene) << messages(r);
  return r.scene ? r.scene->sensor : Sensor{};
}

// In camera.cpp of the renderer a point (u, v) of the frame, from its top left corner, sees the direction
// (x, y, 1), x to the left, with x = t (1 - 2 ox - 2 u), y = t (1 - 2 oy - 2 v) / aspect and t = tan(fov /
// 2).
struct Seen {
  double left, right, bottom, top;  // x to the right
};
Seen edges(const Sensor& s, double aspect) {
  EXPECT_EQ(s.fov_axis, FovAxis::x);
  const double t = std::tan(s.fov / 2 * kDegree), ox = s.principal_point_offset[0],
               oy = s.principal_point_offset[1];
  return {-t * (1 - 2 * ox), t * (1 + 2 * ox), t * (-1 - 2 * oy) / aspect, t * (1 - 2 * oy) / aspect};
}

constexpr double kRoundings = 8 * 16 * 2.3e-16;  // a few roundings of doubles below 8

TEST(PbrtWindow, PerspectiveWindowIsInUnitsOfTheFieldOfView) {
  const double unit = std::tan(22.5 * kDegree);
  const Seen e = edges(
      sensor_of(32, 24, R"("perspective" "float fov" 45 "float screenwindow" [ -1 1 -0.75 0.75 ])"), 4. / 3);

  EXPECT_NEAR(e.left, -unit, kRoundings);
  EXPECT_NEAR(e.right, unit, kRoundings);
  EXPECT_NEAR(e.bottom, -.75 * unit, kRoundings);
  EXPECT_NEAR(e.top, .75 * unit, kRoundings);
}

TEST(PbrtWindow, OffCentreWindowMovesThePrincipalPoint) {
  for (const std::string_view lens : {"", R"("float lensradius" 0.1 "float focaldistance" 3)"}) {
    const Seen e =
        edges(sensor_of(20, 10,
                        fmt::format(R"("perspective" "float screenwindow" [ -0.5 1.5 0.25 1.25 ] {})", lens)),
              2);

    EXPECT_NEAR(e.left, -.5, kRoundings);
    EXPECT_NEAR(e.right, 1.5, kRoundings);
    EXPECT_NEAR(e.bottom, .25, kRoundings);
    EXPECT_NEAR(e.top, 1.25, kRoundings);
  }
}

TEST(PbrtWindow, MirroredWindowMirrorsTheImage) {
  const Sensor plain = sensor_of(20, 10, R"("perspective" "float screenwindow" [ -0.5 1.5 -0.5 0.5 ])"),
               mirrored = sensor_of(20, 10, R"("perspective" "float screenwindow" [ 1.5 -0.5 -0.5 0.5 ])");
  const Seen one = edges(plain, 2), other = edges(mirrored, 2);

  EXPECT_EQ(scene::column(mirrored.to_world, 0)[0], -scene::column(plain.to_world, 0)[0]);
  EXPECT_NEAR(other.left, -one.right, kRoundings);
  EXPECT_NEAR(other.right, -one.left, kRoundings);
}

TEST(PbrtWindow, OrthographicWindowMayHaveAnyShape) {
  const Sensor s = sensor_of(30, 10, R"("orthographic" "float screenwindow" [ -2 6 1 2 ])");
  // Our frame reaches from x = 1 on its left to -1 on its right, and from y = 1/3 above to -1/3.
  const Vec3 top_left = scene::transform_point(s.to_world, Vec3{{1, 1. / 3, 0}}),
             bottom_right = scene::transform_point(s.to_world, Vec3{{-1, -1. / 3, 0}});

  EXPECT_NEAR(top_left[0], -2, kRoundings);
  EXPECT_NEAR(top_left[1], 2, kRoundings);
  EXPECT_NEAR(bottom_right[0], 6, kRoundings);
  EXPECT_NEAR(bottom_right[1], 1, kRoundings);
}

TEST(PbrtWindow, DefaultWindowChangesNothing) {
  const Sensor given =
      sensor_of(20, 10, R"("perspective" "float fov" 40 "float screenwindow" [ -2 2 -1 1 ])");
  const Sensor shaped = sensor_of(20, 10, R"("perspective" "float fov" 40 "float frameaspectratio" 2)");

  // The shorter side, the height, has the field of view of 40 degrees.
  EXPECT_NEAR(edges(given, 2).top, std::tan(20 * kDegree), kRoundings);
  EXPECT_EQ(shaped, sensor_of(20, 10, R"("perspective" "float fov" 40)"));
}

TEST(PbrtWindow, IsReadIfItsShapeMatchesTheFilmToFourDigits) {
  EXPECT_TRUE(seen(1998, 1080, R"("perspective" "float screenwindow" [ -1 1 -0.5405 0.5405 ])").scene);
}

TEST(PbrtWindow, NonSquarePixelsAreRefused) {
  for (const std::string_view camera : {R"("perspective" "float screenwindow" [ -1 1 -1 1 ])",
                                        R"("perspective" "float frameaspectratio" 1)"}) {
    const ReadResult r = seen(20, 10, camera);

    EXPECT_FALSE(r.scene);
    EXPECT_THAT(messages(r), HasSubstr("2:9: error: Camera \"perspective\" shows a window of the shape 1 : 1 "
                                       "on a film of 2 : 1"));
  }
  EXPECT_THAT(messages(seen(20, 10, R"("perspective" "float screenwindow" [ -1 1 ])")),
              HasSubstr("wants four numbers: x0 x1 y0 y1"));
}

TEST(Pbrt, HalffovReplacesFov) {
  EXPECT_EQ(sensor_of(10, 10, R"("perspective" "float halffov" 20)"),
            sensor_of(10, 10, R"("perspective" "float fov" 40)"));
}

// The directions that are named by pbrt's SphericalCamera and by our `spherical`.
TEST(Pbrt, SphericalCamerasByLatitudeAreRead) {
  const Sensor s = sensor_of(20, 10, R"("spherical" "string mapping" "equirectangular")");

  EXPECT_EQ(s.projection, Projection::spherical);
  for (const double u : {0., .25, .6}) {
    const double phi = 2 * std::numbers::pi * u, theta = 1;
    const Vec3 ours{{std::sin(phi) * std::sin(theta), std::cos(theta), -std::cos(phi) * std::sin(theta)}};
    const Vec3 at = scene::transform_vector(s.to_world, ours);
    EXPECT_NEAR(at[0], std::sin(theta) * std::cos(phi), kRoundings);
    EXPECT_NEAR(at[1], std::cos(theta), kRoundings);
    EXPECT_NEAR(at[2], std::sin(theta) * std::sin(phi), kRoundings);
  }
  EXPECT_THAT(messages(seen(20, 10, R"("spherical")")), HasSubstr("only equirectangular is supported"));
}

// On which side of a shape pbrt has its normal, and the media: outside of a sphere or cylinder, or +z of a
// disk or of a triangle that runs counterclockwise as seen from there.
struct Sides {
  bool normal_is_original, inside_is_original;  // the medium inside is on the side of the original normal
  bool operator==(const Sides&) const = default;
};

// What the renderer makes of a shape (orientation_of() and mirrored_inwards() of geometry_build.cpp).
Sides rendered(const Shape& s, bool vertex_normals) {
  const bool mirrored = scene::determinant3(s.to_world) < 0;
  const bool sphere = std::holds_alternative<SphereShape>(s.geometry),
             mesh = std::holds_alternative<MeshShape>(s.geometry);
  // A mirrored sphere is inside out, and so is a mesh whose corners alone say which side is which.
  const bool turns = mirrored && (sphere || (mesh && !vertex_normals));
  const bool original = turns == s.flip_normals;
  // The interior is on the side that the normal points away from; of a mirrored sphere or mesh, always on the
  // side away from the original normal.
  const bool interior_is_original = mirrored && (sphere || mesh) ? false : !original;
  return {original, s.interior ? interior_is_original : !interior_is_original};
}

TEST(PbrtSides, MirroredAndReversedShapesHavePbrtsSides) {
  struct Kind {
    std::string_view shape;
    bool quadric, vertex_normals;
  };
  const Kind kinds[] = {
      {R"(Shape "sphere")", true, false},
      {R"(Shape "sphere" "float alpha" 1)", true, false},  // it is mirrored once more, for its uv
      {R"(Shape "cylinder")", true, false},
      {R"(Shape "disk")", true, false},
      {R"(Shape "trianglemesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 ])", false, false},
      {R"(Shape "trianglemesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 ] "normal N" [ 0 0 1 0 0 1 0 0 1 ])", false,
       true},
      {R"(Shape "bilinearmesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 1 1 0 ])", false, false},
  };
  for (const Kind& kind : kinds)
    for (const bool mirrored : {false, true})
      for (const bool reversed : {false, true}) {
        const Scene s = pbrt(fmt::format(
            R"(MakeNamedMedium "fog" "string type" "homogeneous" MediumInterface "fog" "" Material "dielectric"
{}{}{})",
            mirrored ? "Scale 1 1 -1\n" : "", reversed ? "ReverseOrientation\n" : "", kind.shape));
        ASSERT_EQ(s.shapes.size(), 1u);
        const bool turned = kind.quadric ? mirrored != reversed : reversed;

        EXPECT_EQ(rendered(s.shapes[0], kind.vertex_normals), (Sides{!turned, turned}))
            << kind.shape << mirrored << reversed;
      }
}

TEST(PbrtSides, MirroredLampIsAWarning) {
  const ReadResult r = read_pbrt(pbrt_scene(R"(AreaLightSource "diffuse" Scale -1 1 1 Shape "sphere")"));

  EXPECT_TRUE(r.scene);
  EXPECT_THAT(messages(r), HasSubstr("when it samples lights, pbrt takes the other side"));
}

// pbrt keeps the tangent frame of a normal map as it is where a transform mirrors the shape.
TEST(PbrtSides, NormalMapOfAMirroredShapeIsAWarning) {
  const auto told = [](std::string_view transform) {
    return messages(read_pbrt(pbrt_scene(fmt::format(
        R"(MakeNamedMaterial "bumpy" "string type" "diffuse" "string normalmap" "normals.png"
MakeNamedMaterial "mixed" "string type" "mix" "string materials" [ "bumpy" "bumpy" ]
NamedMaterial "mixed" {} Shape "sphere")",
        transform))));
  };
  EXPECT_THAT(told("Scale -1 1 1"), HasSubstr("does not mirror it along"));
  EXPECT_THAT(told("Scale -1 -1 1"), Not(HasSubstr("mirror")));
}

TEST(PbrtSides, SidesOfAMirroredFileAreUnknown) {
  EXPECT_THAT(
      refusal(R"(Material "dielectric" Scale -1 1 1 Shape "plymesh" "string filename" "mesh.ply")"),
      HasSubstr("whether the file has normals, which decides which side is which, is not known here"));
}

TEST(Pbrt, FiltersOfNegativeLobesBecomeGaussians) {
  for (const std::string_view filter :
       {R"("mitchell" "float B" 0.3 "float C" 0.3 "float xradius" 2)", R"("sinc" "float tau" 3)"}) {
    const ReadResult r = read_pbrt(
        fmt::format(R"({}Camera "perspective" PixelFilter {} WorldBegin Shape "sphere")", kPbrtFilm, filter));

    ASSERT_TRUE(r.scene) << messages(r);
    EXPECT_EQ(r.scene->film.filter, ReconstructionFilter(GaussianFilter{}));
    EXPECT_THAT(messages(r), HasSubstr("is read as \"gaussian\""));
  }
}

// Returns the reflectance of a diffuse sphere.
Rgb reflectance_of(const Scene& s) {
  for (const Texture& t : s.textures)
    if (const auto* c = std::get_if<ConstantTexture>(&t)) return c->value;
  ADD_FAILURE() << "no constant texture";
  return {};
}

// Returns the reflectance of a diffuse sphere whose colour is given in this space.
Rgb reflectance(std::string_view space, std::string_view rgb) {
  return reflectance_of(pbrt(fmt::format(
      R"(ColorSpace "{}" Material "diffuse" "rgb reflectance" [ {} ] ColorSpace "srgb" Shape "sphere")",
      space, rgb)));
}

void expect_near(const Rgb& got, const Rgb& want, double tolerance) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(got[i], want[i], tolerance) << i;
}

// The values are those of the colorimetric matrices from the primaries and whites of each space, as tables of
// them print them with four digits: BT.2020 to BT.709 (ITU-R BT.2087), P3-D65 to BT.709.
TEST(PbrtColours, AreConvertedFromTheirSpace) {
  expect_near(reflectance("rec2020", "0.25 0.5 0.25"), {.1031, .5332, .2249}, 1e-4);
  expect_near(reflectance("srgb", "0.25 0.5 0.25"), {.25, .5, .25}, 0);
  // The columns of the matrix, each 1/2 of a primary with 1/4 of white.
  expect_near(reflectance("rec2020", "0.75 0.25 0.25"), {1, .25 - .5 * .1246, .25 - .5 * .0182}, 1e-4);
  expect_near(reflectance("dci-p3", "0.25 0.5 0.25"),
              {.25 - .25 * .2249, .25 + .25 * 1.0420, .25 - .25 * .0786}, 1e-4);
}

TEST(PbrtColours, ReflectanceColoursKeepTheirGrey) {
  for (const std::string_view space : {"rec2020", "dci-p3", "ACES2065-1"})
    EXPECT_EQ(reflectance(space, "0.3 0.3 0.3"), (Rgb{.3, .3, .3})) << space;
  const Scene s = pbrt(R"(ColorSpace "aces2065-1"
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [ 1 1 1 ] "rgb sigma_s" [ 3 3 3 ]
MediumInterface "fog" "" Material "interface" Shape "sphere")");
  EXPECT_EQ(std::get<HomogeneousMedium>(s.media.at(0)).sigma_t, (Rgb{4, 4, 4}));
}

// ACES AP0 to linear sRGB with the Bradford adaptation, as it is printed for ACES (for example in the OCIO
// configurations): 2.5216 -1.1341 -0.3876; -0.2765 1.3727 -0.0962; -0.0154 -0.1530 1.1684.
TEST(PbrtColours, AcesColoursAreAdaptedToTheWhitePoint) {
  expect_near(reflectance("aces2065-1", "0.3 0.25 0.2"),
              {2.5216 * .3 - 1.1341 * .25 - .3876 * .2, -.2765 * .3 + 1.3727 * .25 - .0962 * .2,
               -.0154 * .3 - .1530 * .25 + 1.1684 * .2},
              2e-4);
}

// Light is not adapted: the white of ACES, (x, y) = (.32168, .33767), is what it is.
TEST(PbrtColours, LightColoursUseTheCieObserver) {
  const Scene s = pbrt(R"(ColorSpace "aces2065-1" LightSource "point" "rgb I" [ 1 1 1 ] Shape "sphere")");
  const double x = .32168 / .33767, z = (1 - .32168 - .33767) / .33767;
  const Rgb want{3.2404542 * x - 1.5371385 - .4985314 * z, -.9692660 * x + 1.8760108 + .0415560 * z,
                 .0556434 * x - .2040259 + 1.0572252 * z};

  const auto& light = std::get<PointEmitter>(s.emitters.at(0));
  // The matrix is printed for a white with other digits: (.31272, .32903) against (.3127, .3290).
  expect_near(light.intensity, want, 1e-3);
}

TEST(PbrtColours, ColoursOutsideSrgbAreClippedWithAWarning) {
  const ReadResult r = read_pbrt(
      pbrt_scene(R"(ColorSpace "rec2020" Material "diffuse" "rgb reflectance" [ 0 1 0 ] Shape "sphere")"));

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_THAT(messages(r), HasSubstr("3:42: warning: 'reflectance' has colours that linear sRGB can't hold"));
}

// pbrt divides a black body by its largest value, and scales only light to luminance 1.
TEST(PbrtColours, BlackBodiesAsReflectancesHaveAPeakOfOne) {
  const Rgb got = reflectance_of(pbrt(R"(Material "diffuse" "blackbody reflectance" 4000 Shape "sphere")"));

  scene::SpectralCurve planck;
  double peak = 0;
  for (double nm = 300; nm <= 3000; nm += .5) {
    planck.nm.push_back(nm);
    planck.value.push_back(1 / (std::pow(nm, 5) * std::expm1(1.438776877503933e7 / (nm * 4000))));
    peak = std::max(peak, planck.value.back());
  }
  for (double& x : planck.value) x /= peak;
  // Curves are lines between their points, 1 nm or less apart: they miss at most f'' / 8, and f'' of this one
  // is below 1e-4 of its peak per nm^2 in the visible.
  expect_near(got, linear_srgb(planck, scene::Illuminant::d65), 5e-5);
}

TEST(PbrtColours, ReflectancesOfMoreThanOneRedAreCutOff) {
  const ReadResult r = read_pbrt(
      pbrt_scene(R"(Material "diffuse" "spectrum reflectance" [ 580 0 590 1 720 1 ] Shape "sphere")"));

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(reflectance_of(*r.scene)[0], 1);
  EXPECT_THAT(messages(r), HasSubstr("'reflectance' is a colour that sRGB can't hold: it is cut off"));
}

TEST(PbrtColours, IndicesOfRefractionAreNoReflectances) {
  EXPECT_THAT(refusal(R"(Material "diffuse" "spectrum reflectance" "metal-Al-k" Shape "sphere")"),
              HasSubstr("3:21: error: the spectrum \"metal-Al-k\" is an index of refraction, which "
                        "'reflectance' is not: give it as rgb"));
}

TEST(PbrtColours, HaveTheSpaceOfTheirAttributeBlock) {
  const Scene s = pbrt(R"(AttributeBegin ColorSpace "rec2020" AttributeEnd
Material "diffuse" "rgb reflectance" [ 0.25 0.5 0.25 ] Shape "sphere")");

  bool found = false;
  for (const Texture& t : s.textures)
    if (const auto* c = std::get_if<ConstantTexture>(&t)) found |= c->value == Rgb{.25, .5, .25};
  EXPECT_TRUE(found);
  EXPECT_THAT(refusal(R"(ColorSpace "rec202")"), HasSubstr("did you mean 'rec2020'?"));
}

TEST(PbrtTextures, NumberAndColourMayShareAName) {
  const Scene s = pbrt(R"(Texture "t" "float" "constant" "float value" 0.25
Texture "t" "spectrum" "constant" "rgb value" [ 0.5 0.5 0.5 ]
Texture "alpha" "float" "imagemap" "string filename" "wood.png"
Material "diffuse" "texture reflectance" "t" Shape "sphere" "texture alpha" "t")");

  const auto& mask = std::get<MaskBsdf>(s.bsdfs.at(s.shapes.at(0).bsdf.value));
  EXPECT_EQ(std::get<ConstantTexture>(s.textures.at(mask.opacity.value)).value, (Rgb{.25, .25, .25}));
  const auto& sides = std::get<TwoSidedBsdf>(s.bsdfs.at(mask.bsdf.value));
  const auto& diffuse = std::get<DiffuseBsdf>(s.bsdfs.at(sides.front.value));
  EXPECT_EQ(std::get<ConstantTexture>(s.textures.at(diffuse.reflectance.value)).value, (Rgb{.5, .5, .5}));
  EXPECT_THAT(refusal(R"(Texture "t" "float" "constant" Texture "t" "float" "constant")"),
              HasSubstr("a second Texture \"t\" of the type \"float\""));
}

constexpr std::string_view kRough = R"(Texture "rough" "float" "imagemap" "string filename" "wood.png"
Material "{}" "texture {}" "rough" "bool remaproughness" {} Shape "sphere")";

TEST(PbrtTextures, MayBeTheAlphaOfMetalAndGlass) {
  const Scene metal = pbrt(fmt::format(kRough, "conductor", "roughness", "false"));
  const Scene glass = pbrt(fmt::format(kRough, "dielectric", "uroughness", "false"));

  const auto image_of = [](const Scene& s, TextureIndex t) {
    return std::holds_alternative<BitmapTexture>(s.textures.at(t.value));
  };
  const auto find = [](const Scene& s, auto wanted) {
    for (const Bsdf& b : s.bsdfs)
      if (const auto* found = std::get_if<decltype(wanted)>(&b)) return *found;
    ADD_FAILURE() << "no such bsdf";
    return wanted;
  };
  const auto rough_metal = find(metal, RoughConductorBsdf{});
  EXPECT_TRUE(image_of(metal, rough_metal.alpha_u) && image_of(metal, rough_metal.alpha_v));
  const auto rough_glass = find(glass, RoughDielectricBsdf{});
  EXPECT_TRUE(image_of(glass, rough_glass.alpha_u));
  EXPECT_FALSE(image_of(glass, rough_glass.alpha_v));
}

TEST(PbrtTextures, AreRefusedAsRoughnessWithTheReason) {
  EXPECT_THAT(
      refusal(fmt::format(kRough, "conductor", "roughness", "true")),
      HasSubstr("4:23: error: 'roughness' of Material \"conductor\" is an image: pbrt takes the square root "
                "of it, so make it an image of that, and give \"bool remaproughness\" false"));
  EXPECT_THAT(
      refusal(fmt::format(kRough, "coateddiffuse", "vroughness", "false")),
      HasSubstr("'vroughness' of Material \"coateddiffuse\" is an image: a layer has one roughness here"));
  EXPECT_THAT(refusal(R"(Material "conductor" "texture roughness" "none" Shape "sphere")"),
              HasSubstr("'roughness' names no Texture that stands before this"));
  EXPECT_THAT(refusal(R"(Material "conductor" "float roughness" -1 Shape "sphere")"),
              HasSubstr("'roughness' of Material \"conductor\" wants one number that is not negative"));
}

TEST(PbrtTextures, ScaleMultipliesTextures) {
  const Scene s = pbrt(R"(Texture "wood" "spectrum" "imagemap" "string filename" "wood.png" "float scale" 0.5
Texture "t" "spectrum" "scale" "texture tex" "wood" "float scale" 0.25
Material "diffuse" "texture reflectance" "t" Shape "sphere")");

  std::vector<double> factors;
  for (const Texture& t : s.textures)
    if (const auto* p = std::get_if<ProductTexture>(&t))
      for (const TextureIndex i : {p->first, p->second})
        if (const auto* c = std::get_if<ConstantTexture>(&s.textures.at(i.value)))
          factors.push_back(c->value[0]);
  EXPECT_THAT(factors, ::testing::UnorderedElementsAre(.5, .25));
}

TEST(PbrtTextures, DifferOnPatchesThatAreNotParallelograms) {
  const auto said = [](std::string_view last) {
    return messages(read_pbrt(pbrt_scene(fmt::format(
        R"(Shape "bilinearmesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 {} ] "normal N" [ 0 0 1 0 0 1 0 0 1 0 0 1 ])",
        last))));
  };

  EXPECT_THAT(said("2 2 0"), HasSubstr("that is no parallelogram is two triangles here"));
  EXPECT_EQ(said("1 1 0"), "");
}

TEST(Pbrt, SkipsAByteOrderMark) {
  EXPECT_TRUE(read_pbrt("\xEF\xBB\xBF" + pbrt_scene("Shape \"sphere\"")).scene);
  KeepingAssets assets;
  assets.memory.files["in.pbrt"] = "\xEF\xBB\xBFShape \"sphere\"";
  EXPECT_TRUE(read_pbrt(pbrt_scene("Include \"in.pbrt\""), assets).scene);
}

TEST(Pbrt, ParametersWithoutAnEffectAreNamedOnce) {
  const ReadResult r = read_pbrt(R"(Film "rgb" "string filename" "a.exr" "float maxcomponentvalue" 10
Camera "perspective" Sampler "halton" "integer seed" 3
WorldBegin Material "coateddiffuse" "integer maxdepth" 3 Material "coateddiffuse" "integer maxdepth" 4
Shape "sphere")");

  ASSERT_TRUE(r.scene) << messages(r);
  const std::string said = messages(r);
  EXPECT_THAT(said, HasSubstr("1:13: warning: 'filename' of Film \"rgb\" has no effect here"));
  EXPECT_THAT(said, HasSubstr("'maxcomponentvalue' of Film \"rgb\" has no effect here"));
  EXPECT_THAT(said, HasSubstr("'seed' of Sampler \"halton\" has no effect here"));
  EXPECT_THAT(said, HasSubstr("3:38: warning: 'maxdepth' of Material \"coateddiffuse\" has no effect here"));
  EXPECT_THAT(said, Not(HasSubstr("3:84: warning")));
}

// Asks every parameter of the table that is not read: it is named, as an error or as a warning.
TEST(Pbrt, NoParameterIsIgnoredSilently) {
  for (const auto& row : scene::pbrt::rows()) {
    if (!row.is_read || row.directive == "MakeNamedMedium") continue;
    for (const auto& word : row.words) {
      if (word.use == scene::pbrt::Word::Use::read) continue;
      const std::string_view type = word.types.substr(0, word.types.find('|'));
      const std::string value = type == "string" || type == "texture" ? "\"x\""
                                : type == "bool"                      ? "true"
                                                                      : "[ 7 7 7 ]";
      const bool before = row.directive == "Film" || row.directive == "Camera" ||
                          row.directive == "PixelFilter" || row.directive == "Sampler" ||
                          row.directive == "Integrator";
      const std::string object =
          fmt::format("{} {}\"{}\" \"{} {}\" {}", row.directive,
                      row.directive == "Texture" ? "\"t\" \"float\" " : "", row.type, type, word.name, value);
      const ReadResult r = read_pbrt(before ? fmt::format("{} WorldBegin", object)
                                            : fmt::format("Camera \"perspective\" WorldBegin {}", object));
      EXPECT_THAT(messages(r), HasSubstr(fmt::format("'{}' of {}", word.name, row.directive))) << object;
    }
  }
}

TEST(Pbrt, OtherFilmsAndFiltersOfImagesAreWarnings) {
  EXPECT_THAT(messages(read_pbrt(R"(Film "gbuffer" Camera "perspective" WorldBegin Shape "sphere")")),
              HasSubstr("Film \"gbuffer\" gives the picture in red, green and blue"));
  EXPECT_THAT(
      messages(read_pbrt(pbrt_scene(
          R"(Texture "t" "float" "imagemap" "string filename" "wood.png" "string filter" "trilinear")"))),
      HasSubstr("the filter \"trilinear\" of Texture \"imagemap\" is read as \"bilinear\""));
}

TEST(Pbrt, RefusedParametersMayHaveTheirDefault) {
  EXPECT_TRUE(seen(8, 8, R"("orthographic" "float lensradius" 0)").scene);
  EXPECT_FALSE(seen(8, 8, R"("orthographic" "float lensradius" 1)").scene);
}

TEST(Pbrt, OptionsAreANameAndAValue) {
  const auto with = [](std::string_view option) {
    return read_pbrt(
        fmt::format(R"({}Camera "perspective" Option {} WorldBegin Shape "sphere")", kPbrtFilm, option));
  };
  for (const std::string_view option : {R"("seed" 42)", R"("wavefront" true)", R"("msereferenceout" "a.exr")",
                                        R"("integer seed" 3)", R"("integer seed" [3])"}) {
    const ReadResult r = with(option);
    EXPECT_TRUE(r.scene) << messages(r);
    EXPECT_THAT(messages(r), HasSubstr("has no effect here"));
  }
  EXPECT_TRUE(with(R"("forcediffuse" false)").scene);
  EXPECT_THAT(messages(with(R"("forcediffuse" true)")), HasSubstr("the Option 'forcediffuse' is not read"));
  EXPECT_TRUE(with(R"("bool forcediffuse" [ false ])").scene);
  EXPECT_THAT(messages(with(R"("forcediffuse" [true])")), HasSubstr("the Option 'forcediffuse' is not read"));
  EXPECT_THAT(messages(read_pbrt(R"(Option "seed")")), HasSubstr("the Option 'seed' has no value"));
  for (const std::string_view option : {R"("seed" [])", R"("seed" [1 2])", R"("seed" ])", R"("seed" [)"})
    EXPECT_THAT(messages(with(option)), HasSubstr("the Option 'seed' wants one value")) << option;
}

TEST(Pbrt, ShapesAndInstancesMoveBetweenTheirTwoTransforms) {
  const ReadResult r = read_pbrt(pbrt_scene(R"(AttributeBegin ActiveTransform StartTime Translate 1 0 0
ActiveTransform EndTime Translate 5 0 0 ActiveTransform All Translate 0 2 0 Shape "disk" "float height" 3 AttributeEnd
AttributeBegin ActiveTransform EndTime AttributeEnd Shape "sphere"
ObjectBegin "o" Shape "sphere" ObjectEnd
ActiveTransform EndTime Translate 0 0 4 ObjectInstance "o")"));

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(messages(r), "");
  const Shape& disk = r.scene->shapes.at(0);
  ASSERT_EQ(disk.motion.size(), 2u);
  EXPECT_EQ(origin_of(disk.motion[0].to_world), (Vec3{{1, 2, 3}}));
  EXPECT_EQ(origin_of(disk.motion[1].to_world), (Vec3{{5, 2, 3}}));
  EXPECT_TRUE(r.scene->shapes.at(1).motion.empty());
  const Instance& instance = r.scene->instances.at(0);
  ASSERT_EQ(instance.motion.size(), 2u);
  EXPECT_EQ(origin_of(instance.motion[1].to_world), (Vec3{{0, 0, 4}}));
  EXPECT_EQ(r.scene->sensor.shutter_close, 1);  // the camera, which stands still, has the shutter
  EXPECT_TRUE(r.scene->sensor.motion.empty());
}

TEST(Pbrt, ShapesThatCannotMoveStandWhereTheyAreAtStartTime) {
  const std::string aside = "ActiveTransform EndTime Translate 5 0 0 ActiveTransform All ";
  for (const auto& [text, why] :
       {std::pair{aside + R"(AreaLightSource "diffuse" Shape "sphere")", "since it gives light"},
        {aside + R"(ObjectBegin "o" Shape "sphere" ObjectEnd ObjectInstance "o")",
         "since it is in an ObjectBegin"},
        {R"(ActiveTransform EndTime Scale 1 2 1 Shape "sphere")", "since it is stretched"},
        {R"(ActiveTransform EndTime Scale -1 1 1 Shape "disk")",
         "since its transforms shear, or one of them"},
        {R"(ActiveTransform EndTime ConcatTransform [1 1 0 0 0 1 0 0 0 0 1 0 0 0 0 1] Shape "disk")",
         "since its transforms shear"}}) {
    const ReadResult r = read_pbrt(pbrt_scene(text));
    ASSERT_TRUE(r.scene) << messages(r);
    EXPECT_TRUE(r.scene->shapes.at(0).motion.empty()) << text;
    EXPECT_EQ(origin_of(r.scene->shapes.at(0).to_world), (Vec3{{0, 0, 0}})) << text;
    EXPECT_THAT(messages(r), HasSubstr("it is shown where it is at StartTime, " + std::string(why)));
  }
  EXPECT_THAT(refusal("ActiveTransform Middle"), HasSubstr("wants one of All, StartTime and EndTime"));
  EXPECT_THAT(refusal("TransformTimes 1 1"), HasSubstr("TransformTimes end at 1 and begin at 1"));
}

ReadResult camera_that_moves(std::string_view before, std::string_view camera) {
  return read_pbrt(fmt::format("{}\nCamera {}\nWorldBegin Shape \"sphere\"\n", before, camera));
}

TEST(Pbrt, CamerasMoveBetweenTheirTwoTransforms) {
  const std::string_view aside =
      "LookAt 0 0 -5  0 0 0  0 1 0 ActiveTransform EndTime Translate -2 0 0 ActiveTransform All";
  const ReadResult r = camera_that_moves(aside, R"("perspective")");
  ASSERT_TRUE(r.scene) << messages(r);
  const auto& keys = r.scene->sensor.motion;
  ASSERT_EQ(keys.size(), 2u);
  EXPECT_EQ(origin_of(keys[0].to_world), (Vec3{{0, 0, -5}}));
  EXPECT_EQ(origin_of(keys[1].to_world), (Vec3{{2, 0, -5}}));
  EXPECT_TRUE(quiet(r)) << messages(r);

  const auto half = camera_that_moves(fmt::format("TransformTimes 0 2 {}", aside),
                                      R"("perspective" "float shutteropen" 1 "float shutterclose" 1.5)");
  ASSERT_TRUE(half.scene) << messages(half);
  ASSERT_EQ(half.scene->sensor.motion.size(), 2u);
  EXPECT_EQ(origin_of(half.scene->sensor.motion[0].to_world), (Vec3{{1, 0, -5}}));
  EXPECT_EQ(origin_of(half.scene->sensor.motion[1].to_world), (Vec3{{1.5, 0, -5}}));

  for (const char* type : {R"("orthographic")", R"("spherical" "string mapping" "equirectangular")"})
    EXPECT_EQ(camera_that_moves(aside, type).scene->sensor.motion.size(), 2u) << type;
}

TEST(Pbrt, NamedCoordinateSystemsHaveBothTransforms) {
  const ReadResult r = camera_that_moves(
      "ActiveTransform EndTime Translate 3 0 0 ActiveTransform All CoordinateSystem \"rail\" Identity "
      "Translate 9 9 9 "
      "CoordSysTransform \"rail\"",
      R"("perspective")");
  ASSERT_TRUE(r.scene) << messages(r);
  ASSERT_EQ(r.scene->sensor.motion.size(), 2u);
  EXPECT_EQ(origin_of(r.scene->sensor.motion[1].to_world), (Vec3{{-3, 0, 0}}));
  EXPECT_TRUE(quiet(r)) << messages(r);
}

}  // namespace
}  // namespace ls

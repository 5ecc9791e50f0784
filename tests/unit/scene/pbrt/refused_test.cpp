// Errors in pbrt files: their places and messages.
#include "core/scene/limits.h"
#include "formats/pbrt/vocabulary.h"
#include "tests/unit/scene/pbrt/pbrt_testing.h"

namespace ls {
namespace {

struct Case {
  std::string world, want;  // part of the messages
};

class PbrtRefuses : public ::testing::TestWithParam<Case> {};

TEST_P(PbrtRefuses, RefusalsHaveAPlaceAndAdvice) {
  const std::string said = refusal(GetParam().world);

  EXPECT_NE(said.find(GetParam().want), std::string::npos) << said;
}

INSTANTIATE_TEST_SUITE_P(
    All, PbrtRefuses,
    ::testing::Values(
        Case{"Shap \"sphere\"", "3:1: error: there is no directive Shap; did you mean 'Shape'?"},
        Case{"Shape \"spere\"", "3:8: error: there is no Shape \"spere\"; did you mean 'sphere'?"},
        Case{"Shape \"sphere\" \"float radiu\" 2",
             "3:17: error: Shape \"sphere\" has no parameter 'radiu'; did you mean 'radius'?"},
        Case{"Shape \"sphere\" \"string radius\" \"x\"", "'radius' of Shape \"sphere\" is float, not string"},
        Case{"Shape \"sphere\" \"float radius\" [ 1 2 ]", "wants one value"},
        Case{"Shape \"sphere\" \"float radius\" [ 1", "the ] of 'radius' is missing"},
        Case{"Shape \"sphere\" \"float radius\" x1", "'x1' is not a number"},
        Case{"Shape \"sphere\" \"float radius\" 1e39", "is not a number"},
        Case{"Shape \"sphere\" \"float radius\" nan", "is not a number"},
        Case{"Shape \"sphere\" \"float radius\" 1 \"float radius\" 2", "a second 'radius'"},
        Case{"Shape \"sphere\" \"radius\" 1", "a parameter is written as"},
        Case{"Shape \"sphere", "a \" is missing"},
        Case{"Shape \"sphere\" \"float zmin\" 0", "only whole spheres are read"},
        Case{"Shape \"curve\" \"point3 P\" [ 1 2 3 ]", "Shape \"curve\" is not read: hair is not supported"},
        Case{"Shape \"loopsubdiv\"", "write it as a plymesh"},
        Case{"Shape \"plymesh\" \"string filename\" \"a.ply.gz\"", "there is no file \"a.ply.gz\""},
        Case{"Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 3 ]",
             "there is no corner 3"},
        Case{"Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 ]", "no multiple of 3"},
        Case{"Shape \"trianglemesh\" \"point3 P\" [ ]", "P has no corners"},
        Case{"LightSource \"infinite\" \"string filename\" \"wood.png\" \"rgb L\" [ 1 2 3 ]",
             "has no effect beside the others"},
        Case{"LightSource \"infinite\" \"string filename\" \"wood.png\" \"string mapname\" \"wood.png\"",
             "has no effect beside the others"},
        Case{"LightSource \"infinite\" \"string filename\" \"wood.png\" \"float illuminance\" 2",
             "give scale"},
        Case{"LightSource \"infinite\" \"string mapname\" \"wood.png\" \"float illuminance\" 2",
             "give scale"},
        Case{"LightSource \"infinite\" \"point3 portal\" [ 0 0 0  1 0 0  1 1 0 ]",
             "3:25: error: 'portal' of LightSource \"infinite\" has 9 numbers: give the 12 of its 4 corners"},
        Case{"LightSource \"infinite\" \"float portal\" [ 0 0 0  1 0 0  1 1 0  0 1 0 ]",
             "'portal' of LightSource \"infinite\" is point3, not float"},
        Case{"Scale 1 2 1 LightSource \"infinite\" \"string filename\" \"wood.png\"", "may turn and mirror"},
        Case{"LightSource \"projection\"", "needs 'filename'"},
        Case{"LightSource \"spot\" \"float coneangle\" 1e-7 \"float conedeltaangle\" 0 \"float power\" 1",
             "is too narrow to have a power"},
        Case{"MakeNamedMedium \"c\" \"string type\" \"uniformgrid\" \"integer nx\" 1 \"integer ny\" 1 "
             "\"integer nz\" 1 \"float density\" 1e19",
             "beyond 1e+18"},
        Case{"LightSource \"projection\" \"string filename\" \"wood.png\" \"float power\" 2", "give scale"},
        Case{"AreaLightSource \"diffuse\" \"float power\" 2 Shape \"plymesh\" \"string filename\" "
             "\"mesh.ply\"",
             "its area is in its file"},
        Case{
            "AreaLightSource \"diffuse\" \"float power\" 2 Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 "
            "0 1 0 2 2 0 ] \"integer indices\" [ 0 1 2 2 1 3 ]",
            "its triangles differ in area"},
        Case{"LightSource \"infinite\" \"spectrum L\" \"illum-x\"", "no name that is known here"},
        Case{"Material \"coatedconductor\" \"float interface.uroughness\" 0.1",
             "has two roughnesses of the interface: only one is known of a coat. Give interface.roughness"},
        Case{"Material \"coatedconductor\" \"float conductor.roughness\" -1",
             "'conductor.roughness' of Material \"coatedconductor\" wants one number"},
        Case{"Material \"coatedconductor\" \"rgb albedo\" [ 1 1 1 ]", "a medium within the coat"},
        Case{"Material \"coatedconductor\" \"spectrum conductor.eta\" \"metal-Au-eta\"",
             "conductor.eta and conductor.k of Material \"coatedconductor\" are not of one metal"},
        Case{"Material \"coatedconductor\" \"rgb reflectance\" [ 1 1 1 ] \"rgb conductor.k\" [ 1 1 1 ]",
             "'conductor.k' of Material \"coatedconductor\" has no effect beside the others"},
        Case{"Material \"coatedconductor\" \"float roughness\" 0.1",
             "Material \"coatedconductor\" has no parameter 'roughness'"},
        Case{"Material \"hair\"", "Material \"hair\" is not read"},
        Case{"Material \"diffusetransmission\" \"float scale\" 3 Shape \"sphere\"",
             "reflectance and transmittance of bsdf \"diffusetransmission\" sum up to 1.5"},
        Case{"LightSource \"goniometric\"", "LightSource \"goniometric\" needs 'filename'"},
        Case{"LightSource \"goniometric\" \"string filename\" \"wood.png\" \"float power\" 3",
             "the meaning of power depends on the image"},
        Case{"Material \"diffuse\" \"texture reflectance\" \"none\"",
             "no Texture \"none\" stands before this"},
        Case{"Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.ptx\"",
             "turn \"a.ptx\" into a PNG"},
        Case{"NamedMaterial \"gold\"", "no MakeNamedMaterial \"gold\" stands before this"},
        Case{"MakeNamedMedium \"c\" \"string type\" \"uniformgrid\" \"integer nx\" 2000000000 \"float "
             "density\" [ 1 ]",
             "1 to 4096 are read"},
        Case{"MakeNamedMedium \"c\" \"string type\" \"uniformgrid\" \"integer nx\" 2 \"float density\" [ 1 ]",
             "nx * ny * nz is 2"},
        Case{"MediumInterface \"fogg\" \"\" Material \"interface\" Shape \"sphere\"",
             "no object has the id \"medium fogg\""},
        Case{"ObjectInstance \"x\"", "no object has the id \"object x\""},
        Case{"ObjectBegin \"x\" Shape \"sphere\"", "the ObjectEnd of this is missing"},
        Case{"AttributeBegin", "this is begun and not ended"},
        Case{"AttributeEnd", "ends nothing that was begun"},
        Case{"AttributeBegin TransformEnd TransformEnd", "ends nothing that was begun"},
        Case{"Scale 0 1 1 Shape \"sphere\"", "can't be inverted"},
        Case{"LookAt 0 0 0 0 0 0 0 1 0", "has its eye at its target"},
        Case{"Translate 1 2", "Translate wants 3 numbers"},
        Case{"Camera \"perspective\"", "belongs before WorldBegin"},
        Case{"WorldBegin", "a second WorldBegin"},
        Case{"Include \"nowhere.pbrt\"", "there is no file \"nowhere.pbrt\""},
        Case{"]", "a directive is wanted here"}));

TEST(Pbrt, EveryMessageHasAPlace) {
  for (const char* text : {"", "Shape", "\"", "[", "WorldBegin", "Film", "Camera \"perspective\"", "\xff"}) {
    const ReadResult r = read_pbrt(text);
    EXPECT_FALSE(r.scene) << text;
    ASSERT_FALSE(r.diagnostics.empty()) << text;
    for (const Diagnostic& d : r.diagnostics) EXPECT_GT(d.place.line, 0) << text;
  }
}

TEST(Pbrt, NestingIsLimited) {
  std::string deep;
  for (std::size_t i = 0; i <= scene::kMaxPbrtNesting; ++i) deep += "AttributeBegin ";

  EXPECT_NE(refusal(deep).find("nested more than"), std::string::npos);
}

TEST(Pbrt, RefusedTypesOfTheTableAreRefusedByName) {
  for (const auto& row : scene::pbrt::rows()) {
    if (row.is_read || row.directive == "MakeNamedMedium") continue;
    const bool setting =
        row.directive == "Camera" || row.directive == "PixelFilter" || row.directive == "Integrator";
    const std::string text = fmt::format("{} {}\"{}\"", row.directive,
                                         row.directive == "Texture" ? "\"t\" \"float\" " : "", row.type);
    const std::string said = setting ? messages(read_pbrt(text)) : refusal(text);
    EXPECT_NE(said.find(fmt::format("\"{}\" is not read: {}", row.type, row.meaning)), std::string::npos)
        << said;
  }
}

TEST(Pbrt, DirectivesOfTheTableAreKnown) {
  for (const auto& d : scene::pbrt::plain_directives()) {
    const std::string said = messages(read_pbrt(std::string(d.name)));
    EXPECT_EQ(said.find("there is no directive"), std::string::npos) << said;
  }
}

TEST(Pbrt, MissingMeshFileNamesItsSource) {
  MemoryAssets assets;
  const ReadResult r =
      read_scene("t.pbrt", pbrt_scene("Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]"), assets);

  EXPECT_FALSE(r.scene);
  EXPECT_NE(messages(r).find("which `lightshaft submit` sends along"), std::string::npos) << messages(r);
}

}  // namespace
}  // namespace ls

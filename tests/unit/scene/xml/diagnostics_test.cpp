// Every kind of error in a scene file gives a message with its place, and with what to do about it.
#include "core/scene/diagnostic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "formats/xml/source_text.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

struct Case {
  const char* name;
  std::string objects;  // line 2 of the file, from column 1
  int column;           // of the first diagnostic, in line 2
  std::string text;     // part of its text
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Wrong : public ::testing::TestWithParam<Case> {};

TEST_P(Wrong, ErrorIsReportedAtItsPlace) {
  const auto r = read(with_sensor(GetParam().objects));

  EXPECT_FALSE(r.scene);
  ASSERT_FALSE(r.diagnostics.empty());
  const Diagnostic& d = r.diagnostics.front();
  EXPECT_EQ(d.severity, Diagnostic::Severity::error);
  EXPECT_EQ(d.place, (SourcePlace{"test.xml", 2, GetParam().column})) << messages(r);
  EXPECT_THAT(d.text, HasSubstr(GetParam().text));
}

std::string shape_xml(const std::string& inside) { return "<shape type=\"sphere\">" + inside + "</shape>"; }
std::string deep(int n) {
  std::string open, close;
  for (int i = 0; i < n; ++i) {
    open += "<shape type=\"cube\">";
    close += "</shape>";
  }
  return open + close;
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, Wrong,
    ::testing::Values(
        Case{"UnknownElement", "<shpe type=\"cube\"/>", 2,
             "there is no element <shpe>; did you mean <shape>?"},
        Case{"UnknownPlugin", "<shape type=\"sphre\"/>", 14,
             "there is no shape \"sphre\"; did you mean 'sphere'?"},
        Case{"UnsupportedPlugin", "<shape type=\"hair\"/>", 14,
             "the shape \"hair\" is not supported: curves are not supported"},
        Case{"UnknownParameter", shape_xml("<float name=\"raduis\" value=\"1\"/>"), 35,
             "shape \"sphere\" has no parameter 'raduis'; did you mean 'radius'?"},
        Case{"UnknownAttribute", "<shape typ=\"cube\"/>", 8,
             "<shape> has no attribute 'typ'; did you mean 'type'?"},
        Case{"MissingAttribute", "<shape/>", 2, "<shape> needs the attribute 'type'"},
        Case{"RepeatedAttribute", "<shape type=\"cube\" type=\"cube\"/>", 20, "twice"},
        Case{"WrongType", shape_xml("<string name=\"radius\" value=\"big\"/>"), 51,
             "'radius' of shape \"sphere\" wants a <float>, not <string> \"big\""},
        Case{"NotANumber", shape_xml("<float name=\"radius\" value=\"1m\"/>"), 50, "wants a <float>"},
        Case{"NotFinite", shape_xml("<float name=\"radius\" value=\"nan\"/>"), 50, "wants a <float>"},
        Case{"FloatForInteger",
             "<integrator type=\"path\"><float name=\"max_depth\" value=\"3\"/></integrator>", 56,
             "wants an <integer>"},
        Case{"NotABoolean", shape_xml("<boolean name=\"flip_normals\" value=\"yes\"/>"), 58, "true or false"},
        Case{"OutOfRange", shape_xml("<float name=\"radius\" value=\"-1\"/>"), 50,
             "out of its range 0 < radius"},
        Case{"AlbedoAboveOne",
             "<medium type=\"homogeneous\"><rgb name=\"albedo\" value=\".5 1.5 .5\"/></medium>", 54,
             "out of its range 0 <= albedo <= 1"},
        Case{"NotOneOfTheNames",
             "<bsdf type=\"roughplastic\"><string name=\"distribution\" value=\"gxx\"/></bsdf>", 62,
             "did you mean 'ggx'?"},
        Case{"UnknownMaterial", "<bsdf type=\"dielectric\"><string name=\"int_ior\" value=\"watr\"/></bsdf>",
             55, "did you mean 'water'?"},
        Case{"UnknownMetal", "<bsdf type=\"conductor\"><string name=\"material\" value=\"Agg\"/></bsdf>", 55,
             "there is no metal \"Agg\""},
        Case{"MaterialAndEta",
             "<bsdf type=\"conductor\"><string name=\"material\" value=\"Ag\"/><rgb name=\"eta\" "
             "value=\"1\"/></bsdf>",
             25, "both"},
        Case{"ParameterTwice",
             shape_xml("<float name=\"radius\" value=\"1\"/><float name=\"radius\" value=\"2\"/>"), 67,
             "twice; first in line 2"},
        Case{"ColourWithTwoParts",
             "<emitter type=\"constant\"><rgb name=\"radiance\" value=\"1 2\"/></emitter>", 54, "wants"},
        Case{"SpectralCurve", "<emitter type=\"area\" id=\"a\"/>", 2, "stands in the shape"},
        Case{"CurveBackwards",
             "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"700:.1 400:.9\"/></bsdf>", 58,
             "in increasing order of their wavelengths"},
        Case{"GridOfNodesThatRepeats",
             "<volume type=\"gridvolume\"><string name=\"filename\" value=\"cloud.vol\"/><boolean "
             "name=\"node_centred\" value=\"true\"/><string name=\"wrap_mode\" value=\"repeat\"/></volume>",
             2, "can only be clamp"},
        Case{"ChannelThatIsNotWritten",
             "<integrator type=\"aov\"><string name=\"aovs\" value=\"dd:depth,u:dp_du\"/><integrator "
             "type=\"path\"/></integrator>",
             51, "the channel \"dp_du\" can't be written by this version; there are albedo, depth,"},
        Case{"ChannelByNumber",
             "<integrator type=\"aov\"><string name=\"aovs\" value=\"i:shape_index\"/><integrator "
             "type=\"path\"/></integrator>",
             51, "--aov shape_id writes mattes"},
        Case{"UnknownChannel",
             "<integrator type=\"aov\"><string name=\"aovs\" value=\"n:sh_norml\"/><integrator "
             "type=\"path\"/></integrator>",
             51, "there is no channel \"sh_norml\"; did you mean 'sh_normal'?"},
        Case{"ChannelWithoutLabel",
             "<integrator type=\"aov\"><string name=\"aovs\" value=\"depth\"/><integrator "
             "type=\"path\"/></integrator>",
             51, "\"depth\" of 'aovs' is not written as label:channel"},
        Case{"WrapperOfNothing", "<integrator type=\"moment\"/>", 2, "needs one nested integrator, not 0"},
        Case{"UnknownReference", shape_xml("<ref id=\"steem\"/>") + "<bsdf type=\"null\" id=\"steam\"/>", 31,
             "no object has the id \"steem\"; did you mean \"steam\" (line 2)?"},
        Case{"ReferenceOfTheWrongKind",
             "<medium type=\"homogeneous\" id=\"m\"/>" + shape_xml("<ref id=\"m\" name=\"foo\"/>"), 75,
             "has no parameter 'foo'"},
        Case{"DuplicateId", "<bsdf type=\"null\" id=\"a\"/><bsdf type=\"null\" id=\"a\"/>", 49,
             "the id \"a\" is given twice; first in line 2"},
        Case{"AliasOfNothing", "<alias id=\"a\" as=\"b\"/>", 12, "nothing before this line has the id \"a\""},
        Case{"CircularReference",
             "<texture type=\"checkerboard\" id=\"t\"><ref name=\"color0\" id=\"t\"/></texture>", 38,
             "contains itself"},
        Case{"CircleOfTwo",
             "<texture type=\"checkerboard\" id=\"t\"><ref name=\"color0\" id=\"u\"/></texture><texture "
             "type=\"checkerboard\" id=\"u\"><ref name=\"color1\" id=\"t\"/></texture>",
             111, "contains itself"},
        Case{"CircularBsdf", "<bsdf type=\"twosided\" id=\"t\"><ref id=\"t\"/></bsdf>", 31,
             "contains itself"},
        Case{"MissingFile", "<shape type=\"obj\"><string name=\"filename\" value=\"gone.obj\"/></shape>", 50,
             "there is no file \"gone.obj\""},
        Case{"MissingParameter", "<shape type=\"obj\"/>", 2, "shape \"obj\" needs 'filename'"},
        Case{"MissingChild", "<bsdf type=\"twosided\"/>", 2, "needs one or two nested bsdfs, not 0"},
        Case{"GlassInTwosided", "<bsdf type=\"twosided\"><bsdf type=\"dielectric\"/></bsdf>", 24,
             "can't stand in \"twosided\""},
        Case{"SecondBsdf", shape_xml("<bsdf type=\"null\"/><bsdf type=\"null\"/>"), 42, "second bsdf"},
        Case{"ObjectWithoutUse", shape_xml("<film type=\"hdrfilm\"/>"), 23, "has no use for a <film>"},
        Case{"PropertyOfTheScene", "<float name=\"x\" value=\"1\"/>", 2, "no parameters"},
        Case{"UndefinedParameter", shape_xml("<float name=\"radius\" value=\"$r\"/>"), 50,
             "the parameter $r is not defined"},
        Case{"StepOutsideTransform", shape_xml("<scale value=\"2\"/>"), 23, "a step of a <transform>"},
        Case{"UnknownStep", shape_xml("<transform name=\"to_world\"><scael value=\"2\"/></transform>"), 50,
             "did you mean <scale>?"},
        Case{"ShortMatrix", shape_xml("<transform name=\"to_world\"><matrix value=\"1 2 3\"/></transform>"),
             64, "9 or 16 numbers"},
        Case{"PerspectiveMatrix",
             shape_xml("<transform name=\"to_world\"><matrix value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 "
                       "1\"/></transform>"),
             64, "last row"},
        Case{"RotationWithoutAxis",
             shape_xml("<transform name=\"to_world\"><rotate angle=\"3\"/></transform>"), 50,
             "needs an axis"},
        Case{
            "LookatNowhere",
            shape_xml("<transform name=\"to_world\"><lookat origin=\"1 1 1\" target=\"1 1 1\"/></transform>"),
            50, "no direction"},
        Case{"Flattened",
             "<shape type=\"cube\"><transform name=\"to_world\"><scale z=\"0\"/></transform></shape>", 2,
             "flattens"},
        Case{"StretchedSphere", shape_xml("<transform name=\"to_world\"><scale x=\"2\"/></transform>"), 2,
             "stretches"},
        Case{"Overflow",
             shape_xml("<transform name=\"to_world\"><scale x=\"1e200\"/><scale x=\"1e200\"/></transform>"),
             68, "range of numbers"},
        Case{"BeamWiderThanCutoff",
             "<emitter type=\"spot\"><float name=\"beam_width\" value=\"30\"/></emitter>", 2, "wider"},
        Case{"DirectionTwice",
             "<emitter type=\"directional\"><vector name=\"direction\" x=\"0\" y=\"0\" z=\"1\"/><transform "
             "name=\"to_world\"/></emitter>",
             2, "both"},
        Case{"DirectionZero",
             "<emitter type=\"directional\"><vector name=\"direction\" x=\"0\" y=\"0\" z=\"0\"/></emitter>",
             2, "zero"},
        Case{"VectorWithoutZ",
             "<emitter type=\"directional\"><vector name=\"direction\" x=\"0\" y=\"0\"/></emitter>", 30,
             "needs x, y and z"},
        Case{"TwoEnvironments", "<emitter type=\"constant\"/><emitter type=\"constant\"/>", 28,
             "second environment"},
        Case{"TwoIntegrators", "<integrator type=\"path\"/><integrator type=\"path\"/>", 27,
             "second integrator"},
        Case{"ZeroSizeFilm",
             "<sensor type=\"perspective\"><film type=\"hdrfilm\"><integer name=\"width\" "
             "value=\"0\"/></film></sensor>",
             78, "1 <= width"},
        Case{"HugeFilm",
             "<sensor type=\"perspective\"><film type=\"hdrfilm\"><integer name=\"width\" "
             "value=\"30000\"/><integer name=\"height\" value=\"30000\"/></film></sensor>",
             29, "larger than"},
        Case{"TooManySamples",
             "<sensor type=\"perspective\"><sampler type=\"independent\"><integer name=\"sample_count\" "
             "value=\"9999999999\"/></sampler></sensor>",
             92, "sample_count"},
        Case{"ThinLensWithoutAperture", "<sensor type=\"thinlens\"/>", 2, "needs 'aperture_radius'"},
        Case{"SecondSceneElement", "<scene version=\"3.0.0\"/>", 2, "can't stand in"},
        Case{"TextInside", shape_xml("hello"), 2, "text inside <shape>"},
        Case{"DeepNesting", deep(80), 63 * 19 + 2, "nested more than 64 deep"},
        Case{"MissingInclude", "<include filename=\"gone.xml\"/>", 20, "there is no file \"gone.xml\""},
        Case{"MismatchedTag", "<shape type=\"cube\"></shap>", 22, "malformed XML"},
        Case{"UnclosedQuote", "<shape type=\"cube/>", 13,
             "malformed XML: the quote \" that opens here is not closed"},
        Case{"UnclosedQuoteAfterComment", "<!-- don't --><shape type='cube/>", 27,
             "the quote ' that opens here"},
        Case{"SensorMediumMisnamed",
             "<medium type=\"homogeneous\" id=\"m\"/><sensor type=\"perspective\"><ref name=\"medum\" "
             "id=\"m\"/></sensor>",
             74, "did you mean 'medium'?"},
        Case{"SensorWithTwoMedia",
             "<medium type=\"homogeneous\" id=\"m\"/><sensor type=\"perspective\"><ref name=\"medium\" "
             "id=\"m\"/><ref id=\"m\"/></sensor>",
             91, "second medium"},
        Case{"UnknownSampler", "<sensor type=\"perspective\"><sampler type=\"stratfied\"/></sensor>", 43,
             "there is no sampler \"stratfied\"; did you mean 'stratified'?"},
        Case{"FilmThatNoSensorUses",
             "<film type=\"hdrfilm\" id=\"f\"><integer name=\"widht\" value=\"3\"/></film>", 44,
             "did you mean 'width'?"},
        Case{"FilterThatNoSensorUses", "<rfilter type=\"bxo\" id=\"f\"/>", 16, "did you mean 'box'?"},
        Case{"SamplerThatNoSensorUses",
             "<sampler type=\"independent\" id=\"s\"><float name=\"sample_count\" value=\"3\"/></sampler>",
             70, "wants an <integer>"},
        Case{"ReflectanceAboveOneByATexture",
             "<texture type=\"uniform\" id=\"t\"><float name=\"value\" value=\"50\"/></texture><bsdf "
             "type=\"diffuse\"><ref name=\"reflectance\" id=\"t\"/></bsdf>",
             96, "'reflectance' of bsdf \"diffuse\" is 50, out of its range 0 <= reflectance <= 1"},
        Case{
            "ReflectanceAboveOneInAPattern",
            "<bsdf type=\"diffuse\"><texture type=\"checkerboard\" name=\"reflectance\"><rgb name=\"color1\" "
            "value=\"0 2 0\"/></texture></bsdf>",
            23, "'reflectance' of bsdf \"diffuse\" is 2, out of its range"},
        Case{"RoughnessAboveOneByATexture",
             "<bsdf type=\"principled\"><texture type=\"uniform\" name=\"roughness\"><float name=\"value\" "
             "value=\"2\"/></texture></bsdf>",
             26, "'roughness' of bsdf \"principled\" is 2, out of its range"},
        Case{"AlbedoAboveOneByAVolume",
             "<medium type=\"heterogeneous\"><volume type=\"constvolume\" name=\"albedo\"><float "
             "name=\"value\" value=\"2\"/></volume></medium>",
             31, "'albedo' of medium \"heterogeneous\" is 2, out of its range 0 <= albedo <= 1"},
        Case{"HomogeneousAlbedoAboveOneByAVolume",
             "<medium type=\"homogeneous\"><volume type=\"constvolume\" name=\"albedo\"><float "
             "name=\"value\" value=\"2\"/></volume></medium>",
             29, "'albedo' of medium \"homogeneous\" is 2, out of its range"},
        Case{"GridInAHomogeneousMedium",
             "<medium type=\"homogeneous\"><volume type=\"gridvolume\" name=\"sigma_t\"><string "
             "name=\"filename\" value=\"cloud.vol\"/></volume></medium>",
             29, "a grid belongs into a medium \"heterogeneous\""},
        Case{"ColourForAPoint", shape_xml("<rgb name=\"center\" value=\"1 2 3\"/>"), 48,
             "'center' of shape \"sphere\" wants a <point> or <vector>, not <rgb> \"1 2 3\""},
        Case{"VectorForAColour",
             "<emitter type=\"constant\"><vector name=\"radiance\" value=\"1 2 3\"/></emitter>", 57,
             "wants a colour, not <vector> \"1 2 3\""},
        Case{"SensorThatScales",
             "<sensor type=\"perspective\"><transform name=\"to_world\"><scale "
             "value=\"2\"/></transform></sensor>",
             2, "to_world of a sensor may only move, turn and mirror"},
        Case{"SensorThatShears",
             "<sensor type=\"perspective\"><transform name=\"to_world\"><matrix value=\"1 0.1 0 0 1 0 0 0 "
             "1\"/></transform></sensor>",
             2, "may only move, turn and mirror"},
        Case{"FlattenedVolume",
             "<volume type=\"gridvolume\"><string name=\"filename\" value=\"cloud.vol\"/><transform "
             "name=\"to_world\"><scale value=\"1e-105\"/></transform></volume>",
             2, "it can't be inverted"},
        Case{"VolumeBeyondNumbers",
             "<volume type=\"gridvolume\"><string name=\"filename\" value=\"cloud.vol\"/><transform "
             "name=\"to_world\"><scale value=\"1e150\"/></transform></volume>",
             2, "it can't be inverted"},
        Case{"SpotBeyondNumbers",
             "<emitter type=\"spot\"><transform name=\"to_world\"><scale "
             "value=\"1e150\"/></transform></emitter>",
             2, "it can't be inverted"},
        Case{
            "ShapeTooSmallToInvert",
            "<shape type=\"cube\"><transform name=\"to_world\"><scale value=\"1e-105\"/></transform></shape>",
            2, "it can't be inverted"},
        Case{"SurrogateCharacter", "<bsdf type=\"null\" id=\"a&#xD800;\"/>", 23,
             "a number that is no character"},
        Case{"CharacterBeyondUnicode", "<bsdf type=\"null\" id=\"&#x110000;\"/>", 23,
             "a number that is no character"},
        Case{"EscapeCharacter", "<bsdf type=\"null\" id=\"&#27;[2J\"/>", 23, "a control character"},
        Case{"RawControlCharacter", "<bsdf type=\"null\" id=\"\x01\"/>", 23, "a control character"},
        Case{"ControlCharacterOfTheUpperHalf", "<bsdf type=\"null\" id=\"&#x9b;2J\"/>", 23,
             "a control character"},
        Case{"ZeroByte", "<bsdf type=\"null\" id=\"a&#x00;b\"/>", 23, "a zero byte"},
        Case{"DepthBeyondTheJobs",
             "<integrator type=\"path\"><integer name=\"max_depth\" value=\"1048577\"/></integrator>", 58,
             "max_depth <= 1048576"},
        Case{"OldCoefficients", "<medium type=\"homogeneous\"><rgb name=\"sigma_s\" value=\"1\"/></medium>",
             39, "'sigma_s': Mitsuba 3 describes media by sigma_t"}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(Diagnostics, AreShownWithTheLineAndACaret) {
  const auto r = read(
      "<scene version=\"3.0.0\">\n  <medium type=\"homogeneous\">\n    <float name=\"sigmat\" "
      "value=\"2\"/>\n  </medium>\n" +
      kSensor + "</scene>");
  EXPECT_EQ(
      messages(r),
      "test.xml:3:18: error: medium \"homogeneous\" has no parameter 'sigmat'; did you mean 'sigma_t'?\n"
      "  3 |     <float name=\"sigmat\" value=\"2\"/>\n"
      "    |                  ^~~~~~\n");
}

TEST(Diagnostics, ColumnsCountCharactersNotBytes) {
  const auto r = read(with_sensor("<!-- äöü --><shpe/>"));
  EXPECT_EQ(r.diagnostics.at(0).place.column, 14);
}

TEST(Diagnostics, PlacesAreRightWhereverTheLinesEnd) {
  std::mt19937 random(5);
  for (const int length : {1, 7, 90, 5000}) {
    std::string text;
    while (text.size() < 40'000) text += std::string(random() % static_cast<unsigned>(length), 'x') + "\n";
    const scene::SourceText source("t", text);
    int line = 1, column = 1;
    for (std::size_t i = 0; i <= text.size(); ++i) {
      ASSERT_EQ(source.line(i), line) << i;
      // Finding a column takes time proportional to the line's length, so only some are tested.
      if (i % 61 == 0 || i == text.size()) {
        ASSERT_EQ(source.place(i), (SourcePlace{"t", line, column})) << i;
      }
      ++column;
      if (i < text.size() && text[i] == '\n') {
        ++line;
        column = 1;
      }
    }
  }
}

TEST(Diagnostics, LongLinesAreCutAroundThePlace) {
  const auto r = read(with_sensor(std::string(1000, ' ') + "<shpe/>" + std::string(1000, ' ')));
  EXPECT_EQ(r.diagnostics.at(0).place.column, 1002);
  EXPECT_THAT(messages(r), HasSubstr("<shpe/>"));
  EXPECT_LT(messages(r).size(), 500u);
}

TEST(Diagnostics, ShowAtMostTwenty) {
  std::string many;
  for (int i = 0; i < 50; ++i)
    many += fmt::format("<shape type=\"sphere\"><float name=\"x{}\" value=\"1\"/></shape>\n", i);
  const auto r = read(with_sensor(many));
  EXPECT_EQ(r.diagnostics.size(), 20u);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(r.diagnostics[static_cast<std::size_t>(i)].place.line, i + 2);
}

TEST(Diagnostics, ManyWarningsDoNotHideAnError) {
  std::string many;
  for (int i = 0; i < 50; ++i)
    many += "<medium type=\"homogeneous\"><boolean name=\"sample_emitters\" value=\"true\"/></medium>\n";
  const auto r = read(with_sensor(many + "<shape type=\"blob\"/>"));
  EXPECT_TRUE(std::any_of(r.diagnostics.begin(), r.diagnostics.end(),
                          [](const Diagnostic& d) { return d.place.line == 52; }));
  EXPECT_LE(r.diagnostics.size(), 20u);
}

TEST(Diagnostics, WholeSceneIsChecked) {
  const auto first = [](const std::string& text) {
    const auto r = read(text);
    return r.diagnostics.empty() ? ""
                                 : fmt::format("{}:{} {}", r.diagnostics[0].place.line,
                                               r.diagnostics[0].place.column, r.diagnostics[0].text);
  };
  EXPECT_THAT(first(""), HasSubstr("1:1 "));
  EXPECT_THAT(first("hello"), HasSubstr("1:"));
  EXPECT_THAT(first("<scene/>"), HasSubstr("1:2 <scene> has no version"));
  EXPECT_THAT(first("<scene version=\"x\"/>"), HasSubstr("1:17 'x' is not a version"));
  EXPECT_THAT(first("<scene version=\"3.0.0\"/>"), HasSubstr("1:2 the scene has no <sensor>"));
  EXPECT_THAT(first("<shape version=\"3.0.0\" type=\"cube\"/>"), HasSubstr("the root must be <scene>"));
  EXPECT_THAT(first("<scene version=\"3.0.0\"/><scene version=\"3.0.0\"/>"), HasSubstr("second root"));
  EXPECT_THAT(first("<scene version=\"3.0.0\">\n  \xff</scene>"), HasSubstr("2:3 this is not UTF-8"));
}

TEST(Diagnostics, TruncatedScenesSayWhereTheyEnd) {
  for (std::size_t n = 0; n + 1 < kExample.size(); n += 7) {
    const auto r = read(kExample.substr(0, n));
    ASSERT_FALSE(r.scene) << n;
    ASSERT_FALSE(r.diagnostics.empty()) << n;
    EXPECT_GT(r.diagnostics[0].place.line, 0) << n;
    EXPECT_GT(r.diagnostics[0].place.column, 0) << n;
  }
}

}  // namespace
}  // namespace ls

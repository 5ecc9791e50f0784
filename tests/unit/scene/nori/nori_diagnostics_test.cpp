// Errors in Nori scenes are reported at their place, in the words of Nori's format.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/scene/nori_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

std::string first(const std::string& objects) {
  const auto r = read(nori_scene(objects));
  return r.diagnostics.empty() ? ""
                               : fmt::format("{}:{} {}", r.diagnostics[0].place.line,
                                             r.diagnostics[0].place.column, r.diagnostics[0].text);
}

TEST(NoriDiagnostics, ShowTheLineWithACaret) {
  const auto r = read(nori_scene(
      R"(<mesh type="sphere"><bsdf type="diffuse"><color name="albdo" value="1 1 1"/></bsdf></mesh>)"));
  EXPECT_EQ(messages(r),
            R"(test.xml:2:55: error: bsdf "diffuse" has no parameter 'albdo'; did you mean 'albedo'?
  2 | <mesh type="sphere"><bsdf type="diffuse"><color name="albdo" value="1 1 1"/></bsdf></mesh>
    |                                                       ^~~~~
)");
}

TEST(NoriDiagnostics, NameUnknownElements) {
  EXPECT_THAT(first(R"(<mesh type="spheer"/>)"),
              HasSubstr("2:13 Nori has no mesh \"spheer\"; did you mean 'sphere'?"));
  EXPECT_THAT(first("<mush type=\"obj\"/>"),
              HasSubstr("2:2 Nori has no element <mush>; did you mean <mesh>?"));
  EXPECT_THAT(first("<sensor type=\"perspective\"/>"), HasSubstr("in Nori it is called <camera>"));
  EXPECT_THAT(first("<mesh typ=\"obj\"/>"), HasSubstr("<mesh> has no attribute 'typ'; did you mean 'type'?"));
  EXPECT_THAT(first("<rfilter type=\"box\"/>"), HasSubstr("a <rfilter> can't stand in <scene>"));
  EXPECT_THAT(first(R"(<mesh type="sphere"><camera type="perspective"/></mesh>)"),
              HasSubstr("mesh \"sphere\" has no use for a <camera>"));
  EXPECT_THAT(first(R"(<emitter type="spotlight"/>)"),
              HasSubstr("is not supported: its falloff differs between versions of Nori"));
}

TEST(NoriDiagnostics, NameWhatIsWrongWithAnObjectWithoutUse) {
  const auto diffuse = [](const std::string& inside) {
    return first(R"(<mesh type="sphere"><bsdf type="diffuse">)" + inside + "</bsdf></mesh>");
  };
  EXPECT_THAT(diffuse(R"(<texture type="solid"/>)"),
              HasSubstr("2:57 Nori has no texture \"solid\"; known here"));
  EXPECT_THAT(diffuse(R"(<texture type="constant_color"/>)"),
              HasSubstr("bsdf \"diffuse\" has no use for a <texture> without a name: call it 'albedo'"));
  EXPECT_THAT(diffuse(R"(<texture type="constant_color" name="kd"/>)"),
              HasSubstr("bsdf \"diffuse\" has no use for a <texture> called 'kd': call it 'albedo'"));
}

TEST(NoriDiagnostics, NameWrongTypesAndRanges) {
  const auto sphere = [](const std::string& inside) {
    return first("<mesh type=\"sphere\">" + inside + "</mesh>");
  };
  EXPECT_THAT(sphere(R"(<string name="radius" value="x"/>)"),
              HasSubstr("'radius' of mesh \"sphere\" wants <float>, not <string> \"x\""));
  EXPECT_THAT(sphere(R"(<float name="radius" value="one"/>)"), HasSubstr("not <float> \"one\""));
  EXPECT_THAT(sphere(R"(<float name="radius" value="-1"/>)"),
              HasSubstr("is -1, out of its range 0 < radius"));
  EXPECT_THAT(sphere(R"(<point name="center" value="1 2"/>)"), HasSubstr("wants three numbers"));
  EXPECT_THAT(sphere(R"(<float name="radius" value="1"/><float name="radius" value="1"/>)"),
              HasSubstr("is given 'radius' twice"));
  EXPECT_THAT(sphere(R"(<bsdf type="diffuse"><color name="albedo" value="1 2 0"/></bsdf>)"),
              HasSubstr("out of its range 0 <= albedo <= 1"));
  EXPECT_THAT(
      sphere(
          R"(<bsdf type="microfacet"><texture type="constant_color" name="kd"><color name="value" value="2 0 0"/></texture></bsdf>)"),
      HasSubstr("'kd' of bsdf \"microfacet\" is 2, out of its range"));
  EXPECT_THAT(sphere(R"(<bsdf type="conductor"/>)"), HasSubstr("bsdf \"conductor\" needs 'eta'"));
  EXPECT_THAT(sphere(R"(<bsdf type="mirror"/><bsdf type="mirror"/>)"), HasSubstr("has a second bsdf"));
  EXPECT_THAT(sphere(R"(<transform name="toWorld"><rotate angle="9" axis="0 0 0"/></transform>)"),
              HasSubstr("an axis that is not zero"));
  EXPECT_THAT(sphere(R"(<transform name="toWorld"><translate value="1 2"/></transform>)"),
              HasSubstr("'value' of <translate> wants 3 numbers"));
}

TEST(NoriDiagnostics, NameImpossibleMedia) {
  const auto medium = [](const std::string& type, const std::string& inside) {
    return first(fmt::format(
        R"(<mesh type="obj"><string name="filename" value="mesh.obj"/><medium type="{}">{}</medium></mesh>)",
        type, inside));
  };
  EXPECT_THAT(medium("homogeneous", ""), HasSubstr("needs its coefficients"));
  EXPECT_THAT(
      medium("homogeneous", R"(<color name="sigma_a" value="1 1 1"/><color name="sigma_t" value="1 1 1"/>)"),
      HasSubstr("gives both"));
  EXPECT_THAT(medium("heterogeneous",
                     R"(<string name="filename" value="cloud.vol"/><color name="sigma_a" value="1 1 1"/>)"),
              HasSubstr("fills the bounding box of its mesh"));
  EXPECT_THAT(medium("heterogeneous",
                     R"(<string name="filename" value="steam.vdb"/><color name="sigma_a" value="1 2 1"/>)"),
              HasSubstr("it can only be the same in all channels"));
}

TEST(NoriDiagnostics, WarnAboutUnusedParameters) {
  const auto warning = [](const std::string& text) {
    const auto r = read(text);
    EXPECT_TRUE(r.scene) << messages(r);
    EXPECT_FALSE(read(text, {.strict = true}).scene);
    return messages(r);
  };
  EXPECT_THAT(warning(nori_scene("<denoiser type=\"bilateral\"/>")),
              HasSubstr("<denoiser> has no effect here"));
  EXPECT_THAT(warning(nori_scene("<sampler type=\"stratified\"/>")),
              HasSubstr("only the number of samples is used"));
  EXPECT_THAT(
      warning(
          R"(<scene><integrator type="photonmapper"><integer name="photonCount" value="9"/></integrator><camera type="perspective"/></scene>)"),
      HasSubstr("'photonCount' of integrator \"photonmapper\" has no effect here"));
}

TEST(NoriDiagnostics, SayThatMitsubaFilesNeedAVersion) {
  EXPECT_THAT(messages(read("<scene><shape type=\"cube\"/></scene>")), HasSubstr("<scene> has no version"));
  EXPECT_THAT(messages(read("<test type=\"ttest\"/>")), HasSubstr("run it by lightshaft validate FILE"));
  EXPECT_THAT(messages(read("<scene><mesh type=\"sphere\"/></scene>")),
              HasSubstr("the scene has no <camera>"));
}

// No misspelt name is ignored: a letter added to any name of the example gives an error in that line.
TEST(NoriDiagnostics, MisspeltNameIsAnErrorInItsLine) {
  int tried = 0;
  for (const std::string key : {"name=\"", "type=\"", "<"})
    for (std::size_t at = kNoriExample.find(key); at != std::string::npos;
         at = kNoriExample.find(key, at + 1)) {
      const std::size_t name = at + key.size();
      if (std::string("/?!").find(kNoriExample[name]) != std::string::npos) continue;
      std::string text = kNoriExample;
      std::size_t end = name;
      while (std::isalnum(static_cast<unsigned char>(text[end])) || text[end] == '_') ++end;
      text.insert(end, "q");
      const auto until = text.begin() + static_cast<std::ptrdiff_t>(name);
      const auto line = static_cast<int>(std::count(text.begin(), until, '\n')) + 1;
      const auto r = read(text);
      ++tried;
      EXPECT_FALSE(r.scene) << text.substr(at, 30);
      const auto told = [&](const Diagnostic& d) { return d.place.line == line; };
      EXPECT_TRUE(key == "<" || std::any_of(r.diagnostics.begin(), r.diagnostics.end(), told))
          << text.substr(at, 30) << "\n"
          << messages(r);
      for (const Diagnostic& d : r.diagnostics) EXPECT_GT(d.place.line, 0);
    }
  EXPECT_GT(tried, 150);
}

TEST(NoriDiagnostics, TruncatedSceneIsReportedWithItsEnd) {
  for (std::size_t n = 0; n + 1 < kNoriExample.size(); n += 11) {
    const auto r = read(kNoriExample.substr(0, n));
    ASSERT_FALSE(r.scene) << n;
    ASSERT_FALSE(r.diagnostics.empty()) << n;
    EXPECT_GT(r.diagnostics[0].place.line, 0) << n;
  }
}

}  // namespace
}  // namespace ls

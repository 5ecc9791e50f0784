// Parts of a scene that have no effect here give warnings, or errors with --strict.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/diagnostic.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

std::string shape(const std::string& inside) { return "<shape type=\"sphere\">" + inside + "</shape>"; }

TEST(Warnings, ParametersWithoutEffectAreWarningsAndErrorsWhenStrict) {
  const std::string text =
      with_sensor("<bsdf type=\"roughplastic\"><boolean name=\"sample_visible\" value=\"true\"/></bsdf>");
  const auto r = read(text);
  ASSERT_TRUE(r.scene);
  ASSERT_EQ(r.diagnostics.size(), 1u);
  EXPECT_EQ(r.diagnostics[0].severity, Diagnostic::Severity::warning);
  EXPECT_THAT(r.diagnostics[0].text,
              HasSubstr("'sample_visible' of bsdf \"roughplastic\" has no effect here"));

  const auto strict = read(text, {.strict = true});
  EXPECT_FALSE(strict.scene);
  EXPECT_EQ(strict.diagnostics.at(0).severity, Diagnostic::Severity::error);
}

TEST(Warnings, ZeroRoughnessBecomesTheMinimum) {
  const std::string checks =
      "<texture name=\"alpha\" type=\"checkerboard\"><float name=\"color0\" value=\"0\"/><float "
      "name=\"color1\" "
      "value=\".4\"/></texture>";
  for (const std::string& bsdf :
       {"<bsdf type=\"roughdielectric\">" + checks + "</bsdf>",
        std::string("<bsdf type=\"roughconductor\"><float name=\"alpha_u\" value=\"0\"/></bsdf>"),
        std::string("<bsdf type=\"roughplastic\"><float name=\"alpha\" value=\"0\"/></bsdf>")}) {
    const auto r = read(with_sensor(shape(bsdf) + "<emitter type=\"constant\"/>"));
    ASSERT_TRUE(r.scene) << messages(r);
    ASSERT_EQ(r.diagnostics.size(), 1u) << messages(r);
    EXPECT_THAT(r.diagnostics[0].text, HasSubstr("is 0, which is read as the least roughness, 0.0001"));
    if (const auto* plastic = std::get_if<RoughPlasticBsdf>(&r.scene->bsdfs[0])) {
      EXPECT_EQ(plastic->alpha, 1e-4);
    }
  }
}

TEST(Warnings, FieldsWithoutEffectCauseAWarning) {
  const struct {
    std::string sensor, objects, said;
  } rows[] = {
      {"<float name=\"focus_distance\" value=\"3\"/>", "",
       "'focus_distance' of sensor \"perspective\" has no effect here"},
      {"<string name=\"fov_axis\" value=\"y\"/>", "",
       "'fov_axis' of sensor \"perspective\" has no effect here"},
      {"", "<emitter type=\"constant\"><transform name=\"to_world\"/></emitter>",
       "'to_world' of emitter \"constant\" has no effect here"},
  };
  for (const auto& row : rows) {
    const auto r = read("<scene version=\"3.0.0\">" + row.objects + "<sensor type=\"perspective\">" +
                        row.sensor + "</sensor></scene>");
    EXPECT_TRUE(r.scene) << messages(r);
    ASSERT_EQ(r.diagnostics.size(), 1u) << row.said;
    EXPECT_THAT(r.diagnostics[0].text, HasSubstr(row.said));
  }
  // With a fov, fov_axis has an effect.
  EXPECT_TRUE(read("<scene version=\"3.0.0\"><sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/>"
                   "<string name=\"fov_axis\" value=\"y\"/></sensor></scene>")
                  .diagnostics.empty());
}

TEST(Warnings, DefinedValuesMustBeText) {
  const std::string text = with_sensor("<default name=\"f\" value=\"b\"/><bsdf type=\"null\" id=\"$f\"/>");
  EXPECT_TRUE(read(text, {.defines = {{"f", "ä b"}}}).scene);
  for (const char* bad : {"\xff", "a\x1b[2J", "\xed\xa0\x80"}) {
    const auto r = read(text, {.defines = {{"f", bad}}});
    EXPECT_FALSE(r.scene);
    EXPECT_EQ(r.diagnostics.at(0).place, (SourcePlace{"test.xml", 2, 52}));
    EXPECT_THAT(r.diagnostics.at(0).text, HasSubstr("no UTF-8 text, or control characters"));
  }
}

TEST(Warnings, UnusedDefinesCauseAWarning) {
  const std::string used =
      "<default name=\"radius\" value=\"1\"/>" + shape("<float name=\"radius\" value=\"$radius\"/>");
  EXPECT_TRUE(read(with_sensor(used), {.defines = {{"radius", "2"}}}).diagnostics.empty());

  const auto r = read(with_sensor(used), {.defines = {{"radus", "2"}}});
  ASSERT_TRUE(r.scene);
  ASSERT_EQ(r.diagnostics.size(), 1u);
  EXPECT_EQ(r.diagnostics[0].severity, Diagnostic::Severity::warning);
  EXPECT_EQ(r.diagnostics[0].place, (SourcePlace{"test.xml", 1, 2}));
  EXPECT_EQ(r.diagnostics[0].text,
            "nothing in the scene asks for $radus, which was defined for it; did you mean 'radius'?");

  EXPECT_FALSE(read(with_sensor(used), {.defines = {{"radus", "2"}}, .strict = true}).scene);
  EXPECT_THAT(messages(read(with_sensor(used), {.defines = {{"z", "2"}}})), HasSubstr("known here: radius"));
  EXPECT_THAT(messages(read(with_sensor(""), {.defines = {{"z", "2"}}})), HasSubstr("it has no parameters"));
  // The parameter has a <default>, but no value uses it.
  EXPECT_THAT(messages(read(with_sensor("<default name=\"n\" value=\"1\"/>"), {.defines = {{"n", "2"}}})),
              HasSubstr("asks for $n"));
}

TEST(Warnings, SubstitutedIntegratorsCauseAWarning) {
  const auto read_integrator = [](const std::string& inside) { return read(with_sensor(inside)); };
  const auto mlt = read_integrator(
      "<integrator type=\"mlt\"><integer name=\"max_depth\" value=\"7\"/><integer "
      "name=\"direct_samples\" value=\"16\"/></integrator>");
  ASSERT_TRUE(mlt.scene) << messages(mlt);
  EXPECT_EQ(mlt.scene->integrator, (IntegratorSettings{.name = "volpath", .max_depth = 7}));
  ASSERT_EQ(mlt.diagnostics.size(), 2u);
  EXPECT_THAT(mlt.diagnostics[0].text, HasSubstr("integrator \"mlt\" is read as \"volpath\""));
  EXPECT_THAT(mlt.diagnostics[1].text,
              HasSubstr("'direct_samples' of integrator \"mlt\" has no effect here"));

  for (const char* wrapper : {"moment", "aov", "adaptive", "irrcache"}) {
    const auto r = read_integrator(fmt::format(
        "<integrator type=\"{}\"><integrator type=\"direct\" name=\"inner\"/></integrator>", wrapper));
    ASSERT_TRUE(r.scene) << messages(r);
    EXPECT_EQ(r.scene->integrator, (IntegratorSettings{.name = "path", .max_depth = 2}));
    ASSERT_EQ(r.diagnostics.size(), 1u);
    EXPECT_THAT(r.diagnostics[0].text,
                HasSubstr(fmt::format("only the integrator within integrator \"{}\" is used", wrapper)));
  }
}

TEST(Warnings, OtherSamplersOnlyGiveTheSampleCount) {
  const auto r = read(
      "<scene version=\"3.0.0\"><sensor type=\"perspective\"><sampler type=\"multijitter\"><integer "
      "name=\"sample_count\" value=\"9\"/></sampler></sensor></scene>");
  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(r.scene->sample_count, 9u);
  ASSERT_EQ(r.diagnostics.size(), 1u);
  EXPECT_THAT(r.diagnostics[0].text,
              HasSubstr("of sampler \"multijitter\" only the number of samples is used"));
}

TEST(Warnings, MediumBehindAnOpaqueDefaultIsAWarning) {
  const auto r =
      read(with_sensor("<medium type=\"homogeneous\" id=\"m\"/><shape type=\"cube\"><ref name=\"interior\" "
                       "id=\"m\"/></shape>"));
  ASSERT_TRUE(r.scene);
  EXPECT_THAT(r.diagnostics.at(0).text, HasSubstr("<bsdf type=\"null\"/>"));
}

// The camera of kSensor is at the origin.
TEST(Warnings, CameraInAnUnnamedMediumCausesAWarning) {
  const std::string fog = "<medium type=\"homogeneous\" id=\"fog\"/>";
  const auto body = [](const std::string& type, const std::string& inside, const std::string& to_world) {
    return "<shape type=\"" + type + "\"><bsdf type=\"null\"/><ref name=\"" + inside +
           "\" id=\"fog\"/><transform name=\"to_world\">" + to_world + "</transform></shape>";
  };
  const struct {
    std::string shape;
    bool told;
  } rows[] = {
      {body("cube", "interior", ""), true},
      {body("sphere", "interior", "<scale value=\"2\"/><translate x=\"1.9\"/>"), true},
      {body("sphere", "interior", "<scale value=\"2\"/><translate x=\"2.1\"/>"), false},
      {body("cube", "interior", "<rotate z=\"1\" angle=\"45\"/><translate x=\"1.3\"/>"), true},
      {body("cube", "interior", "<rotate z=\"1\" angle=\"45\"/><translate x=\"1.3\" y=\"1.3\"/>"), false},
      {body("cube", "exterior", ""), false},
      {body("rectangle", "interior", ""), false},
  };
  for (const auto& row : rows) {
    const auto r = read(with_sensor(fog + row.shape));
    ASSERT_TRUE(r.scene) << row.shape;
    ASSERT_EQ(r.diagnostics.size(), row.told ? 1u : 0u) << row.shape;
    if (!row.told) continue;
    EXPECT_THAT(r.diagnostics[0].text, HasSubstr("that holds a medium"));
    EXPECT_THAT(r.diagnostics[0].text, HasSubstr("add <ref name=\"medium\" id=\"fog\"/>"));
  }
}

TEST(Warnings, FiltersOfNegativeLobesBecomeGaussians) {
  for (const std::string filter :
       {"<rfilter type=\"mitchell\"><float name=\"A\" value=\"0.3\"/><float name=\"B\" "
        "value=\"0.3\"/></rfilter>",
        "<rfilter type=\"lanczos\"><integer name=\"lobes\" value=\"3\"/></rfilter>",
        "<rfilter type=\"catmullrom\"/>"}) {
    const auto r = read("<scene version=\"3.0.0\"><sensor type=\"perspective\"><film type=\"hdrfilm\">" +
                        filter + "</film></sensor></scene>");

    ASSERT_TRUE(r.scene) << messages(r);
    EXPECT_EQ(r.scene->film.filter, ReconstructionFilter(GaussianFilter{}));
    EXPECT_THAT(first(r), HasSubstr("is read as \"gaussian\""));
  }
}

// Mitsuba 3 takes a homogeneous medium whose albedo is a grid: its density has no bounds.
TEST(Warnings, HomogeneousMediumMayHaveAGridOfAlbedos) {
  const auto with = [](std::string_view sigma_t) {
    return read(with_sensor(fmt::format(R"(
<volume type="gridvolume" id="a"><string name="filename" value="cloud.vol"/></volume>
<medium type="homogeneous" id="m">{}<ref name="albedo" id="a"/><float name="scale" value="3"/></medium>
<shape type="cube"><bsdf type="null"/><ref name="interior" id="m"/></shape>)",
                                        sigma_t)));
  };
  const auto r = with(R"(<rgb name="sigma_t" value="2 3 4"/>)");

  ASSERT_TRUE(r.scene) << messages(r);
  const auto& medium = std::get<HeterogeneousMedium>(r.scene->media.at(0));
  const auto& density = std::get<ConstVolume>(r.scene->volumes.at(medium.sigma_t.value));
  EXPECT_EQ(density.value, (Rgb{2, 3, 4}));
  EXPECT_EQ(density.to_world.m[0], 2e9);
  EXPECT_EQ(density.to_world.m[3], -1e9);
  EXPECT_EQ(medium.scale, 3);
  EXPECT_TRUE(std::holds_alternative<GridVolume>(r.scene->volumes.at(medium.albedo.value)));
  EXPECT_THAT(first(with(R"(<ref name="sigma_t" id="a"/>)")), HasSubstr("is the same everywhere"));
}

}  // namespace
}  // namespace ls

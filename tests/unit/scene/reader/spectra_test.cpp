// Spectra given as objects, and shapes of the type "merge".
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/spectrum.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

Rgb intensity(const std::string& value) {
  const Scene s = must_read(with_sensor("<emitter type=\"point\">" + value + "</emitter>"));
  return std::get<PointEmitter>(s.emitters.at(0)).intensity;
}
Rgb reflectance(const std::string& value) {
  const Scene s =
      must_read(with_sensor("<shape type=\"sphere\"><bsdf type=\"diffuse\">" + value + "</bsdf></shape>"));
  return std::get<ConstantTexture>(s.textures.at(std::get<DiffuseBsdf>(s.bsdfs.at(0)).reflectance.value))
      .value;
}
std::string refusal(const std::string& objects) {
  const ReadResult r = read(with_sensor(objects));
  EXPECT_FALSE(r.scene);
  return messages(r);
}

const std::string kPairs = "value=\"400:0.1, 500:0.3, 600:0.2\"/>";
const std::string kIrregular =
    "<string name=\"wavelengths\" value=\"400, 500, 600\"/><string name=\"values\" value=\".1, .3 "
    ".2\"/></spectrum>";
const std::string kRegular =
    "<float name=\"wavelength_min\" value=\"400\"/><float name=\"wavelength_max\" value=\"600\"/>"
    "<string name=\"values\" value=\".1, .3 .2\"/></spectrum>";

TEST(Spectrum, PairsEqualAnObject) {
  for (const std::string& inside : {"\"irregular\">" + kIrregular, "\"regular\">" + kRegular}) {
    EXPECT_EQ(intensity("<spectrum name=\"intensity\" type=" + inside),
              intensity("<spectrum name=\"intensity\" " + kPairs));
    EXPECT_EQ(reflectance("<spectrum name=\"reflectance\" type=" + inside),
              reflectance("<spectrum name=\"reflectance\" " + kPairs));
  }
}

TEST(Spectrum, SharedSpectrumDependsOnItsUse) {
  const Scene s = must_read(with_sensor(
      "<spectrum id=\"s\" type=\"irregular\">" + kIrregular +
      "<emitter type=\"point\"><ref name=\"intensity\" id=\"s\"/></emitter>"
      "<shape type=\"sphere\"><bsdf type=\"diffuse\"><ref name=\"reflectance\" id=\"s\"/></bsdf></shape>"));
  EXPECT_EQ(std::get<PointEmitter>(s.emitters[0]).intensity,
            intensity("<spectrum name=\"intensity\" " + kPairs));
  EXPECT_EQ(std::get<ConstantTexture>(s.textures[0]).value,
            reflectance("<spectrum name=\"reflectance\" " + kPairs));
}

TEST(Spectrum, D65IsWhite) {
  EXPECT_EQ(intensity("<spectrum name=\"intensity\" type=\"d65\"/>"), (Rgb{1, 1, 1}));
  EXPECT_EQ(intensity("<spectrum name=\"intensity\" type=\"d65\"><rgb name=\"color\" value=\"1 2 3\"/>"
                      "<float name=\"scale\" value=\"2\"/></spectrum>"),
            (Rgb{2, 4, 6}));
}

// At 1500 K the blue channel would be negative, and is clamped to 0.
TEST(Spectrum, BlackbodyIsLightInTheUnitsOfAMedium) {
  const auto light = [](const char* kelvin) {
    return intensity(
        fmt::format("<spectrum name=\"intensity\" type=\"blackbody\"><float name=\"temperature\" "
                    "value=\"{}\"/></spectrum>",
                    kelvin));
  };
  EXPECT_EQ(light("6500"), scene::linear_srgb(scene::black_body_xyz(6500)));
  EXPECT_NEAR(light("1500")[0], .35, .005);  // the figure of docs/reference/scene-format.md
  EXPECT_EQ(light("1500")[2], 0);
  EXPECT_THAT(refusal("<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" type=\"blackbody\">"
                      "<float name=\"temperature\" value=\"5000\"/></spectrum></bsdf>"),
              HasSubstr("is no light: it can't be a \"blackbody\""));
}

TEST(Spectrum, ErrorIsReportedOnceWithItsPlace) {
  const auto of = [](const std::string& type, const std::string& inside) {
    return refusal("<emitter type=\"point\"><spectrum name=\"intensity\" type=\"" + type + "\">" + inside +
                   "</spectrum></emitter>");
  };
  EXPECT_THAT(of("irregular", "<string name=\"values\" value=\"1 2\"/>"), HasSubstr("needs 'wavelengths'"));
  EXPECT_THAT(of("irregular",
                 "<string name=\"values\" value=\"1 2\"/><string name=\"wavelengths\" value=\"1 2 3\"/>"),
              HasSubstr("has 3 wavelengths and 2 values"));
  EXPECT_THAT(
      of("irregular", "<string name=\"values\" value=\"1 2\"/><string name=\"wavelengths\" value=\"2 1\"/>"),
      HasSubstr("must increase"));
  EXPECT_THAT(
      of("irregular", "<string name=\"values\" value=\"1\"/><string name=\"wavelengths\" value=\"2\"/>"),
      HasSubstr("wants a <string> of 2 to 4096 numbers"));
  EXPECT_THAT(of("regular", "<string name=\"values\" value=\"1 2\"/>"), HasSubstr("needs 'wavelength_min'"));
  EXPECT_THAT(of("blackbody", ""), HasSubstr("needs 'temperature'"));
  EXPECT_THAT(of("blackbody", "<float name=\"temperature\" value=\"0\"/>"), HasSubstr("out of its range"));
  EXPECT_THAT(of("d65", "<float name=\"scal\" value=\"1\"/>"), HasSubstr("did you mean 'scale'?"));
  EXPECT_THAT(of("d65", "<float name=\"scale\" value=\"-1\"/>"), HasSubstr("out of its range"));
  EXPECT_THAT(of("d65", "<rgb name=\"color\" value=\"1e300\"/><float name=\"scale\" value=\"1e300\"/>"),
              HasSubstr("brighter than numbers go"));
}

TEST(RawConstant, IsOneNumberOrThree) {
  EXPECT_EQ(reflectance("<texture name=\"reflectance\" type=\"rawconstant\"><float name=\"value\" "
                        "value=\".3\"/></texture>"),
            (Rgb{.3, .3, .3}));
  EXPECT_EQ(reflectance("<texture name=\"reflectance\" type=\"rawconstant\"><vector name=\"value\" "
                        "value=\".5 1 .3\"/></texture>"),
            (Rgb{.5, 1, .3}));
  EXPECT_EQ(intensity("<spectrum name=\"intensity\" type=\"rawconstant\"><vector name=\"value\" value=\"5 1 "
                      "3\"/></spectrum>"),
            (Rgb{5, 1, 3}));
  EXPECT_THAT(refusal("<texture type=\"rawconstant\"/>"), HasSubstr("texture \"rawconstant\" needs 'value'"));
  EXPECT_THAT(refusal("<texture type=\"rawconstant\"><vector name=\"value\" value=\"1 -2 3\"/></texture>"),
              HasSubstr("out of its range"));
}

TEST(Colour, MayBeAConstantTexture) {
  EXPECT_EQ(
      intensity("<texture name=\"intensity\" type=\"uniform\"><float name=\"value\" value=\"3\"/></texture>"),
      (Rgb{3, 3, 3}));
  EXPECT_THAT(
      refusal("<emitter type=\"point\"><texture name=\"intensity\" type=\"checkerboard\"/></emitter>"),
      HasSubstr("'intensity' of emitter \"point\" is the same everywhere: a texture \"checkerboard\" can't "
                "be one"));
}

const std::string kMesh = "<shape type=\"ply\"><string name=\"filename\" value=\"mesh.ply\"/></shape>";
const std::string kOther = "<shape type=\"obj\"><string name=\"filename\" value=\"mesh.obj\"/></shape>";

TEST(Merge, MergedShapesEqualTheirParts) {
  EXPECT_EQ(serialize(must_read(with_sensor("<shape type=\"merge\">" + kMesh + kOther + "</shape>"))),
            serialize(must_read(with_sensor(kMesh + kOther))));
  const std::string instance = "<shape type=\"instance\"><shape type=\"shapegroup\">{}</shape></shape>";
  EXPECT_EQ(serialize(must_read(with_sensor(fmt::format(
                fmt::runtime(instance), "<shape type=\"merge\">" + kMesh + kOther + "</shape>")))),
            serialize(must_read(with_sensor(fmt::format(fmt::runtime(instance), kMesh + kOther)))));
}

TEST(Merge, MayNotBeNestedOrReused) {
  EXPECT_THAT(refusal("<shape type=\"merge\" id=\"m\">" + kMesh + "</shape><ref id=\"m\"/>"),
              HasSubstr("is used twice"));
  EXPECT_THAT(refusal("<shape type=\"merge\" id=\"m\"><ref id=\"m\"/></shape>"),
              HasSubstr("can't stand in another"));
  EXPECT_THAT(
      refusal(
          "<shape type=\"shapegroup\"><shape type=\"merge\"><shape type=\"shapegroup\"/></shape></shape>"),
      HasSubstr("can't stand in a shapegroup"));
  EXPECT_THAT(refusal("<shape type=\"merge\"><float name=\"x\" value=\"1\"/></shape>"),
              HasSubstr("no parameter 'x'"));
}

}  // namespace
}  // namespace ls

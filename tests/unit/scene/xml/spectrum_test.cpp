// Compares the colours of spectral curves with published ones.
#include "core/scene/spectrum.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/cie.h"
#include "core/scene/diagnostic.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using scene::Illuminant;
using scene::linear_srgb;
using scene::SpectralCurve;
using ::testing::HasSubstr;

struct Xyy {
  double x, y, luminance;
};
// Converts linear sRGB to x, y and Y by the matrix of BT.709. It has six digits, so converting XYZ to sRGB
// and back changes a value by up to 2e-6.
Xyy xyy(const Rgb& c) {
  const double x = .412453 * c[0] + .357580 * c[1] + .180423 * c[2],
               y = .212671 * c[0] + .715160 * c[1] + .072169 * c[2],
               z = .019334 * c[0] + .119193 * c[1] + .950227 * c[2];
  return {x / (x + y + z), y / (x + y + z), y};
}

Rgb reflectance(const std::string& value, const char* version = "3.0.0") {
  const Scene s =
      must_read(fmt::format("<scene version=\"{}\"><shape type=\"cube\"><bsdf type=\"diffuse\"><spectrum "
                            "name=\"reflectance\" value=\"{}\"/></bsdf></shape>{}</scene>",
                            version, value, kSensor));
  const auto& bsdf = std::get<DiffuseBsdf>(s.bsdfs.at(0));
  return std::get<ConstantTexture>(s.textures.at(bsdf.reflectance.value)).value;
}
Rgb radiance(const std::string& value, const char* version = "3.0.0") {
  const Scene s =
      must_read(fmt::format("<scene version=\"{}\"><emitter type=\"constant\"><spectrum name=\"radiance\" "
                            "value=\"{}\"/></emitter>{}</scene>",
                            version, value, kSensor));
  return std::get<ConstantEmitter>(s.emitters.at(0)).radiance;
}
void expect_near(const Rgb& got, const Rgb& want, double relative) {
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(got[i], want[i], relative * std::abs(want[i])) << "part " << i;
}

// Tolerance: the CIE tables and the published chromaticities have at least four digits.
constexpr double kPublished = 1e-4;

TEST(Spectra, EqualEnergyIsAThirdOfEach) {
  const Xyy e = xyy(linear_srgb({{360, 830}, {1, 1}}, Illuminant::equal_energy));
  EXPECT_NEAR(e.x, 1 / 3., kPublished);
  EXPECT_NEAR(e.y, 1 / 3., kPublished);
  EXPECT_NEAR(e.luminance, 1, 1e-5) << "by definition, up to the matrices";
  expect_near(scene::equal_energy_srgb(), linear_srgb({{300, 900}, {1, 1}}, Illuminant::equal_energy), 1e-3);
}

// By CIE 15, illuminant A is a black body at 2848 K, with c2 = 1.435e-2 m K in Planck's law, and has the
// chromaticity (x, y) = (0.44758, 0.40745).
TEST(Spectra, IlluminantAHasItsPublishedColour) {
  SpectralCurve a;
  for (int nm = 360; nm <= 830; ++nm) {
    a.nm.push_back(nm);
    a.value.push_back(std::pow(560. / nm, 5) * std::expm1(1.435e7 / (2848. * 560)) /
                      std::expm1(1.435e7 / (2848. * nm)));
  }
  const Xyy c = xyy(linear_srgb(a, Illuminant::equal_energy));
  EXPECT_NEAR(c.x, .44758, kPublished);
  EXPECT_NEAR(c.y, .40745, kPublished);
}

// The expected values are (x, y) of the spectral locus at 460, 520 and 600 nm by CIE 15.
TEST(Spectra, NarrowLinesLieOnTheSpectralLocus) {
  const double published[][3] = {{460, .14396, .02970}, {520, .07430, .83380}, {600, .62704, .37249}};
  for (const auto& [nm, x, y] : published) {
    const Xyy c = xyy(linear_srgb({{nm - 1e-3, nm, nm + 1e-3}, {0, 1, 0}}, Illuminant::equal_energy));
    EXPECT_NEAR(c.x, x, kPublished) << nm;
    EXPECT_NEAR(c.y, y, kPublished) << nm;
  }
}

TEST(Spectra, PerfectReflectorIsWhiteUnderD65) {
  const Rgb white = linear_srgb({{360, 830}, {1, 1}}, Illuminant::d65);
  // The white of BT.709 agrees with D65 in four digits of x and y.
  for (const double part : white) EXPECT_NEAR(part, 1, 1e-3);
}

// Integrates the observer's y, which is linear between the points of its table, times a triangle of height 1
// over 550 +- 20 nm, and compares with a fine sum.
TEST(Spectra, IntegralsAreExactBetweenTheSamples) {
  const auto y_at = [](double nm) {
    const double t = (nm - scene::kCieFirst) / scene::kCieStep;
    const auto i = static_cast<std::size_t>(t);
    const double f = t - static_cast<double>(i);
    return scene::kCieRows[i].observer[1] * (1 - f) + scene::kCieRows[i + 1].observer[1] * f;
  };
  // The midpoint rule with steps h errs by at most h^2 / 24 times the integral of the absolute second
  // derivative. Most of this integral is the sum of the changes of slope: 1/20, 1/10 and 1/20 per nm at the
  // triangle's corners, and smaller ones at the table's points. It is less than 1 per nm.
  const int n = 40'000;
  double sum = 0, all = 0;
  for (int i = 0; i < n; ++i) {
    const double nm = 530 + (i + .5) * 40 / n;
    sum += y_at(nm) * (1 - std::abs(nm - 550) / 20) * 40 / n;
  }
  for (std::size_t i = 0; i + 1 < scene::kCieRows.size(); ++i)
    all += (scene::kCieRows[i].observer[1] + scene::kCieRows[i + 1].observer[1]) / 2 * scene::kCieStep;
  const double slack = std::pow(40. / n, 2) / 24 / all + 4e-6;  // 4e-6: six digits of the matrices
  EXPECT_NEAR(xyy(linear_srgb({{530, 550, 570}, {0, 1, 0}}, Illuminant::equal_energy)).luminance, sum / all,
              slack);
}

TEST(Spectra, CurveIsZeroBeyondItsEnds) {
  const Rgb part = linear_srgb({{400, 700}, {1, 1}}, Illuminant::equal_energy),
            below = linear_srgb({{100, 400}, {1, 1}}, Illuminant::equal_energy),
            above = linear_srgb({{700, 2000}, {1, 1}}, Illuminant::equal_energy),
            all = linear_srgb({{360, 830}, {1, 1}}, Illuminant::equal_energy);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(part[i] + below[i] + above[i], all[i], 1e-14);
  EXPECT_EQ(linear_srgb({{100, 200}, {1, 1}}, Illuminant::d65), (Rgb{0, 0, 0}));
  EXPECT_EQ(linear_srgb({{900, 1000}, {1, 1}}, Illuminant::d65), (Rgb{0, 0, 0}));
}

// The expected values are those of Mitsuba 3.9.1 (scalar_rgb) for the same texts, and the tolerance allows
// for its integration. It sums 1000 samples that are 470 / 999 nm apart, but takes the distance as 470 /
// 1000, so its reflectances are 0.1 % too small. It also misses up to half a nanometre at the ends of a
// curve, which is less than 0.05 % of the integral for ends at 400 and 700 nm.
constexpr double kMitsubaSum = 1.5e-3;
TEST(Spectra, MatchMitsuba3) {
  expect_near(radiance("400:0, 500:8, 600:15.6, 700:18.4"), {20.7108, 10.8546, 2.77115}, kMitsubaSum);
  expect_near(radiance("400:0, 500:0.3, 600:0.8, 700:1.1"), {1.12687, .488194, .0880343}, kMitsubaSum);
  expect_near(radiance("380:1, 780:1"), {1.20478, .948302, .908764}, kMitsubaSum);
  expect_near(reflectance("400:0.78, 500:0.78, 600:0.78, 700:0.78"), {.776367, .77981, .776029}, kMitsubaSum);
  expect_near(reflectance("400:0.1, 500:0.2, 600:0.3, 700:0.4"), {.340779, .242912, .140304}, kMitsubaSum);
  expect_near(reflectance("360:1, 830:1"), {.998985, .998874, .998802}, kMitsubaSum);
}

TEST(Spectra, UniformSpectrumIsNotWhiteInMitsuba3) {
  expect_near(radiance("2"), {2.409588, 1.896582, 1.817832}, 1e-6);
  EXPECT_EQ(radiance("2", "0.6.0"), (Rgb{2, 2, 2}));
  EXPECT_EQ(reflectance(".5"), (Rgb{.5, .5, .5}));
}

// In files of Mitsuba 0.x, curves of reflectances are not multiplied by D65 either.
TEST(Spectra, OldFilesSpectraHaveNoIlluminant) {
  const std::string curve = "400:0.1, 500:0.2, 600:0.3, 700:0.4";
  expect_near(reflectance(curve, "0.6.0"),
              linear_srgb({{400, 500, 600, 700}, {.1, .2, .3, .4}}, Illuminant::equal_energy), 0);
  EXPECT_EQ(reflectance(curve, "0.6.0"), radiance(curve));
  EXPECT_NE(reflectance(curve, "3.0.0"), radiance(curve));
}

TEST(Spectra, ImpossibleValuesAreClampedWithAWarning) {
  const auto r =
      read(with_sensor("<shape type=\"cube\"><bsdf type=\"diffuse\"><spectrum name=\"reflectance\" "
                       "value=\"500:1, 540:1\"/></bsdf></shape>"));
  ASSERT_TRUE(r.scene) << messages(r);
  ASSERT_EQ(r.diagnostics.size(), 1u);
  EXPECT_EQ(r.diagnostics[0].place, (SourcePlace{"test.xml", 2, 77}));
  EXPECT_THAT(r.diagnostics[0].text, HasSubstr("'reflectance' of bsdf \"diffuse\" is, as linear sRGB, -0."));
  const Rgb c = std::get<ConstantTexture>(r.scene->textures.at(0)).value;
  EXPECT_EQ(c[0], 0);
  EXPECT_GT(c[1], .3);
}

TEST(Spectra, InvalidCurvesAreRefusedWithTheReason) {
  const auto said = [](const std::string& attributes) {
    return messages(read(with_sensor("<emitter type=\"constant\"><spectrum name=\"radiance\" " + attributes +
                                     "/></emitter>")));
  };
  for (const char* wrong :
       {"500:1", "500:1, 400:2", "500:1, 500:2", "400:1, 500", "400:1, b:2", "400:1, 500:nan"})
    EXPECT_THAT(said(fmt::format("value=\"{}\"", wrong)),
                HasSubstr("wavelength:value pairs, at least two, in"))
        << wrong;
  EXPECT_THAT(said("filename=\"a.spd\""), HasSubstr("curves in files are not read"));
  EXPECT_THAT(said("value=\"1 2\""), HasSubstr("wants a colour"));
}

}  // namespace
}  // namespace ls

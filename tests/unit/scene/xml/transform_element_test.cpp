#include "formats/xml/transform_element.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

Transform of(const std::string& steps) {
  return must_read(with_sensor("<shape type=\"cube\"><transform name=\"to_world\">" + steps +
                               "</transform></shape>"))
      .shapes.at(0)
      .to_world;
}

// Tolerance: an entry is a sum of at most 8 products of two numbers below 8, each rounded by epsilon.
constexpr double kRounding = 512 * std::numeric_limits<double>::epsilon();

void expect_matrix(const Transform& t, const std::array<double, 16>& want) {
  for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(t.m[i], want[i], kRounding) << "entry " << i;
}

TEST(Transforms, LaterStepsActAfterEarlierOnes) {
  EXPECT_EQ(of("<translate x=\"1\"/><scale x=\"2\"/>").m[3], 2);
  EXPECT_EQ(of("<scale x=\"2\"/><translate x=\"1\"/>").m[3], 1);
}

TEST(Transforms, MissingPartsAreOneForScaleAndZeroForTranslate) {
  EXPECT_EQ(of("<scale y=\"2\"/>").m,
            (std::array<double, 16>{1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}));
  EXPECT_EQ(of("<translate y=\"2\"/>").m[7], 2);
  EXPECT_EQ(of("<scale value=\"2\"/>").m[10], 2);
  EXPECT_EQ(of("<scale value=\"1, 2 3\"/>").m[10], 3);
}

TEST(Transforms, RotationIsRightHandedAndInDegrees) {
  expect_matrix(of("<rotate z=\"1\" angle=\"90\"/>"), {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  // A third of a turn about (1, 1, 1) permutes the axes. The length of the axis does not matter.
  expect_matrix(of("<rotate value=\"2 2 2\" angle=\"120\"/>"),
                {0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1});
}

TEST(Transforms, LookatSeesAlongPlusZWithPlusXToTheLeft) {
  expect_matrix(of("<lookat origin=\"1 2 3\" target=\"1 2 0\" up=\"0 1 0\"/>"),
                {-1, 0, 0, 1, 0, 1, 0, 2, 0, 0, -1, 3, 0, 0, 0, 1});
}

TEST(Transforms, MatricesAreRowMajor) {
  EXPECT_EQ(of("<matrix value=\"1 2 3, 4 5 6, 7 8 10\"/>").m,
            (std::array<double, 16>{1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 10, 0, 0, 0, 0, 1}));
  EXPECT_EQ(of("<matrix value=\"1,0,0,9,0,1,0,8,0,0,1,7,0,0,0,1\"/>").m[7], 8);
}

TEST(Transforms, SingularTransformsAreRefused) {
  const auto made = [](double x, double y, double z, double move) {
    return Transform{{x, 0, 0, move, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 0, 1}};
  };

  EXPECT_TRUE(scene::invertible(made(1e-100, 1, 1e100, 7)));
  EXPECT_FALSE(scene::invertible(made(0, 1, 1, 0)));
  EXPECT_FALSE(scene::invertible(made(1e-310, 1, 1, 0))) << "its determinant is subnormal";
  EXPECT_FALSE(scene::invertible(made(1e-310, 1, 1e10, 0))) << "its determinant is normal, 1 / 1e-310 is not";
  EXPECT_FALSE(scene::invertible(made(1e-200, 1, 1, 1e200))) << "1e200 / 1e-200 overflows";
  EXPECT_NE(read(with_sensor("<shape type=\"cube\"><transform name=\"to_world\"><scale value=\"1e-310, 1, "
                             "1e10\"/></transform></shape>"))
                .diagnostics.size(),
            0u);
}

TEST(Transforms, RotationAxisThatMitsubaWouldShearIsAWarning) {
  const auto warnings = [](const std::string& step) {
    return read(with_sensor("<shape type=\"cube\"><transform name=\"to_world\">" + step +
                            "</transform></shape>"))
        .diagnostics;
  };
  EXPECT_TRUE(warnings("<rotate x=\"0.577\" y=\"0.577\" z=\"0.577\" angle=\"3\"/>").empty());
  const auto of_two = warnings("<rotate y=\"2\" angle=\"3\"/>");
  ASSERT_EQ(of_two.size(), 1u);
  EXPECT_EQ(of_two[0].severity, Diagnostic::Severity::warning);
  EXPECT_EQ(of_two[0].place, (SourcePlace{"test.xml", 2, 48}));
  EXPECT_NE(of_two[0].text.find("length 2"), std::string::npos) << of_two[0].text;
}

// The expected matrix is that of Mitsuba 3.9.1 for the same steps (scalar_rgb, in single precision; the axis
// has length 1). The rounding of its four products of terms up to 4 is at most 4 x 4 x 4 x 2^-24 = 4e-6.
TEST(Transforms, MatchMitsubaOnAMixture) {
  const Transform t =
      of("<scale x=\"2\" y=\"3\" z=\".5\"/><rotate x=\".48\" y=\".6\" z=\"-.64\" angle=\"33\"/><translate "
         "value=\"1,-2,.25\"/>"
         "<lookat origin=\"1,2,3\" target=\"-2,.5,1\" up=\".1,1,.2\"/>");

  const std::array<double, 16> want{
      -.0777517632, -2.10842919, -.355157435,  1.07694721, -.473663777, 2.0912354, -.338375628, -.0466952212,
      1.94154513,   .425747722,  -.0967736468, 3.93146014, 0,           0,         0,           1};
  for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(t.m[i], want[i], 4e-6) << "entry " << i;
}

}  // namespace
}  // namespace ls

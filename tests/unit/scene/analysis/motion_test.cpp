// Motion by keys: which transforms can move, and what lies between them.
#include "core/scene/motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/transform.h"

namespace ls::scene {
namespace {

constexpr double kPi = 3.14159265358979323846;

// The right-handed rotation, by Rodrigues' formula.
Transform turned(const Vec3& axis, double degrees) {
  const double a = degrees * kPi / 180, s = std::sin(a), c = std::cos(a), n = std::sqrt(dot(axis, axis));
  const double x = axis[0] / n, y = axis[1] / n, z = axis[2] / n, t = 1 - c;
  return {{t * x * x + c, t * x * y - s * z, t * x * z + s * y, 0, t * x * y + s * z, t * y * y + c,
           t * y * z - s * x, 0, t * x * z - s * y, t * y * z + s * x, t * z * z + c, 0, 0, 0, 0, 1}};
}
Transform scaled(double x, double y, double z) { return {{x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 0, 1}}; }
Transform moved(double x, double y, double z) { return {{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1}}; }
Motion motion(std::initializer_list<MotionKey> keys) { return Motion(std::vector<MotionKey>(keys)); }

void expect_near(const Transform& a, const Transform& b, double tolerance) {
  for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(a.m[i], b.m[i], tolerance) << "element " << i;
}

TEST(Motion, HasTheTransformsOfItsKeysAtTheirTimes) {
  const Transform a = multiply(moved(4, -5, 6), turned({{1, -2, .5}}, 77)), b = multiply(a, scaled(2, .5, 3));
  const Motion m = motion({{2, a}, {3, b}});
  EXPECT_EQ(m.at(-1e9), a);
  EXPECT_EQ(m.at(2), a);
  EXPECT_EQ(m.at(3), b);
  EXPECT_EQ(m.at(1e9), b);
}

TEST(Motion, StandsStillBetweenEqualKeys) {
  const Transform a = multiply(moved(.1, .2, .3), turned({{1, 2, 3}}, 33.3));
  const Motion m = motion({{0, a}, {1, a}, {2, moved(1, 0, 0)}});
  for (const double t : {.1, .3, .7, .999}) EXPECT_EQ(m.at(t), a);
  EXPECT_TRUE(motion_during(m, .3, .7).empty());
  EXPECT_TRUE(motion_during(m, -2, 1).empty());
  EXPECT_TRUE(motion_during(m, 5, 9).empty());
  EXPECT_TRUE(motion_during(m, 1.5, 1.5).empty());
  EXPECT_TRUE(motion_during({}, 0, 1).empty());
  EXPECT_FALSE(motion_during(m, .5, 1.5).empty());
}

TEST(Motion, ScalesAndPlacesAreLinearAndMirroringStays) {
  for (const double sign : {1., -1.}) {
    const Motion m =
        motion({{0, scaled(sign, 2, 1e-6)}, {4, multiply(moved(8, 0, -4), scaled(3 * sign, 4, 3e-6))}});
    expect_near(m.at(1), multiply(moved(2, 0, -1), scaled(1.5 * sign, 2.5, 1.5e-6)), 1e-15);
    EXPECT_GT(determinant3(m.at(3)) * sign, 0);
  }
}

TEST(Motion, TurnsHaveAConstantRateAboutAnyAxis) {
  for (const Vec3& axis :
       {Vec3{{1, 0, 0}}, Vec3{{0, 1, 0}}, Vec3{{0, 0, 1}}, Vec3{{1, 2, -1}}, Vec3{{-1, -1, 3}}})
    for (double begin = -360; begin < 360; begin += 45)
      for (const double by : {170., -130., 20.}) {
        const Motion m = motion({{2, turned(axis, begin)}, {6, turned(axis, begin + by)}});
        for (const double t : {.1, .25, .5, .9})
          expect_near(m.at(2 + 4 * t), turned(axis, begin + by * t), 1e-14);  // some fifty roundings of 1
      }
}

TEST(Motion, TheShorterWayIsTaken) {
  const Motion m = motion({{0, turned({{0, 1, 0}}, 170)}, {1, turned({{0, 1, 0}}, 200)}});
  expect_near(m.at(.5), turned({{0, 1, 0}}, 185), 1e-14);
}

TEST(Motion, TinyTurnsKeepTheirPrecision) {
  // an angle whose cosine is 1 in double
  const Motion m = motion({{0, Transform{}}, {1, turned({{0, 0, 1}}, 1e-7)}});
  const double expected = 1e-7 * kPi / 180;
  EXPECT_NEAR(m.at(.5).m[4], expected / 2,
              1e-7 * expected);  // 1 - cos is 0 in the matrix: a relative 2^-53 / angle
}

TEST(Motion, ShearsAndFlatTransformsCannotMove) {
  EXPECT_FALSE(can_move({{1, .01, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}));
  EXPECT_TRUE(can_move({{1, 1e-4, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}));
  EXPECT_TRUE(can_move(scaled(-1, 2, 1e-5)));
  EXPECT_TRUE(can_move(scaled(1e-170, 1, 1)));  // its square is 0
  EXPECT_FALSE(can_move(scaled(1, 0, 1)));
  EXPECT_FALSE(can_move(scaled(1e-200, 1e-200, 1)));
  EXPECT_FALSE(can_move(scaled(1, 1, std::nan(""))));
}

TEST(Motion, TheExposureCutsItsPartOut) {
  std::vector<MotionKey> keys;
  for (int i = 0; i < 10; ++i)
    keys.push_back({double(i), multiply(moved(i * i, 0, 0), turned({{0, 1, 0}}, 30 * i))});
  const Motion whole(keys);

  const auto cut = motion_during(whole, 2.5, 6);

  ASSERT_EQ(cut.size(), 5u);  // 2.5, 3, 4, 5, 6
  EXPECT_EQ(cut.front().time, 0);
  EXPECT_EQ(cut.back().time, 1);
  EXPECT_EQ(cut[1].to_world, keys[3].to_world);
  const Motion part(cut);
  for (const double t : {0., .07, .3, .5, .77, 1.}) expect_near(part.at(t), whole.at(2.5 + 3.5 * t), 1e-13);
  EXPECT_EQ(motion_during(part, 0, 1), cut);
}

TEST(Motion, JumpsStayJumps) {
  // The first two keys have one time after the cut.
  const auto cut =
      motion_during(motion({{0, moved(0, 0, 0)}, {1e-17, moved(2, 0, 0)}, {1, moved(2, 0, 0)}}), -1, 1);
  const Motion m(cut);
  EXPECT_EQ(m.at(.5).m[3], 0);
  EXPECT_EQ(m.at(.5 + 0x1p-50).m[3], 2);
  EXPECT_EQ(m.at(.75).m[3], 2);
  // and at the end
  const auto end = motion_during(
      motion({{0, moved(0, 0, 0)}, {1 - 0x1p-53, moved(1, 0, 0)}, {1, moved(5, 0, 0)}}), -1e9, 1);
  EXPECT_EQ(end.back().time, 1);
  EXPECT_EQ(end.back().to_world.m[3], 5);
  for (std::size_t i = 1; i < end.size(); ++i) EXPECT_GT(end[i].time, end[i - 1].time);
}

}  // namespace
}  // namespace ls::scene

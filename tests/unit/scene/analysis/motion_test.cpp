// Motion by keys: how transforms are taken apart, and what lies between them.
#include "core/scene/motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/transform.h"

namespace ls::scene {
namespace {

constexpr double kPi = 3.14159265358979323846;

Transform turned(const Vec3& axis, double degrees) {
  const double a = degrees * kPi / 180, s = std::sin(a / 2), n = std::sqrt(dot(axis, axis));
  MotionKey key;
  key.rotation = {axis[0] / n * s, axis[1] / n * s, axis[2] / n * s, std::cos(a / 2)};
  return pose_of(key);
}
Transform scaled(double x, double y, double z) { return {{x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 0, 1}}; }
Transform moved(double x, double y, double z) { return {{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1}}; }

void expect_near(const Transform& a, const Transform& b, double tolerance) {
  for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(a.m[i], b.m[i], tolerance) << "element " << i;
}

TEST(MotionKeys, TransformsAreTakenApartAndPutTogether) {
  for (const Vec3& axis : {Vec3{{1, 0, 0}}, Vec3{{0, 1, 0}}, Vec3{{0, 0, 1}}, Vec3{{1, -2, .5}}, Vec3{{-1, -1, 3}}})
    for (double degrees = -360; degrees <= 360; degrees += 22.5)
      for (const Transform& scale : {scaled(1, 1, 1), scaled(2, .5, 3), scaled(-1, 1, 1), scaled(1, -2, 1),
                                     scaled(-3, -2, -1), scaled(1e-6, 1, 1e6)}) {
        const Transform t = multiply(moved(4, -5, 6), multiply(turned(axis, degrees), scale));
        const auto key = motion_key(.25, t);
        ASSERT_TRUE(key) << degrees;
        EXPECT_EQ(key->time, .25);
        EXPECT_EQ(key->scale[0] < 0, determinant3(t) < 0);
        // a hundred roundings of numbers of up to 1e6
        expect_near(pose_of(*key), t, 100 * 0x1p-53 * (scale.m[10] > 10 ? 1e6 : 10));
      }
}

TEST(MotionKeys, ShearsAndFlatTransformsAreRefused) {
  EXPECT_FALSE(motion_key(0, {{1, .01, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}));
  EXPECT_TRUE(motion_key(0, {{1, 1e-4, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}));
  EXPECT_FALSE(motion_key(0, scaled(1, 0, 1)));
  EXPECT_FALSE(motion_key(0, scaled(1e-200, 1e-200, 1)));
  EXPECT_FALSE(motion_key(0, scaled(1, 1, std::nan(""))));
}

TEST(MotionKeys, TurnsHaveAConstantRate) {
  // 170 degrees about an axis that is none of the coordinates': after a quarter of the time a quarter of the angle.
  const Vec3 axis{{1, 2, -1}};
  const std::vector<MotionKey> keys{*motion_key(2, turned(axis, 10)), *motion_key(6, turned(axis, 180))};
  for (const double t : {0., .1, .25, .5, .9, 1.})
    expect_near(pose_of(key_at(keys, 2 + 4 * t)), turned(axis, 10 + 170 * t), 1e-14);
}

TEST(MotionKeys, TheShorterWayIsTaken) {
  const std::vector<MotionKey> keys{*motion_key(0, turned({{0, 1, 0}}, 170)), *motion_key(1, turned({{0, 1, 0}}, 200))};
  expect_near(pose_of(key_at(keys, .5)), turned({{0, 1, 0}}, 185), 1e-14);
}

TEST(MotionKeys, TinyTurnsKeepTheirPrecision) {
  // an angle whose cosine is 1 in double
  const std::vector<MotionKey> keys{*motion_key(0, Transform{}), *motion_key(1, turned({{0, 0, 1}}, 1e-7))};
  const double expected = 1e-7 * kPi / 180;
  EXPECT_NEAR(pose_of(key_at(keys, .5)).m[4], expected / 2, 1e-9 * expected);
}

TEST(MotionKeys, NothingMovesBeforeTheFirstAndAfterTheLast) {
  const std::vector<MotionKey> keys{*motion_key(1, moved(1, 0, 0)), *motion_key(2, moved(5, 0, 0))};
  EXPECT_EQ(key_at(keys, -7).translation[0], 1);
  EXPECT_EQ(key_at(keys, 1).translation[0], 1);
  EXPECT_EQ(key_at(keys, 1.25).translation[0], 2);
  EXPECT_EQ(key_at(keys, 99).translation[0], 5);
}

TEST(MotionKeys, TheExposureCutsItsPartOut) {
  std::vector<MotionKey> keys;
  for (int i = 0; i < 10; ++i) keys.push_back(*motion_key(i, multiply(moved(i * i, 0, 0), turned({{0, 1, 0}}, 30 * i))));

  const auto part = motion_during(keys, 2.5, 6);

  ASSERT_EQ(part.size(), 5u);  // 2.5, 3, 4, 5, 6
  EXPECT_EQ(part.front().time, 0);
  EXPECT_EQ(part.back().time, 1);
  for (const double t : {0., .07, .3, .5, .77, 1.})
    expect_near(pose_of(key_at(part, t)), pose_of(key_at(keys, 2.5 + 3.5 * t)), 1e-13);
}

TEST(MotionKeys, WithoutMotionThereAreNone) {
  const std::vector<MotionKey> keys{*motion_key(0, moved(1, 2, 3)), *motion_key(1, moved(1, 2, 3)),
                                    *motion_key(2, moved(4, 2, 3))};
  EXPECT_TRUE(motion_during(keys, 0, 1).empty());
  EXPECT_TRUE(motion_during(keys, 5, 9).empty());
  EXPECT_TRUE(motion_during(keys, 1.5, 1.5).empty());
  EXPECT_TRUE(motion_during({}, 0, 1).empty());
  EXPECT_FALSE(motion_during(keys, 0, 1.5).empty());
}

TEST(MotionKeys, HugeAndTinyTimesAreNoTrouble) {
  const std::vector<MotionKey> keys{*motion_key(-1e300, moved(0, 0, 0)), *motion_key(1e300, moved(2, 0, 0))};
  EXPECT_EQ(key_at(keys, 0).translation[0], 1);
  const std::vector<MotionKey> close{*motion_key(1, moved(0, 0, 0)), *motion_key(1 + 0x1p-52, moved(2, 0, 0))};
  EXPECT_EQ(motion_during(close, 0, 1e300).back().translation[0], 2);
}

}  // namespace
}  // namespace ls::scene

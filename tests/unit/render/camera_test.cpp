// The camera and the pixel filters.
#include "worker/render/camera.h"

#include <gtest/gtest.h>

#include <cmath>

#include "worker/render/hash.h"
#include "worker/render/pixel_filter.h"

namespace ls::render {
namespace {

constexpr FrameSize kSize{200, 100};

Camera camera(const Sensor& s, FrameSize size = kSize) { return {s, size, V3d(0), 1}; }
double degrees_between(const V3& a, const V3& b) {
  return std::atan2(V3d(a).cross(V3d(b)).length(), V3d(a).dot(V3d(b))) * 180 / M_PI;
}
double horizontal(const Camera& c, FrameSize s = kSize) {
  return degrees_between(c.ray(0, s.height / 2., {}).d, c.ray(s.width, s.height / 2., {}).d);
}
double vertical(const Camera& c, FrameSize s = kSize) {
  return degrees_between(c.ray(s.width / 2., 0, {}).d, c.ray(s.width / 2., s.height, {}).d);
}

TEST(Camera, LooksAlongItsZWithXToTheLeftAndYUp) {
  const Camera c = camera({});

  EXPECT_EQ(c.ray(100, 50, {}).d, V3(0, 0, 1));
  EXPECT_GT(c.ray(0, 50, {}).d.x, 0.f);   // the left of the film
  EXPECT_GT(c.ray(100, 0, {}).d.y, 0.f);  // its top
  EXPECT_LT(c.ray(200, 100, {}).d.x, 0.f);
}

TEST(Camera, FieldOfViewIsMeasuredAlongTheAxisAsked) {
  Sensor s;
  s.fov = 40;
  const double tolerance = 1e-4;  // degrees: directions are float32

  s.fov_axis = FovAxis::x;
  EXPECT_NEAR(horizontal(camera(s)), 40, tolerance);
  s.fov_axis = FovAxis::larger;
  EXPECT_NEAR(horizontal(camera(s)), 40, tolerance);
  EXPECT_NEAR(vertical(camera(s, {100, 200}), {100, 200}), 40, tolerance);
  s.fov_axis = FovAxis::y;
  EXPECT_NEAR(vertical(camera(s)), 40, tolerance);
  s.fov_axis = FovAxis::smaller;
  EXPECT_NEAR(vertical(camera(s)), 40, tolerance);
  EXPECT_NEAR(horizontal(camera(s, {100, 200}), {100, 200}), 40, tolerance);
  s.fov_axis = FovAxis::diagonal;
  EXPECT_NEAR(degrees_between(camera(s).ray(0, 0, {}).d, camera(s).ray(200, 100, {}).d), 40, tolerance);
}

TEST(Camera, ExtremeFieldsOfViewGiveUnitDirections) {
  for (const double fov : {179.9, .01, 1e-5}) {
    Sensor s;
    s.fov = fov;
    for (const double f : {0., .3, 1.}) {
      const CameraRay r = camera(s).ray(200 * f, 100 * f, {});
      EXPECT_NEAR(dot(r.d, r.d), 1, 4e-7);
      EXPECT_TRUE(is_finite(r.o));
    }
  }
}

TEST(Camera, WithoutApertureTheLensNumbersChangeNothing) {
  Sensor s;
  s.focus_distance = 3;
  const Camera c = camera(s);

  for (const V2& lens : {V2(0, 0), V2(.5f, .5f), V2(.99f, .2f)}) {
    EXPECT_EQ(c.ray(31.25, 77.5, lens).o, c.ray(31.25, 77.5, {}).o);
    EXPECT_EQ(c.ray(31.25, 77.5, lens).d, c.ray(31.25, 77.5, {}).d);
  }
}

TEST(Camera, AllRaysOfAPixelThroughTheLensMeetInThePlaneOfFocus) {
  Sensor s, pinhole;
  s.aperture_radius = .25;
  s.focus_distance = 3;
  s.near_clip = pinhole.near_clip = 1e-3;
  const CameraRay through = camera(pinhole).ray(40, 20, {});
  const V3 target = through.o + through.d * ((3 - through.o.z) / through.d.z);

  for (const V2& lens : {V2(.1f, .2f), V2(.5f, .5f), V2(.9f, .3f), V2(.7f, .99f)}) {
    const CameraRay r = camera(s).ray(40, 20, lens);
    const V3 at = r.o + r.d * ((3 - r.o.z) / r.d.z);
    EXPECT_LT((at - target).length(), 3e-6f);  // of 3: a few roundings
  }
}

TEST(Camera, CircleOfConfusionIsTheApertureSeenThroughThePointInFocus) {
  // On a plane at depth z the lens point p lands |p| |z - zf| / zf away from the pinhole's point.
  Sensor s, pinhole;
  s.aperture_radius = .2;
  s.focus_distance = 2;
  s.near_clip = pinhole.near_clip = 1e-4;
  const CameraRay a = camera(pinhole).ray(70, 60, {});
  RandomStream rng(1);
  double widest = 0;
  for (int i = 0; i < 4000; ++i) {
    const float u = rng.uniform(), v = rng.uniform();
    const CameraRay r = camera(s).ray(70, 60, {u, v});
    const V3 p = r.o + r.d * ((5 - r.o.z) / r.d.z), q = a.o + a.d * ((5 - a.o.z) / a.d.z);
    widest = std::max<double>(widest, (p - q).length());
  }
  EXPECT_LE(widest, .2 * 3 / 2 + 1e-5);
  EXPECT_GT(widest,
            .2 * 3 / 2 * .99);  // 4000 uniform points of a disk: the outermost 1 % of radius holds 2 %
}

TEST(Camera, RaysRunFromTheNearToTheFarPlane) {
  Sensor s;
  s.near_clip = .5;
  s.far_clip = 8;
  for (const double f : {0., .5, .8}) {
    const CameraRay r = camera(s).ray(200 * f, 100 * f, {});
    EXPECT_NEAR(r.o.z, .5, 1e-6);
    EXPECT_NEAR((r.o + r.d * r.t_max).z, 8, 1e-5);
  }
}

// ---- filters

struct Moments {
  double mean, variance;
};
Moments moments(const ReconstructionFilter& f) {
  const PixelFilter filter(f);
  constexpr int kN = 1 << 20;
  double m = 0, v = 0;
  for (int i = 0; i < kN; ++i) {  // midpoints of 2^20 strata: exact in float32
    const double x = filter.offset(static_cast<float>((i + .5) / kN));
    m += x;
    v += x * x;
  }
  return {m / kN, v / kN - m / kN * (m / kN)};
}

TEST(PixelFilter, HasTheMomentsOfTheFilter) {
  EXPECT_NEAR(moments(BoxFilter{.5}).variance, 1. / 12, 1e-6);
  EXPECT_NEAR(moments(TentFilter{1.5}).variance, 1.5 * 1.5 / 6, 1e-5);
  for (const ReconstructionFilter& f :
       {ReconstructionFilter{BoxFilter{.5}}, ReconstructionFilter{TentFilter{1}},
        ReconstructionFilter{GaussianFilter{.5}}}) {
    EXPECT_NEAR(moments(f).mean, 0, 1e-6);
  }
}

TEST(PixelFilter, GaussianIsCutAtFourDeviationsAndShiftedToReachZero) {
  // max(0, e^(-x^2 / 2) - e^-8) on [-4, 4] in units of the deviation: moments by the error function.
  const double e = std::exp(-8.), root = std::sqrt(2 * M_PI), inside = std::erf(4 / std::sqrt(2.));
  const double mass = root * inside - 8 * e, second = root * inside - 2 * 4 * e - e * 2 * 64 / 3;
  const double deviation = .7;

  const Moments m = moments(GaussianFilter{deviation});

  // The table's density is constant in steps of h = 1/128 of a deviation: adds h^2 / 6 = 1.02e-5 to the
  // variance.
  EXPECT_NEAR(m.variance / (deviation * deviation), second / mass + 1.02e-5, 1e-6);
  EXPECT_LE(PixelFilter(GaussianFilter{deviation}).offset(1 - 0x1p-24f), 4 * deviation);
  EXPECT_GE(PixelFilter(GaussianFilter{deviation}).offset(0), -4 * deviation);
}

TEST(PixelFilter, OffsetsGrowWithTheNumber) {
  for (const ReconstructionFilter& f :
       {ReconstructionFilter{BoxFilter{.5}}, ReconstructionFilter{TentFilter{1}},
        ReconstructionFilter{GaussianFilter{.5}}}) {
    const PixelFilter filter(f);
    double last = -10;
    for (int i = 0; i < 10000; ++i) {
      const double x = filter.offset(static_cast<float>(i) / 10000);
      ASSERT_GE(x, last);
      last = x;
    }
  }
}

}  // namespace
}  // namespace ls::render

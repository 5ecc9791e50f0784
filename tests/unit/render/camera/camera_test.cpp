// Tests the camera, its matrices in the header of images, and the pixel filters.
#include "worker/render/camera/camera.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/analysis/camera_view.h"
#include "core/scene/motion.h"
#include "core/scene/transform.h"
#include "tests/support/render_check.h"
#include "tests/support/significance.h"
#include "worker/render/math/random.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::operator*;

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
  EXPECT_GT(c.ray(0, 50, {}).d.x, 0.f);   // the left edge of the film
  EXPECT_GT(c.ray(100, 0, {}).d.y, 0.f);  // its top edge
  EXPECT_LT(c.ray(200, 100, {}).d.x, 0.f);
}

TEST(Camera, FieldOfViewIsMeasuredAlongTheChosenAxis) {
  Sensor s;
  s.fov = 40;
  const double tolerance = 1e-4;  // degrees; directions are float32

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

TEST(Camera, LensParametersHaveNoEffectWithoutAnAperture) {
  Sensor s;
  s.focus_distance = 3;
  const Camera c = camera(s);

  for (const V2& lens : {V2(0, 0), V2(.5f, .5f), V2(.99f, .2f)}) {
    EXPECT_EQ(c.ray(31.25, 77.5, lens).o, c.ray(31.25, 77.5, {}).o);
    EXPECT_EQ(c.ray(31.25, 77.5, lens).d, c.ray(31.25, 77.5, {}).d);
  }
}

TEST(Camera, RaysOfAPixelMeetInTheFocalPlane) {
  Sensor s, pinhole;
  s.aperture_radius = .25;
  s.focus_distance = 3;
  s.near_clip = pinhole.near_clip = 1e-3;
  const CameraRay through = camera(pinhole).ray(40, 20, {});
  const V3 target = through.o + through.d * ((3 - through.o.z) / through.d.z);

  for (const V2& lens : {V2(.1f, .2f), V2(.5f, .5f), V2(.9f, .3f), V2(.7f, .99f)}) {
    const CameraRay r = camera(s).ray(40, 20, lens);
    const V3 at = r.o + r.d * ((3 - r.o.z) / r.d.z);
    EXPECT_LT((at - target).length(), 3e-6f);  // a few roundings of distances of 3
  }
}

TEST(Camera, CircleOfConfusionIsTheApertureSeenThroughThePointInFocus) {
  // On a plane at depth z, the ray from the lens point p is |p| |z - zf| / zf away from the ray of the
  // pinhole.
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
            .2 * 3 / 2 * .99);  // the outermost 1 % of the radius has 2 % of 4000 points
}

// A camera that moves along and turns by 120 degrees.
Sensor moving(Projection projection = Projection::perspective) {
  Sensor s;
  s.projection = projection;
  s.near_clip = .5;
  Transform end = test::translate({1, 2, 3}) * test::rotate_y(120);
  if (projection == Projection::orthographic) end = end * test::scale(2, 3, .5);
  s.motion = {{0, {}}, {.25, test::translate({0, 1, 0}) * test::rotate_x(50)}, {1, end}};
  s.to_world = scene::Motion(s.motion).at(.5);
  return s;
}

TEST(Camera, OfAnyTimeHasTheRaysOfOneThatStandsThere) {
  for (const Projection projection :
       {Projection::perspective, Projection::orthographic, Projection::spherical})
    for (const double aperture : {0., .3}) {
      if (aperture > 0 && projection != Projection::perspective) continue;
      Sensor s = moving(projection);
      s.aperture_radius = aperture;
      const Camera moves = camera(s);
      EXPECT_TRUE(moves.moves());
      for (const float time : {0.f, .125f, .25f, .7f, 1.f}) {
        Sensor still = s;
        still.to_world = scene::Motion(s.motion).at(double{time});
        still.motion.clear();
        const Camera stands = camera(still);
        EXPECT_FALSE(stands.moves());
        for (const double f : {0., .4, 1.}) {
          const CameraRay a = moves.ray_at(time, 200 * f, 60 * f, {.3f, .8f}),
                          b = stands.ray(200 * f, 60 * f, {.3f, .8f});
          EXPECT_EQ(a.o, b.o);
          EXPECT_EQ(a.d, b.d);
          EXPECT_EQ(a.t_max, b.t_max);
          EXPECT_EQ(a.time, time);
          EXPECT_EQ(moves.near_distance(a), stands.near_distance(b));
        }
      }
      EXPECT_EQ(moves.ray(50, 50, {.5f, .5f}).d, moves.ray_at(.5f, 50, 50, {.5f, .5f}).d);
    }
}

TEST(Camera, IsUsableOnlyIfAllItsKeysAre) {
  Sensor s = moving();
  EXPECT_TRUE(camera(s).usable());
  s.motion[1].to_world.m[3] = 1e300;
  EXPECT_FALSE(camera(s).usable());
}

// A camera slides by half its frame past the edge of a shining half plane, x > 0. The value of each pixel is
// the share of the exposure time and of the pixel's width in which it sees the half plane.
TEST(Camera, SlidesPastAnEdgeWithATrapezoid) {
  constexpr int kWidth = 16;
  constexpr std::uint64_t kSamples = 4096;
  test::SceneBuilder b(FrameSize{kWidth, 1});
  b.scene.film.filter = BoxFilter{};
  b.shape(RectangleShape{}, test::translate({50, 0, 0}) * test::rotate_x(180) * test::scale(50, 50, 1),
          b.diffuse(0))
      .emitter = AreaEmitter{b.texture({1, 1, 1})};
  Sensor& s = b.scene.sensor;
  s.projection = Projection::orthographic;
  // The frame is 2 wide, and its left is +x of the world.
  const auto at = [](double x) { return test::look_at({x, 0, -1}, {x, 0, 0}, {0, 1, 0}); };
  s.motion = {{0, at(-.5)}, {1, at(.5)}};
  s.to_world = at(0);
  s.shutter_close = 1;

  const auto world = test::world_of(b, 5, 1);
  const auto sums = render_tile(*world, {0, 0, kWidth, 1}, {0, kSamples}, nullptr, nullptr).sums;

  for (int x = 0; x < kWidth; ++x) {
    // The pixel sees the place t - .5 + 1 - (x + 1 - u) / 8 for u and t from 0 to 1.
    const double w = 1 / 8., c = (x + 1) * w - .5;
    const auto above = [](double v) { return std::max(0., v) * std::max(0., v) / 2; };
    // P(u w + t > c), by inclusion and exclusion at the corners of the unit square
    const double share = 1 - (above(c) - above(c - 1) - above(c - w) + above(c - w - 1)) / w;
    double got = 0;
    for (int half = 0; half < 2; ++half)
      got += double{sums[static_cast<std::size_t>(half * 3 * kWidth + x)]} / kSamples;
    // Samples see the light or do not: the variance is at most that of independent ones.
    const double error = std::sqrt(std::max(share * (1 - share), 1e-12) / kSamples);
    EXPECT_NEAR(got, share, test::kStandardErrors * error + 1e-6) << "pixel " << x;
  }
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

// Rays of Mitsuba 3.9.1 (scalar_rgb, sample_ray) for a frame of 200 x 100: origin and direction at the
// position (u, v), in shares of the rendered part.
struct SeenRay {
  double u, v;
  V3 o, d;
};
void expect_rays(const Camera& c, std::array<int, 2> offset, FrameSize part,
                 std::initializer_list<SeenRay> rays) {
  for (const SeenRay& r : rays) {
    const CameraRay ray = c.ray(offset[0] + r.u * part.width, offset[1] + r.v * part.height, {.5f, .5f});
    EXPECT_LT((ray.o - r.o).length(), 1e-6f) << ray.o << r.o;
    EXPECT_LT((ray.d - r.d).length(), 2e-6f) << ray.d << r.d;  // printed to 6 digits
  }
}

TEST(Camera, PrincipalPointMatchesMitsuba) {
  Sensor s;
  s.fov = 60;
  s.principal_point_offset = {.1, .2};
  const Camera c = camera(s);

  expect_rays(c, {0, 0}, kSize,
              {{0, 0, {.0046188f, .00173205f, .01f}, {.414224f, .155334f, .896822f}},
               {.25, .75, {.00173205f, -.00259808f, .01f}, {.165333f, -.247999f, .954548f}},
               {1, 1, {-.0069282f, -.00404145f, .01f}, {-.540453f, -.315264f, .780077f}}});
  expect_rays(c, {10, 20}, {30, 40},
              {{0, 0, {.00404145f, .00057735f, .01f}, {.374166f, .0534523f, .92582f}},
               {1, 1, {.0023094f, -.00173205f, .01f}, {.22188f, -.16641f, .960769f}}});
}

TEST(Camera, OrthographicRaysMatchMitsuba) {
  Sensor s;
  s.projection = Projection::orthographic;
  s.to_world.m = {2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 4, 0, 0, 0, 0, 1};
  const Camera c = camera(s);

  expect_rays(c, {0, 0}, kSize,
              {{0, 0, {2, 1.5f, .04f}, {0, 0, 1}},
               {.25, .75, {1, -.75f, .04f}, {0, 0, 1}},
               {1, 1, {-2, -1.5f, .04f}, {0, 0, 1}}});
  expect_rays(c, {10, 20}, {30, 40},
              {{0, 0, {1.8f, .9f, .04f}, {0, 0, 1}}, {1, 1, {1.2f, -.3f, .04f}, {0, 0, 1}}});
  EXPECT_NEAR(c.ray(3, 4, {}).t_max, 9999.99, 1e-2);
}

TEST(Camera, OrthographicIsTheSameInAnyWorld) {
  // The world is the scene, moved by its centre and scaled.
  Sensor s;
  s.projection = Projection::orthographic;
  s.to_world.m = {.5, 0, 0, 7, 0, .5, 0, 8, 0, 0, 1, 9, 0, 0, 0, 1};
  const V3d center(1, 2, 3);
  const CameraRay a = Camera(s, kSize, V3d(0), 1).ray(30, 70, {}),
                  b = Camera(s, kSize, center, .125).ray(30, 70, {});

  EXPECT_LT((V3((V3d(a.o) - center) * .125) - b.o).length(), 1e-6f);
  EXPECT_EQ(a.d, b.d);
  EXPECT_NEAR(a.t_max * .125, b.t_max, 1e-3);
}

TEST(Camera, SphericalSeesEveryDirectionInLatitudeAndLongitude) {
  Sensor s;
  s.projection = Projection::spherical;
  s.to_world.m[3] = 5;
  const Camera c = camera(s);
  const struct {
    double u, v;
    V3 d;
  } expected[] = {{.3, 0, {0, 1, 0}},   {.8, 1, {0, -1, 0}}, {0, .5, {0, 0, -1}},
                  {.25, .5, {1, 0, 0}}, {.5, .5, {0, 0, 1}}, {.75, .5, {-1, 0, 0}}};
  for (const auto& e : expected) {
    const CameraRay r = c.ray(200 * e.u, 100 * e.v, {.3f, .4f});
    EXPECT_LT((r.d - e.d).length(), 1e-6f) << e.u << " " << e.v;
    EXPECT_EQ(r.o, V3(5, 0, 0));
    EXPECT_EQ(r.t_max, std::numeric_limits<float>::infinity());
  }
}

TEST(Camera, ThinLensWithoutAnApertureEqualsAPinhole) {
  Sensor pinhole, lens;
  pinhole.to_world = lens.to_world = test::rotate_x(20) * test::rotate_y(-50) * test::translate({1, 2, 3});
  lens.focus_distance = 3.7;
  for (int i = 0; i < 1000; ++i) {
    const double x = .2 * i, y = 37.1 + .05 * i;
    const CameraRay a = camera(pinhole).ray(x, y, {.7f, .1f}), b = camera(lens).ray(x, y, {.7f, .1f});
    ASSERT_EQ(a.o, b.o);
    ASSERT_EQ(a.d, b.d);
    ASSERT_EQ(a.t_max, b.t_max);
  }
}

// ---- aperture maps and crops, in complete worlds

// The aperture map is a checkerboard of 2 x 2 over the frame: closed at the upper left and lower right, open
// elsewhere.
test::SceneBuilder with_aperture_map(double closed, double open) {
  test::SceneBuilder builder({16, 8});
  builder.shape(RectangleShape{}, {}, builder.diffuse(.5));
  builder.look({0, 0, 5}, {0, 0, 0}, 30, {0, 1, 0});
  const TextureIndex a = builder.texture({closed, closed, closed}), b = builder.texture({open, open, open});
  builder.scene.sensor.aperture_radius = .25;
  builder.scene.sensor.focus_distance = 3;
  builder.scene.sensor.aperture_scale =
      test::SceneBuilder::push<TextureTag>(builder.scene.textures, Texture(CheckerboardTexture{a, b, {}}));
  return builder;
}

TEST(ApertureMap, MultipliesTheRadiusPerPixel) {
  const auto mapped = test::world_of(with_aperture_map(0, 1));
  test::SceneBuilder builder = with_aperture_map(0, 1);
  builder.scene.sensor.aperture_scale.reset();
  const auto open = test::world_of(builder);
  builder.scene.sensor.aperture_radius = 0;
  const auto pinhole = test::world_of(builder);
  for (const double x : {.5, 3.25, 7.5, 8.5, 12.75, 15.5}) {
    for (const double y : {.5, 3.5, 4.5, 7.5}) {
      const bool closed = (x < 8) == (y < 4);
      const CameraRay r = mapped->camera.ray(x, y, {.8f, .3f}),
                      e = (closed ? pinhole : open)->camera.ray(x, y, {.8f, .3f});
      EXPECT_EQ(r.o, e.o) << x << " " << y;
      EXPECT_EQ(r.d, e.d) << x << " " << y;
    }
  }
}

TEST(ApertureMap, DoesNotHideATooLargeLens) {
  // The checkerboard repeats, so at the four corners of the frame itself the aperture is closed
  test::SceneBuilder builder = with_aperture_map(0, 1);
  builder.scene.sensor.aperture_radius = 1e39;  // infinite in single precision

  const auto world = build_world(builder.scene, test::settings_of(builder.scene), builder.files, 1);

  ASSERT_FALSE(world);
  EXPECT_NE(world.error().message.find("aperture_radius"), std::string::npos) << world.error().message;
}

TEST(ApertureMap, MapOfOnesChangesNoBit) {
  const auto render = [](const test::SceneBuilder& builder) {
    return render_tile(*test::world_of(builder), {0, 0, 16, 8}, {0, 4}, nullptr, nullptr).sums;
  };
  test::SceneBuilder builder = with_aperture_map(0, 1);
  builder.environment();
  test::SceneBuilder closed = with_aperture_map(0, 0), open = with_aperture_map(1, 1), plain = open,
                     pinhole = open;
  plain.scene.sensor.aperture_scale.reset();
  pinhole.scene.sensor.aperture_scale.reset();
  pinhole.scene.sensor.aperture_radius = 0;
  for (test::SceneBuilder* k : {&closed, &open, &plain, &pinhole}) k->environment();
  EXPECT_EQ(render(open), render(plain));
  EXPECT_EQ(render(closed), render(pinhole));
  EXPECT_NE(render(open), render(pinhole));
}

test::SceneBuilder cropped(std::array<int, 2> offset, FrameSize size) {
  test::SceneBuilder builder({16, 8});
  builder.shape(SphereShape{}, {}, builder.diffuse(.5));
  builder.environment();
  builder.look({0, 0, 5}, {0, 0, 0}, 30, {0, 1, 0});
  builder.scene.film.filter = GaussianFilter{};
  builder.scene.film.crop_offset = offset;
  builder.scene.film.crop_size = size;
  return builder;
}
TileResult render_size(const test::SceneBuilder& builder, FrameSize size) {
  RenderSettings settings = test::settings_of(builder.scene);
  settings.size = size;
  const auto w = build_world(builder.scene, settings, builder.files, 1);
  EXPECT_TRUE(w);
  return render_tile(**w, {0, 0, size.width, size.height}, {0, 8}, nullptr, nullptr);
}

TEST(Crop, EqualsThatPartOfTheFrame) {
  const auto whole = render_size(cropped({0, 0}, {0, 0}), {16, 8}),
             part = render_size(cropped({5, 2}, {7, 4}), {7, 4});
  for (std::size_t plane = 0; plane < 6; ++plane)
    for (std::size_t y = 0; y < 4; ++y)
      for (std::size_t x = 0; x < 7; ++x)
        ASSERT_EQ(part.sums[plane * 28 + y * 7 + x], whole.sums[plane * 128 + (y + 2) * 16 + x + 5]);
}

TEST(Crop, CropAtAnotherSizeShowsTheSamePart) {
  test::SceneBuilder twice = cropped({10, 4}, {14, 8});
  twice.scene.film.size = {32, 16};
  EXPECT_EQ(render_size(cropped({5, 2}, {7, 4}), {14, 8}).sums, render_size(twice, {14, 8}).sums);
}

// ---- filters

struct RadiusMoments {
  double mean, variance;
};
RadiusMoments moments(const ReconstructionFilter& f) {
  const PixelFilter filter(f);
  constexpr int kN = 1 << 20;
  double m = 0, v = 0;
  for (int i = 0; i < kN; ++i) {  // midpoints of 2^20 strata, exact in float32
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
  // The filter is max(0, e^(-x^2 / 2) - e^-8) on [-4, 4], in units of the standard deviation. Its moments
  // follow from the error function.
  const double e = std::exp(-8.), root = std::sqrt(2 * M_PI), inside = std::erf(4 / std::sqrt(2.));
  const double mass = root * inside - 8 * e, second = root * inside - 2 * 4 * e - e * 2 * 64 / 3;
  const double deviation = .7;

  const RadiusMoments m = moments(GaussianFilter{deviation});

  // The table's density is constant over steps of h = 1/128 of a deviation, which adds h^2 / 6 = 1.02e-5 to
  // the variance.
  EXPECT_NEAR(m.variance / (deviation * deviation), second / mass + 1.02e-5, 1e-6);
  EXPECT_LE(PixelFilter(GaussianFilter{deviation}).offset(1 - 0x1p-24f), 4 * deviation);
  EXPECT_GE(PixelFilter(GaussianFilter{deviation}).offset(0), -4 * deviation);
}

// Returns p M, divided by its fourth component.
V3d transformed(const RowMatrix& m, const V3d& p) {
  double out[4];
  for (std::size_t c = 0; c < 4; ++c) out[c] = p.x * m[c] + p.y * m[4 + c] + p.z * m[8 + c] + m[12 + c];
  return {out[0] / out[3], out[1] / out[3], out[2] / out[3]};
}

// The test tries every kind of camera that has a matrix: turned, moved and scaled, with an enlarged crop.
TEST(CameraMatrices, PointOnTheRayOfAPixelIsAtThatPixel) {
  FilmSettings film;
  film.size = {200, 100};
  film.crop_offset = {30, 20};
  film.crop_size = {80, 50};
  const FrameSize image{160, 100};
  Sensor s;
  s.to_world = scene::of_columns({0, 0, -2}, {0, 2, 0}, {2, 0, 0}, {5, -3, 1});
  s.fov = 60;
  s.near_clip = .5;
  s.far_clip = 8;
  for (const Projection projection : {Projection::perspective, Projection::orthographic})
    for (const double offset : {0., .1}) {
      s.projection = projection;
      s.principal_point_offset = {offset, -2 * offset};
      if (projection == Projection::orthographic && offset != 0) continue;
      const scene::FramePart part = scene::frame_part(film, image);
      const Camera c = camera(s, part.frame);
      const auto matrices = scene::camera_matrices(s, film, image);
      ASSERT_TRUE(matrices && matrices->world_to_ndc);

      for (const V2& pixel : {V2(0, 0), V2(160, 100), V2(16, 75)})
        for (const float t : {0.f, .25f, 1.f}) {
          const CameraRay ray = c.ray(part.x0 + double{pixel.x}, part.y0 + double{pixel.y}, {});
          const V3d point = V3d(ray.o) + V3d(ray.d) * double{t * ray.t_max};
          const V3d at = transformed(*matrices->world_to_ndc, point);
          // The ray's origin, direction and length are floats: up to 40 units from the origin the point is
          // off by some 40 * 2^-24 * 3 = 7e-6, at a depth of 1 or more, where the image is 1.1 units wide or
          // more.
          EXPECT_NEAR(at.x, pixel.x / 160, 1e-5);
          EXPECT_NEAR(at.y, pixel.y / 100, 1e-5);
          // The depth changes fastest at the near plane, by 2.2 per unit of the world or less.
          if (t != .25f) EXPECT_NEAR(at.z, t, 2e-5);
        }
    }
}

TEST(CameraMatrices, CameraSpaceIsThatOfOpenExr) {
  const Sensor s{.to_world = scene::of_columns({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 2, 3})};

  const auto matrices = scene::camera_matrices(s, {}, {20, 10});

  ASSERT_TRUE(matrices);
  // The camera looks along +z, with -x to the right of the image.
  const V3d at = transformed(matrices->world_to_camera, {1 - 4, 2 + 5, 3 + 6});
  EXPECT_EQ(at, V3d(4, 5, 6));
}

TEST(CameraMatrices, AreLeftOutWhereThereAreNone) {
  const auto spherical = scene::camera_matrices({.projection = Projection::spherical}, {}, {20, 10});
  ASSERT_TRUE(spherical);
  EXPECT_FALSE(spherical->world_to_ndc);
  const Sensor flat{.to_world = scene::of_columns({1, 0, 0}, {0, 0, 0}, {0, 0, 1}, {0, 0, 0})};
  EXPECT_FALSE(scene::camera_matrices(flat, {}, {20, 10}));
  const Sensor far{.to_world = scene::of_columns({1e-30, 0, 0}, {0, 1e-30, 0}, {0, 0, 1e-30}, {1e20, 0, 0})};
  EXPECT_FALSE(scene::camera_matrices(far, {}, {20, 10}));
}

TEST(PixelFilter, OffsetsIncreaseWithTheRandomNumber) {
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

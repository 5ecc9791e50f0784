// Meters: their values against closed forms, and their intervals.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>
#include <vector>

#include "core/image/frame/meter_blocks.h"
#include "core/scene/schema/describe.h"
#include "core/scene/schema/validate.h"
#include "tests/support/render_check.h"
#include "tests/support/significance.h"

namespace ls {
namespace {

using namespace test;

constexpr double kPi = cases::kPi;

struct Measured {
  double value = 0, standard_error = 0;  // of the green channel
};

// Adds a meter at points and returns its index.
MeterIndex add(SceneBuilder& builder, MeterKind kind, std::vector<MeterPoint> points) {
  builder.scene.meters.push_back({.name = "m", .kind = kind, .points = std::move(points)});
  return {static_cast<std::uint32_t>(builder.scene.meters.size() - 1)};
}
SceneBuilder& with_film(SceneBuilder& builder) {
  builder.scene.sensor.projection = Projection::meters;
  builder.scene.film = scene::film_of_meters(scene::meter_count(builder.scene));
  return builder;
}

Measured measured(const render::World& world, const PixelRect& block, std::uint64_t spp) {
  const auto tile = render::render_tile(world, block, {0, spp}, nullptr, nullptr);
  EXPECT_TRUE(tile.health.clean());
  const auto pixel = [&](std::size_t k) {
    return (double{tile.sums[kMeterPixels + k]} + double{tile.sums[4 * kMeterPixels + k]}) /
           static_cast<double>(spp);
  };
  Measured m;
  for (std::size_t k = 0; k < kMeterPixels; ++k) m.value += pixel(k) / kMeterPixels;
  double squares = 0;
  for (std::size_t k = 0; k < kMeterPixels; ++k) squares += (pixel(k) - m.value) * (pixel(k) - m.value);
  m.standard_error = std::sqrt(squares / (kMeterPixels - 1) / kMeterPixels);
  return m;
}

std::vector<Measured> measure(SceneBuilder builder, std::uint64_t spp) {
  with_film(builder);
  EXPECT_EQ(scene::find_inconsistency(builder.scene), "");
  const auto world = world_of(builder, 0, 2);
  std::vector<Measured> out(scene::meter_count(builder.scene));
  const MeterBlocks blocks(out.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i; (i = next++) < out.size();) out[i] = measured(*world, blocks.rect(i), spp);
  };
  {
    const std::jthread other(work);
    work();
  }
  return out;
}

// `rounding` bounds the relative error of float32 along a path of a few steps.
void expect_value(const Measured& m, double expected, double rounding = 1e-5) {
  EXPECT_NEAR(m.value, expected, kStandardErrors * m.standard_error + rounding * std::abs(expected));
  EXPECT_LE(m.standard_error, .05 * std::abs(expected)) << "too noisy to tell anything";
}

constexpr MeterPoint kUp{{{0, 0, 0}}, {{0, 0, 1}}};

TEST(Meters, IrradianceOfAConstantEnvironmentIsPiTimesItsRadiance) {
  SceneBuilder builder;
  builder.environment(2);
  add(builder, MeterKind::irradiance, {kUp});
  add(builder, MeterKind::fluence, {{{{1, 2, 3}}, {}}});
  add(builder, MeterKind::radiance, {{{{1, 2, 3}}, {{0, -.6, .8}}}});

  const auto values = measure(builder, 4);

  expect_value(values[0], 2 * kPi);
  expect_value(values[1], 8 * kPi);
  expect_value(values[2], 2);
}

// Meters are in no set of receivers.
TEST(Meters, MeasureTheLightOfLightsThatAreLinkedToEverythingElse) {
  SceneBuilder builder;
  const MeterIndex floor = add(builder, MeterKind::irradiance, {});
  Shape& s = builder.shape(RectangleShape{}, {}, builder.diffuse(0));
  s.meter = floor;
  s.link_sets = "floor";
  for (const char* receivers : {"floor", "-floor"})
    builder.scene.emitters.push_back(
        DirectionalEmitter{{0, 0, -1}, {3, 3, 3}, 0, true, {}, true, true, {receivers, ""}});
  builder.environment(2);
  std::get<ConstantEmitter>(builder.scene.emitters.back()).links.receivers = "floor";
  add(builder, MeterKind::irradiance, {{{{0, 0, 1}}, {{0, 0, 1}}}});
  add(builder, MeterKind::radiance, {{{{1, 2, 3}}, {{0, -.6, .8}}}});

  const auto values = measure(builder, 16);

  expect_value(values[0], 3);
  expect_value(values[1], 3);
  EXPECT_EQ(values[2].value, 0);
}

TEST(Meters, IrradianceOfADistantLightFallsWithTheCosine) {
  SceneBuilder builder;
  const double c = std::cos(.6), s = std::sin(.6);
  builder.scene.emitters.push_back(DirectionalEmitter{{{s, 0, -c}}, {3, 3, 3}});
  add(builder, MeterKind::irradiance, {kUp, {{{0, 0, 0}}, {{0, 0, -1}}}});
  add(builder, MeterKind::fluence, {{{{0, 0, 5}}, {}}});

  const auto values = measure(builder, 16);

  expect_value(values[0], 3 * c);
  EXPECT_EQ(values[1].value, 0);
  expect_value(values[2], 3);
}

// E = pi L (r / d)^2 cos for a sphere of radiance L and radius r at the distance d that is wholly above the
// plane.
TEST(Meters, IrradianceUnderASphericalLamp) {
  SceneBuilder builder;
  builder.lamp(SphereShape{}, translate({3, 0, 4}), {7, 7, 7});
  add(builder, MeterKind::irradiance, {kUp});

  expect_value(measure(builder, 16)[0], kPi * 7 / 25 * .8);
}

// A distant light along the normal fades over the distance from the top of the medium: exp(-sigma d). The
// medium is found by its boundary, from inside and on it.
TEST(Meters, IrradianceFadesThroughAnAbsorbingMedium) {
  SceneBuilder builder;
  builder.container(CubeShape{}, {}, builder.null(), builder.homogeneous({1.5, 1.5, 1.5}, {0, 0, 0}));
  builder.scene.emitters.push_back(DirectionalEmitter{{{0, 0, -1}}, {2, 2, 2}});
  const Vec3 up{{0, 0, 1}};
  add(builder, MeterKind::irradiance,
      {{{{0, 0, .5}}, up}, {{{.3, .2, -.9}}, up}, {{{0, 0, 1}}, up}, {{{0, 0, 3}}, up}, {{{0, 0, -3}}, up}});

  const auto values = measure(builder, 16);

  expect_value(values[0], 2 * std::exp(-1.5 * .5));
  expect_value(values[1], 2 * std::exp(-1.5 * 1.9));
  expect_value(values[2], 2);
  expect_value(values[3], 2);
  expect_value(values[4], 2 * std::exp(-1.5 * 2));
}

// A medium of source radiance S and extinction sigma that does not scatter has the radiance
// S (1 - exp(-sigma d)) over a length d.
TEST(Meters, RadianceOfASlabThatGlows) {
  SceneBuilder builder;
  const MediumIndex medium = builder.homogeneous({.8, .8, .8}, {0, 0, 0});
  builder.set_emission(medium, {5, 5, 5}, true);
  builder.container(CubeShape{}, {}, builder.null(), medium);
  const Vec3 up{{0, 0, 1}};
  add(builder, MeterKind::radiance, {{{{0, 0, -4}}, up}, {{{0, 0, 0}}, up}, {{{0, 0, 1.5}}, up}});

  const auto values = measure(builder, 64);

  expect_value(values[0], 5 * (1 - std::exp(-.8 * 2)));
  expect_value(values[1], 5 * (1 - std::exp(-.8)));
  EXPECT_EQ(values[2].value, 0);
}

// Under a constant environment every unshadowed surface of a convex body receives pi times its radiance.
TEST(Meters, FluxIsIrradianceTimesArea) {
  struct Body {
    Geometry geometry;
    Transform to_world;
    double area;
  };
  const Body bodies[] = {{RectangleShape{}, scale(2, 3, 1), 24},
                         {CubeShape{}, scale(.5), 6},
                         {SphereShape{}, translate({40, 0, 0}) * scale(3), 36 * kPi},
                         {DiskShape{}, scale(2, 1, 1), 2 * kPi},
                         {CylinderShape{{{0, 0, 0}}, {{0, 0, 2}}, .5}, {}, 2 * kPi}};
  for (const Body& b : bodies) {
    for (const MeterKind kind : {MeterKind::irradiance, MeterKind::flux}) {
      SceneBuilder builder;
      builder.environment(2);
      builder.scene.meters.push_back({.name = "m", .kind = kind});
      builder.shape(b.geometry, b.to_world, builder.diffuse(.7)).meter = MeterIndex{0};

      const auto value = measure(builder, 4)[0];

      expect_value(value, 2 * kPi * (kind == MeterKind::flux ? b.area : 1));
    }
  }
}

TEST(Meters, ShapesAreMeasuredOnTheSideOfTheirNormal) {
  for (const bool flipped : {false, true}) {
    SceneBuilder builder;
    builder.scene.emitters.push_back(DirectionalEmitter{{{0, 0, -1}}, {1, 1, 1}});
    builder.scene.meters.push_back({.name = "m", .kind = MeterKind::irradiance});
    Shape& s = builder.shape(RectangleShape{}, {}, builder.diffuse(.5));
    s.meter = MeterIndex{0};
    s.flip_normals = flipped;

    const double value = measure(builder, 4)[0].value;

    EXPECT_NEAR(value, flipped ? 0 : 1, 1e-5);
  }
}

// The mean over the shape: half of the rectangle is in the shadow of another.
TEST(Meters, IrradianceIsTheMeanOverTheShape) {
  SceneBuilder builder;
  builder.scene.emitters.push_back(DirectionalEmitter{{{0, 0, -1}}, {1, 1, 1}});
  builder.scene.meters.push_back({.name = "m", .kind = MeterKind::irradiance});
  builder.shape(RectangleShape{}, {}, builder.diffuse(0)).meter = MeterIndex{0};
  builder.shape(RectangleShape{}, translate({1, 0, .5}), builder.diffuse(0));

  expect_value(measure(builder, 16)[0], .5);
}

// A floor that is larger than the medium on it: its parts are inside and outside.
TEST(Meters, ShapesMayBePartlyInAMedium) {
  SceneBuilder builder;
  builder.container(CubeShape{}, translate({0, 0, 1}), builder.null(),
                    builder.homogeneous({1, 1, 1}, {0, 0, 0}));
  builder.scene.emitters.push_back(DirectionalEmitter{{{0, 0, -1}}, {1, 1, 1}});
  builder.scene.meters.push_back({.name = "m", .kind = MeterKind::irradiance});
  builder.shape(RectangleShape{}, scale(2, 1, 1), builder.diffuse(0)).meter = MeterIndex{0};

  expect_value(measure(builder, 64)[0], (1 + std::exp(-2)) / 2);
}

// In a closed box of albedo a whose walls emit 1 - a, the radiance is 1 everywhere; a white medium does not
// change that. Paths are long.
TEST(Meters, RadianceInAClosedBoxIsOne) {
  SceneBuilder builder;
  Shape& box =
      builder.container(CubeShape{}, {}, builder.diffuse(.8), builder.homogeneous({4, 4, 4}, {1, 1, 1}));
  box.emitter = AreaEmitter{builder.texture({.2, .2, .2})};
  box.flip_normals = true;
  std::swap(box.interior, box.exterior);
  builder.scene.meters.push_back({.name = "walls", .kind = MeterKind::irradiance});
  box.meter = MeterIndex{0};
  add(builder, MeterKind::irradiance, {{{{.1, .2, .3}}, {{0, .6, .8}}}});
  add(builder, MeterKind::fluence, {{{{.1, .2, .3}}, {}}});

  const auto values = measure(builder, 64);

  expect_value(values[0], kPi);
  expect_value(values[1], kPi);
  expect_value(values[2], 4 * kPi);
}

// A medium that absorbs nothing takes no light from a constant environment, however dense it is.
TEST(Meters, RadianceInADenseWhiteMediumIsThatAroundIt) {
  SceneBuilder builder;
  builder.environment(1);
  builder.container(SphereShape{}, {}, builder.null(), builder.homogeneous({20, 20, 20}, {1, 1, 1}));
  add(builder, MeterKind::irradiance, {{{{.5, 0, 0}}, {{0, 0, 1}}}});
  add(builder, MeterKind::radiance, {{{{0, 0, 0}}, {{0, 0, 1}}}});

  const auto values = measure(builder, 4);

  expect_value(values[0], kPi, 1e-4);
  expect_value(values[1], 1, 1e-4);
}

TEST(Meters, NothingIsMeasuredInTheDark) {
  SceneBuilder builder;
  builder.shape(SphereShape{}, {}, builder.diffuse(.5));
  builder.lamp(SphereShape{}, scale(.1), {1, 1, 1});
  add(builder, MeterKind::irradiance, {{{{2, 0, 0}}, {{-1, 0, 0}}}});

  EXPECT_EQ(measure(builder, 16)[0].value, 0);
}

// A lamp that is hidden from cameras still lights meters.
TEST(Meters, SeeWhatIsHiddenFromCameras) {
  SceneBuilder builder;
  builder.lamp(SphereShape{}, translate({0, 0, 5}), {7, 7, 7}).visible_camera = false;
  builder.scene.integrator.hide_emitters = true;
  add(builder, MeterKind::irradiance, {kUp});
  add(builder, MeterKind::radiance, {kUp});

  const auto values = measure(builder, 16);

  expect_value(values[0], kPi * 7 / 25);
  expect_value(values[1], 7);
}

// Points on surfaces, however large these are, see what is in front of them.
TEST(Meters, MayStandOnSurfaces) {
  SceneBuilder builder;
  builder.environment(1);
  builder.shape(RectangleShape{}, scale(3000), builder.diffuse(0));
  builder.shape(SphereShape{}, translate({0, 0, -1}), builder.diffuse(0));
  add(builder, MeterKind::irradiance, {kUp, {{{1, 2, 0}}, {{0, 0, 1}}}, {{{2999, 0, 0}}, {{0, 0, 1}}}});
  add(builder, MeterKind::radiance, {kUp});

  const auto values = measure(builder, 4);

  for (std::size_t i = 0; i < 3; ++i) expect_value(values[i], kPi);
  expect_value(values[3], 1);
}

TEST(Meters, CountSegmentsFromTheMeter) {
  SceneBuilder builder;
  builder.environment(1);
  builder.shape(RectangleShape{}, translate({0, 0, 1}) * rotate_x(180) * scale(100), builder.diffuse(.5));
  builder.shape(RectangleShape{}, translate({0, 0, -1}) * scale(100), builder.diffuse(.5));
  add(builder, MeterKind::irradiance, {kUp});
  builder.scene.integrator.max_depth = 1;

  EXPECT_LT(measure(builder, 16)[0].value, 1e-2);  // nothing shines but the far rim of the sky

  builder.scene.emitters.clear();
  builder.scene.shapes[0].emitter = AreaEmitter{builder.texture({1, 1, 1})};
  EXPECT_NEAR(measure(builder, 16)[0].value, kPi, 1e-2);
  builder.scene.integrator.max_depth = 0;
  EXPECT_EQ(measure(builder, 16)[0].value, 0);
}

TEST(Meters, PathsShareNothing) {
  SceneBuilder builder;
  builder.shape(RectangleShape{}, scale(5), builder.diffuse(.5));
  builder.scene.emitters.push_back(DirectionalEmitter{{{0, 0, -1}}, {1, 1, 1}});
  builder.scene.integrator.path_reuse = 16;
  builder.scene.integrator.light_vertices = 1;
  add(builder, MeterKind::irradiance, {kUp});

  const TechniqueSet used = render::techniques_of(*world_of(with_film(builder)));

  EXPECT_FALSE(used.has(Technique::path_reuse));
  EXPECT_FALSE(used.has(Technique::light_vertices));
}

TEST(Meters, ShapesWithoutAreaAndForeignSettingsAreRefused) {
  SceneBuilder flat;
  flat.scene.meters.push_back({.name = "desk", .kind = MeterKind::irradiance});
  MeshShape mesh{.file = flat.asset("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")};
  flat.shape(mesh, {}, flat.diffuse(.5)).meter = MeterIndex{0};
  const auto built = render::build_world(with_film(flat).scene, settings_of(flat.scene), flat.files, 1);
  ASSERT_FALSE(built);
  EXPECT_NE(built.error().message.find("desk"), std::string::npos) << built.error().message;

  SceneBuilder builder;
  builder.environment(1);
  add(builder, MeterKind::irradiance, {kUp});
  RenderSettings settings = settings_of(with_film(builder).scene);
  settings.meters = 2;
  EXPECT_FALSE(render::build_world(builder.scene, settings, {}, 1));
  settings.meters = 1;
  settings.size = {32, 32};
  EXPECT_FALSE(render::build_world(builder.scene, settings, {}, 1));
}

// A hall with haze: a lamp, walls, and a medium that scatters.
SceneBuilder hall() {
  SceneBuilder builder;
  Shape& walls = builder.container(CubeShape{}, scale(4, 3, 2), builder.diffuse(.5),
                                   builder.homogeneous({.2, .2, .2}, {.9, .9, .9}, .6));
  walls.flip_normals = true;
  std::swap(walls.interior, walls.exterior);
  builder.lamp(SphereShape{}, translate({1, 0, 1.5}) * scale(.2), {30, 30, 30});
  return builder;
}

TEST(Meters, ListsMeasureWhatSingleMetersDo) {
  const std::vector<MeterPoint> places = {
      {{{-2, 1, -1}}, {{0, 0, 1}}}, {{{3, 2, -1.9}}, {{0, 0, 1}}}, {{{-3.9, 0, 0}}, {{1, 0, 0}}}};
  SceneBuilder list = hall(), singles = hall();
  add(list, MeterKind::irradiance, places);
  for (const MeterPoint& p : places) add(singles, MeterKind::irradiance, {p});
  SceneBuilder reversed = hall();
  add(reversed, MeterKind::irradiance, {places.rbegin(), places.rend()});

  const auto a = measure(list, 16), b = measure(singles, 16), c = measure(reversed, 16);

  for (std::size_t i = 0; i < places.size(); ++i) {
    // The same blocks have the same random numbers, so the same bits; other blocks agree within their errors.
    EXPECT_EQ(a[i].value, b[i].value);
    EXPECT_NEAR(a[i].value, c[2 - i].value,
                kStandardErrors * std::hypot(a[i].standard_error, c[2 - i].standard_error));
  }
}

// The 95 % interval of Student's t with 255 degrees of freedom contains the value, which the mean of all
// meters tells 31 times as exactly, in 95 % of all cases: here, of many meters at one place.
TEST(Meters, IntervalsCoverTheValue) {
  constexpr std::size_t kMeters = 1000;
  constexpr double kStudent = 1.96931;
  for (const MeterKind kind : {MeterKind::irradiance, MeterKind::radiance}) {
    SceneBuilder builder = hall();
    const MeterPoint point{{{-2, 1, -1}}, {{.6, 0, .8}}};
    add(builder, kind, std::vector(kMeters, point));

    const auto values = measure(builder, 4);

    double truth = 0;
    for (const Measured& m : values) truth += m.value / kMeters;
    const auto inside = std::ranges::count_if(
        values, [&](const Measured& m) { return std::abs(m.value - truth) <= kStudent * m.standard_error; });
    // The share of 1000 meters has the standard deviation .0069.
    EXPECT_NEAR(static_cast<double>(inside) / kMeters, .95, kStandardErrors * std::sqrt(.95 * .05 / kMeters))
        << scene::name_of(kind);
    std::printf("%s: %ld of %zu intervals\n", std::string(scene::name_of(kind)).c_str(), inside, kMeters);
  }
}

}  // namespace
}  // namespace ls

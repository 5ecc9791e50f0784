// Direct light on a grey floor from lamps and from environment maps, and light reflected between surfaces.
// The environment maps are constant, fall linearly from the zenith to the horizon, or are black but for one
// texel: for these the irradiance has a closed form.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

void direct(Table& t) {
  // BSDF sampling hits the smallest of these lights with one path in 40,000, so nearly all of its light comes
  // from light sampling.
  const auto add = [&](const char* name, SceneBuilder builder, double irradiance) {
    t.mean(std::string("7.6g-") + name, "7.6g N26", "Direct light on a floor, by the light's closed form.",
           std::move(builder), reflected(irradiance), {.slack = 5e-5});
  };
  const auto below = [](const Geometry& lamp, const Transform& to_world) {
    return with_lamp(floor_point(), lamp, to_world);
  };
  add("direct-square", below(RectangleShape{}, translate({0, 0, 1.25}) * rotate_x(180) * scale(.8)),
      below_a_square(.8 / 1.25));
  add("direct-disk", below(DiskShape{}, translate({0, 0, 1.5}) * rotate_x(180) * scale(.7)),
      kPi * .49 / (.49 + 2.25));
  add("direct-sphere", below(SphereShape{}, translate({0, 0, 2}) * scale(.5)), kPi * .25 / 4);
  add("direct-distant-sphere", below(SphereShape{}, translate({0, 0, 1000}) * scale(5)),
      kPi * 25 / 1e6);  // the light has a solid angle of 8e-5 sr
  add("direct-point", with(floor_point(), PointEmitter{{.5, 0, 1}, rgb(3)}), 3 / std::pow(1.25, 1.5));
  // The light points along -z. The direction from it to the point of the floor that is seen is 20 degrees off
  // its axis, halfway between the beam width (10 degrees) and the cutoff (30), so the intensity is halved.
  const double tangent = std::tan(20 * kPi / 180), cosine = std::cos(20 * kPi / 180);
  add("direct-spot-falloff",
      with(floor_point(), SpotEmitter{translate({tangent, 0, 1}) * rotate_x(180), rgb(2), 30, 10, {}}),
      .5 * 2 * cosine * cosine * cosine);
  {
    // A checkerboard of two colours divides the sphere into quarters. From below, equal parts of both colours
    // are visible, so the floor receives the mean of the two.
    SceneBuilder builder = floor_point();
    const TextureIndex dark = builder.texture(rgb(.25)), bright = builder.texture(rgb(1.5));
    builder.lamp(SphereShape{}, translate({0, 0, 2}) * scale(.5)).emitter = AreaEmitter{
        SceneBuilder::push<TextureTag>(builder.scene.textures, CheckerboardTexture{dark, bright, {}})};
    add("direct-checkered-sphere", builder, kPi * .25 / 4 * (.25 + 1.5) / 2);
  }
  // Lights of all kinds in one scene, to test the choice among lights.
  add("direct-three-lights",
      with(with(below(SphereShape{}, translate({0, 0, 2}) * scale(.5)), PointEmitter{{.5, 0, 1}, rgb(.3)}),
           DirectionalEmitter{{1, 0, -1}, rgb(.2)}),
      kPi * .25 / 4 + .3 / std::pow(1.25, 1.5) + .2 / std::sqrt(2.));
}

// m glass plates of index 1.5 at normal incidence, in front of a black wall. Each face reflects r = 0.04, so
// the plates transmit T = (1 - r) / (1 + (2 m - 1) r) and reflect 1 - T. For 500 plates, a thousand
// interfaces, T = 3 / 128, and paths have a thousand vertices on average. The band, half a per cent of the
// reflectance, is a fifth of T, so the case also tests T.
void plates(Table& table, int m) {
  SceneBuilder builder;
  const BsdfIndex glass = builder.glass(1.5), black = builder.diffuse(0);
  for (int i = 0; i < m; ++i) builder.shape(CubeShape{}, translate({0, 0, 1. * i}) * scale(9, 9, .25), glass);
  builder.shape(RectangleShape{}, translate({0, 0, -2}) * scale(20), black);
  builder.environment();
  builder.look({0, 0, m + 1.}, {0, 0, 0}, 1e-3, {0, 1, 0});
  const double r = .04, t = (1 - r) / (1 + (2 * m - 1) * r);
  table.mean(
      fmt::format("N42-{}-plates-of-glass", m), "N42 7.6g",
      "A thousand interfaces at normal incidence: R = 1 - T, T = (1 - r) / (1 + (2 m - 1) r) = 3 / 128.",
      builder, grey(1 - t),
      {.band = .005, .why_band = "paths of a thousand interfaces on average", .slow = true});
}

constexpr int kWidth = 64, kRows = 33, kSunX = 21, kSunY = 7;

// The up axis of maps is y. This rotation turns it to z, the up axis of these scenes.
Transform upright() { return rotate_x(90); }

// Returns a map of height `height`. Its upper half falls linearly with the polar angle q from `top` at the
// zenith to black at the horizon, and its lower half is black. A zenith of radiance 1 gives a horizontal
// plane the irradiance
//   E = 2 pi int_0^(pi/2) (1 - 2 q / pi) sin q cos q dq = pi / 2.
SkyImage gradient(const Rgb& top, int width = 4, int height = 3) {
  SkyImage s(width, height);
  const int horizon = (height - 1) / 2;
  for (int y = 0; y < horizon; ++y) {
    const double k = 1 - static_cast<double>(y) / horizon;
    s.set_row(y, {k * top[0], k * top[1], k * top[2]});
  }
  return s;
}
constexpr double kOfGradient = kPi / 2;
double of_sun() { return one_texel_irradiance(kWidth, kRows, kSunX, kSunY)[1]; }

Channels reflected_of(const Rgb& light, double irradiance) {
  const double grey = reflected(irradiance)[0];
  return {light[0] * grey, light[1] * grey, light[2] * grey};
}

void on_a_floor(Table& t) {
  const auto add = [&](const char* name, const SkyImage& sky, const Channels& expected) {
    SceneBuilder builder = floor_point();
    add_sky(builder, sky, upright());
    t.mean(std::string("7.6g-sky-") + name, "7.6g", "An environment map over a floor, by its closed form.",
           builder, expected, {.channels = true});
  };
  add("of-one-value", SkyImage(8, 5, 1), grey(.5));
  add("gradient", gradient({1, 2, 3}), reflected_of({1, 2, 3}, kOfGradient));
  {
    SkyImage s(kWidth, kRows);
    s.set(kSunX, kSunY, {34000, 30000, 20000});
    add("sun-of-one-texel", s, reflected_of({34000, 30000, 20000}, of_sun()));
  }
  {
    // Sky and sun have different colours. Directions must be sampled by luminance: the case fails if they are
    // sampled by one colour channel while the pdf is computed from another.
    const Rgb top{.5, 1, 4}, sun{340, 300, 200};
    SkyImage s = gradient(top, kWidth, kRows);
    const double k = 1 - kSunY / 16.;
    s.set(kSunX, kSunY, {k * top[0] + sun[0], k * top[1] + sun[1], k * top[2] + sun[2]});
    Channels expected = reflected_of(sun, of_sun());
    for (std::size_t c = 0; c < 3; ++c) expected[c] += reflected_of(top, kOfGradient)[c];
    add("sun-and-blue", s, expected);
  }
  SceneBuilder builder = floor_point();
  add_sky(builder, gradient(rgb(1)), upright());
  builder.scene.emitters.push_back(PointEmitter{{.5, 0, 1}, rgb(3)});
  builder.scene.emitters.push_back(DirectionalEmitter{{1, 0, -1}, rgb(2)});
  t.mean("7.6g-sky-and-other-lights", "7.6g", "A map, a lamp and the sun: the choice among them.", builder,
         reflected(kOfGradient + 3 / std::pow(1.25, 1.5) + 2 / std::sqrt(2.)), {.channels = true});
}

// The point of the floor that is seen is the centre of a ball of radius 1 whose medium only absorbs. Light
// from any direction enters the ball through a surface with a null (pass-through) BSDF and travels one
// radius. The camera is in the ball, close to the floor.
void through_a_ball(Table& t) {
  SceneBuilder builder = floor_point(.5);
  const Rgb sigma{.3, .6, 1.1};
  const MediumIndex dark = builder.homogeneous(sigma, rgb(0));
  builder.container(SphereShape{}, {}, builder.null(), dark);
  builder.scene.sensor.medium = dark;
  builder.look({-2e-3, 1e-3, 6e-4}, {0, 0, 0}, 1e-3);
  SkyImage s(kWidth, kRows);
  s.set(kSunX, kSunY, rgb(1000));
  add_sky(builder, s, upright());
  Channels expected = reflected_of(rgb(1000), of_sun());
  for (std::size_t c = 0; c < 3; ++c)
    expected[c] *= std::exp(-sigma[c] * (1 + std::sqrt(4e-6 + 1e-6 + 3.6e-7)));
  t.mean("7.6g-sky-sun-through-an-absorbing-ball/homogeneous/volpath", "7.6g 7.6a",
         "A map's sun over a floor in the middle of a ball that absorbs.", builder, expected);
}

}  // namespace

void add_direct_light(Table& t) {
  direct(t);
  plates(t, 500);
  for (const bool sphere : {false, true}) {
    // The walls of a closed room emit radiance 1 and reflect half, so the radiance is 1 / (1 - .5)
    // everywhere.
    SceneBuilder builder;
    const TextureIndex one = builder.texture(rgb(1));
    const BsdfIndex white = builder.diffuse(.5);
    Shape& s = sphere ? builder.shape(SphereShape{}, {}, white) : builder.shape(CubeShape{}, {}, white);
    s.flip_normals = true;
    s.emitter = AreaEmitter{one};
    builder.look({.2, -.3, .1}, {.5, .9, 0}, 60);
    t.mean(sphere ? "7.6c-grey-room-sphere" : "7.6c-grey-room-cube", "7.6c N39",
           "A closed room: Le / (1 - rho).", builder, grey(2));
  }
}

void add_skies(Table& t) {
  on_a_floor(t);
  through_a_ball(t);
}

}  // namespace ls::cases

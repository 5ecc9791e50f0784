// Light from environment maps on a floor. The closed forms are of maps that are constant, that fall linearly
// from the zenith to the horizon, and that are black but for one texel.
#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/fixtures.h"
#include "validation/fixtures/sky_builder.h"

namespace ls::cases {
namespace {

constexpr int kWidth = 64, kRows = 33, kSunX = 21, kSunY = 7;

// Maps have y up; here z is up.
Transform upright() { return rotate_x(90); }

// Rows of the upper half of a map of height `height`, which fall linearly with the angle from `top` at the
// zenith to black at the horizon:
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
    // Sky and sun differ in colour. Directions must be sampled by luminance: the case fails if they are
    // sampled by one channel with the density of another.
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

// The floor's middle is the centre of a ball that only absorbs: light from any direction comes in through a
// null boundary and goes one radius. The camera is in the ball, close to the floor.
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

void add_skies(Table& t) {
  on_a_floor(t);
  through_a_ball(t);
}

}  // namespace ls::cases

// Light from environment maps, on a floor and in media.
#include <cmath>

#include "tests/statistical/case.h"
#include "tests/support/sky_builder.h"

namespace ls::test {
namespace {

constexpr double kReflectance = .5;

// The maps' y is up; here z is.
Transform upright() { return rotate_x(90); }

// The point of the floor at the origin, seen from the side; radiance = reflectance / pi x irradiance.
SceneBuilder floor(double size = 3) {
  SceneBuilder builder;
  const BsdfIndex white = builder.diffuse(kReflectance);
  builder.shape(RectangleShape{}, scale(size), white);
  builder.scene.integrator.max_depth = 2;
  builder.look({-2, 1, .6}, {0, 0, 0}, 1e-3);
  return builder;
}

// Falls linearly in the angle from `top` above to black at the horizon:
//   E = 2 pi int_0^(pi/2) (1 - 2 q / pi) sin q cos q dq = pi / 2.
SkyImage gradient(const Rgb& top) {
  SkyImage s(4, 3);
  s.set_row(0, top);
  return s;
}

constexpr int kWidth = 64, kMapHeight = 33, kSunX = 21, kSunY = 7;

std::array<double, 3> reflected(const Rgb& light, double irradiance) {
  std::array<double, 3> out;
  for (std::size_t c = 0; c < 3; ++c) out[c] = light[c] * irradiance * kReflectance / kPi;
  return out;
}

void on_a_floor(std::vector<Case>& cases) {
  const double of_gradient = kPi / 2, of_sun = one_texel_irradiance(kWidth, kMapHeight, kSunX, kSunY)[1];
  {
    SceneBuilder builder = floor();
    add_sky(builder, SkyImage(8, 5, 1));
    cases.push_back({"sky_map_of_one_value", builder, grey(kReflectance), 1024});
  }
  {
    SceneBuilder builder = floor();
    add_sky(builder, gradient({1, 2, 3}), upright());
    cases.push_back({"sky_gradient", builder, reflected({1, 2, 3}, of_gradient), 1024});
  }
  {
    SceneBuilder builder = floor();
    SkyImage s(kWidth, kMapHeight);
    s.set(kSunX, kSunY, {34000, 30000, 20000});
    add_sky(builder, s, upright());
    cases.push_back({"sky_sun_of_one_texel", builder, reflected({34000, 30000, 20000}, of_sun), 256});
  }
  {
    // Of another colour than the sun: densities follow the luminance, not the channels. The rows of the image
    // above the horizon are those of gradient(), 16 of 32.
    SceneBuilder builder = floor();
    SkyImage s(kWidth, kMapHeight);
    const Rgb top{.5, 1, 4}, sun{340, 300, 200};
    for (int y = 0; y < 16; ++y) {
      const double k = 1 - y / 16.;
      s.set_row(y, {k * top[0], k * top[1], k * top[2]});
    }
    const double k = 1 - kSunY / 16.;
    s.set(kSunX, kSunY, {k * top[0] + sun[0], k * top[1] + sun[1], k * top[2] + sun[2]});
    add_sky(builder, s, upright());
    auto expected = reflected(sun, of_sun);
    for (std::size_t c = 0; c < 3; ++c) expected[c] += reflected(top, of_gradient)[c];
    cases.push_back({"sky_sun_and_blue", builder, expected, 1024});
  }
  {
    SceneBuilder builder = floor();
    add_sky(builder, gradient(rgb(1)), upright());
    builder.scene.emitters.push_back(PointEmitter{{.5, 0, 1}, rgb(3)});
    builder.scene.emitters.push_back(DirectionalEmitter{{1, 0, -1}, rgb(2)});
    const double e = of_gradient + 3 / std::pow(1.25, 1.5) + 2 / std::sqrt(2.);
    cases.push_back({"sky_and_other_lights", builder, grey(e * kReflectance / kPi), 1024});
  }
}

void through_media(std::vector<Case>& cases) {
  {
    // The floor's middle is the centre of a ball that only absorbs: one radius for light from any direction,
    // which comes in through a null boundary. The camera is in the ball, close by.
    SceneBuilder builder = floor(.5);
    const Rgb sigma{.3, .6, 1.1};
    const MediumIndex dark = builder.homogeneous(sigma, rgb(0));
    builder.container(SphereShape{}, {}, builder.null(), dark);
    builder.scene.sensor.medium = dark;
    builder.look({-2e-3, 1e-3, 6e-4}, {0, 0, 0}, 1e-3);
    SkyImage s(kWidth, kMapHeight);
    s.set(kSunX, kSunY, rgb(1000));
    add_sky(builder, s, upright());
    auto expected = reflected(rgb(1000), one_texel_irradiance(kWidth, kMapHeight, kSunX, kSunY)[1]);
    for (std::size_t c = 0; c < 3; ++c)
      expected[c] *= std::exp(-sigma[c] * (1 + std::sqrt(4e-6 + 1e-6 + 3.6e-7)));
    cases.push_back({"sky_sun_through_an_absorbing_ball", builder, expected, 1024});
  }
  const auto furnace = [&](const char* name, SceneBuilder builder, std::uint64_t spp) {
    add_sky(builder, SkyImage(16, 9, 1), rotate_x(30) * rotate_y(20));
    builder.look({.4, -6, .7}, {0, 0, 0}, 30);
    cases.push_back({name, std::move(builder), grey(1), spp});
  };
  {
    SceneBuilder builder;
    builder.container(SphereShape{}, {}, builder.null(), builder.homogeneous({1, 2.5, 4}, rgb(1), .6));
    furnace("sky_furnace_chromatic_ball", builder, 2048);
  }
  {
    SceneBuilder builder;
    std::vector<float> densities(12 * 9 * 7);
    for (std::size_t i = 0; i < densities.size(); ++i)
      densities[i] = i % 5 < 2 ? static_cast<float>(i % 11) / 4 : 0.f;
    const Transform box = translate({-1, -1, -1}) * scale(2);
    const VolumeIndex v = builder.grid({12, 9, 7}, densities, box);
    builder.container(CubeShape{}, {}, builder.null(), builder.heterogeneous(v, rgb(1), 2, -.5));
    furnace("sky_furnace_grid", builder, 1024);
  }
  {
    SceneBuilder builder;
    builder.container(SphereShape{}, {}, builder.glass(1.4), builder.homogeneous(rgb(2), rgb(1), .5));
    furnace("sky_furnace_glass_sphere_filled", builder, 1024);
  }
}

}  // namespace

void add_environments(std::vector<Case>& cases) {
  on_a_floor(cases);
  through_media(cases);
}

}  // namespace ls::test

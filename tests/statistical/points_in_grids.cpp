// Lights without an extent inside grids: segments are sampled equi-angularly about them, too.
#include <cmath>

#include "tests/statistical/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::test {
namespace {

using cases::integrate;

// A ray of length 6 along z whose middle is the origin, ended by a black plate; a medium of density r(z) = 1
// + z / 6, as a grid whose two nodes lie at z = -6 and 6; a light at (h, 0, 0) of intensity f(q) at the angle
// q from its way back to the origin. The density is linear, so that its integral over a way is the length
// times the mean of both ends' values; of one scattering: a / (4 pi) int s r(t) e^(-s ((t + 3) (r(-3) + r(t))
// / 2 + d (1 + r(t)) / 2)) f / d^2 dt.
constexpr double kPointHeight = .5;

template <class F>
std::array<double, 3> beside_a_ray(double sigma, const Rgb& albedo, F intensity) {
  const auto density = [](double z) { return 1 + z / 6; };
  const double at_albedo_1 = integrate(
      [&](double t) {
        const double d = std::hypot(kPointHeight, t), r = density(t);
        const double depth = sigma * ((t + 3) * (density(-3) + r) / 2 + d * (1 + r) / 2);
        return sigma * r * std::exp(-depth) / (4 * kPi * d * d) * intensity(std::atan2(t, kPointHeight));
      },
      -3, 3, 20000);
  return {albedo[0] * at_albedo_1, albedo[1] * at_albedo_1, albedo[2] * at_albedo_1};
}

SceneBuilder along_a_slope(double sigma, const Rgb& albedo, const Emitter& light) {
  SceneBuilder builder;
  const VolumeIndex v = builder.grid({1, 1, 2}, {0, 2}, translate({-12, -12, -12}) * scale(24));
  builder.scene.sensor.medium = builder.heterogeneous(v, albedo, sigma);
  builder.shape(RectangleShape{}, translate({0, 0, 3}) * scale(4) * rotate_x(180), builder.diffuse(0));
  builder.scene.emitters.push_back(light);
  builder.scene.integrator.max_depth = 2;
  builder.look({0, 0, -3}, {0, 0, 3}, 1e-4, {0, 1, 0});
  return builder;
}

}  // namespace

void add_points_in_grids(std::vector<Case>& cases) {
  const Rgb albedo{1, .8, .3};
  for (const double sigma : {.05, 1.}) {
    cases.push_back({sigma < 1 ? "point_in_thin_grid" : "point_in_grid",
                     along_a_slope(sigma, albedo, PointEmitter{{kPointHeight, 0, 0}, rgb(1)}),
                     beside_a_ray(sigma, albedo, [](double) { return 1.; }), 4096});
  }
  // Full within 30 degrees, falling linearly in the angle to 60.
  const auto beam = [](double q) {
    const double degrees = std::abs(q) * 180 / kPi;
    return degrees < 30 ? 1. : degrees < 60 ? (60 - degrees) / 30 : 0.;
  };
  cases.push_back(
      {"spot_in_grid",
       along_a_slope(.7, albedo,
                     SpotEmitter{look_at({kPointHeight, 0, 0}, {0, 0, 0}, {0, 1, 0}), rgb(1), 60, 30, {}}),
       beside_a_ray(.7, albedo, beam), 4096});
}

}  // namespace ls::test

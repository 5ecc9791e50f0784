// Grids of three channels, each with a density of its own: closed forms by channel.
#include <cmath>

#include "tests/statistical/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::test {
namespace {

using cases::integrate;

// Channel c has the density level (1 + slope z / 6), as a grid whose two nodes lie at z = -6 and 6. Linear,
// so that its integral over a way is the length times the mean of both ends' values.
constexpr double kLevel[3] = {1, .5, 3}, kSlope[3] = {1, -1, 0};
constexpr double kHeight = .5;

double density(std::size_t c, double z) { return kLevel[c] * (1 + kSlope[c] * z / 6); }
VolumeIndex slopes(SceneBuilder& builder) {
  std::vector<float> values;
  for (const double z : {-6., 6.})
    for (std::size_t c = 0; c < 3; ++c) values.push_back(static_cast<float>(density(c, z)));
  return builder.grid({1, 1, 2}, values, translate({-12, -12, -12}) * scale(24), 3);
}

// A ray of length 6 along z whose middle is the origin, ended by a black plate; a point of intensity 1 at
// (h, 0, 0). Of one scattering: a / (4 pi) int s r(t) e^(-s ((t + 3) (r(-3) + r(t)) / 2 + d (r(0) + r(t)) /
// 2)) / d^2 dt.
constexpr double kSigma = .6;
const Rgb kAlbedo{1, .8, .3};

SceneBuilder beside_a_point(const char* integrator, DistanceSampling distance = DistanceSampling::mis) {
  SceneBuilder builder;
  builder.scene.sensor.medium = builder.heterogeneous(slopes(builder), kAlbedo, kSigma);
  builder.shape(RectangleShape{}, translate({0, 0, 3}) * scale(4) * rotate_x(180), builder.diffuse(0));
  builder.scene.emitters.push_back(PointEmitter{{kHeight, 0, 0}, rgb(1)});
  builder.scene.integrator.name = integrator;
  builder.scene.integrator.distance = distance;
  builder.scene.integrator.max_depth = 2;
  builder.look({0, 0, -3}, {0, 0, 3}, 1e-4, {0, 1, 0});
  return builder;
}
std::array<double, 3> scattered_once() {
  std::array<double, 3> light;
  for (std::size_t c = 0; c < 3; ++c)
    light[c] = kAlbedo[c] * integrate(
                                [&](double t) {
                                  const double d = std::hypot(kHeight, t), r = density(c, t);
                                  const double depth = kSigma * ((t + 3) * (density(c, -3) + r) / 2 +
                                                                 d * (density(c, 0) + r) / 2);
                                  return kSigma * r * std::exp(-depth) / (4 * kPi * d * d);
                                },
                                -3, 3, 20000);
  return light;
}

// Where light comes from everywhere and nothing absorbs, everything is as bright as the light.
std::vector<float> patchy() {
  std::vector<float> v(12 * 9 * 7 * 3);
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = i % 5 < 2 ? static_cast<float>(i % 11) / 4 : 0.f;
  return v;
}
SceneBuilder patches(const Rgb& albedo) {
  SceneBuilder builder;
  const VolumeIndex v = builder.grid({12, 9, 7}, patchy(), translate({-1, -1, -1}) * scale(2), 3);
  builder.container(CubeShape{}, {}, builder.null(), builder.heterogeneous(v, albedo, 2, -.5));
  builder.environment();
  builder.look({.4, -3, .7}, {0, 0, 0}, 30);
  return builder;
}

// Seen through the slopes, from z = -3 to 3, and through another medium like them that lies in the same
// place.
SceneBuilder seen_through(int media) {
  SceneBuilder builder;
  const BsdfIndex null = builder.null();
  for (int i = 0; i < media; ++i)
    builder.container(CubeShape{}, scale(3 + .5 * i, 3, 3), null,
                      builder.heterogeneous(slopes(builder), rgb(0), .15 + .05 * i));
  builder.environment();
  // Beside the faces' diagonals: so narrow a view of them would be of their rounding.
  builder.look({.7, .3, -8}, {.7, .3, 3}, 1e-4, {0, 1, 0});
  return builder;
}
std::array<double, 3> left_of(double sigma) {
  std::array<double, 3> t;
  for (std::size_t c = 0; c < 3; ++c) t[c] = std::exp(-sigma * 6 * density(c, 0));
  return t;
}

}  // namespace

void add_channels(std::vector<Case>& cases) {
  cases.push_back({"channels_point", beside_a_point("volpath"), scattered_once(), 4096});
  cases.push_back({"channels_point_distant", beside_a_point("volpath_distant_mis"), scattered_once(), 4096});
  cases.push_back({"channels_point_distant_exponential",
                   beside_a_point("volpath_distant_mis", DistanceSampling::exponential), scattered_once(),
                   4096, .02});
  cases.push_back({"channels_furnace", patches(rgb(1)), grey(1), 256});
  SceneBuilder distant = patches(rgb(1));
  distant.scene.integrator.name = "volpath_distant_mis";
  cases.push_back({"channels_furnace_distant", distant, grey(1), 256});
  // In balance with its surroundings a medium of their radiance is not seen, whatever its albedo.
  SceneBuilder warm = patches({.8, .3, .5});
  std::get<HeterogeneousMedium>(warm.scene.media[0]).source_radiance = warm.constant(rgb(1));
  cases.push_back({"channels_in_balance", warm, grey(1), 256});
  cases.push_back({"channels_seen_through", seen_through(1), left_of(.15), 256});
  cases.push_back({"channels_seen_through_two", seen_through(2), left_of(.35), 256});
}

}  // namespace ls::test

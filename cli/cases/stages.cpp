#include "cli/cases/stages.h"

#include <cmath>

namespace ls::cases {

SceneKit unit_cube(const Way& way, const Rgb& sigma_t, const Rgb& albedo, double g) {
  SceneKit kit;
  way.choose(kit);
  const MediumIndex m = way.medium(kit, sigma_t, albedo, g, Transform{});
  kit.container(CubeShape{}, translate({.5, .5, .5}) * scale(.5), kit.null(), m);
  kit.look({-3, .5, .5}, {.5, .5, .5});
  return kit;
}

SceneKit head_on(const Way& way, double g, double sigma, bool backlit) {
  SceneKit kit = unit_cube(way, rgb(sigma), rgb(1), g);
  kit.scene.sensor.projection = Projection::orthographic;
  kit.scene.sensor.to_world = look_at({-3, .5, .5}, {.5, .5, .5}, {0, 0, 1}) * scale(.01, .01, 1);
  kit.scene.emitters.push_back(DirectionalEmitter{{backlit ? -1. : 1., 0, 0}, rgb(1)});
  kit.scene.integrator.max_depth = kOnce;
  return kit;
}

double head_on_answer(double g, double sigma) {
  const double near = 1 - std::abs(g), peak = (1 + std::abs(g)) / (near * near) / (4 * kPi);
  return peak * (g > 0 ? sigma * std::exp(-sigma) : -std::expm1(-2 * sigma) / 2);
}

SceneKit lit_cube(const Way& way, const Rgb& sigma_t, const Rgb& albedo, double y, const Vec3& at,
                  double size) {
  SceneKit kit;
  way.choose(kit);
  const auto there = [&](const Vec3& p) -> Vec3 {
    return {at[0] + size * p[0], at[1] + size * p[1], at[2] + size * p[2]};
  };
  Rgb sigma;
  for (std::size_t k = 0; k < 3; ++k) sigma[k] = sigma_t[k] / size;
  const MediumIndex m = way.medium(kit, sigma, albedo, 0, box(there({-1, -1, -1}), there({1, 1, 1})));
  kit.container(CubeShape{}, translate(at) * scale(size), kit.null(), m);
  kit.scene.emitters.push_back(DirectionalEmitter{{0, -1, 0}, rgb(1)});
  kit.scene.integrator.max_depth = kOnce;
  kit.look(there({0, y, -3}), there({0, y, 0}), 1e-3, {0, 1, 0});
  kit.scene.sensor.near_clip = 1e-6 * size;
  kit.scene.sensor.far_clip = 1e8 * size;
  return kit;
}

double lit_cube_answer(double s, double albedo, double y) {
  return albedo * -std::expm1(-2 * s) * std::exp(-s * (1 - y)) / (4 * kPi);
}

SceneKit passing(const Way& way, const Rgb& sigma_t, const Rgb& albedo) {
  SceneKit kit;
  way.choose(kit);
  kit.scene.sensor.medium = way.medium(kit, sigma_t, albedo, 0, box({-50, -50, -50}, {50, 50, 50}));
  kit.shape(RectangleShape{}, translate({0, 0, 3}) * scale(4) * rotate_x(180), kit.diffuse(0));
  kit.scene.integrator.max_depth = kOnce;
  kit.look({0, 0, -3}, {0, 0, 3}, 1e-4, {0, 1, 0});
  return kit;
}

double passing_answer(double h, double sigma, double albedo) {
  // By the angle q seen from the light, t = h tan q: dt / (h^2 + t^2) = dq / h, smooth for any h.
  const double end = std::atan(3 / h);
  return albedo * sigma / (16 * kPi * kPi * h) *
         integrate(
             [&](double q) {
               const double t = h * std::tan(q);
               return std::exp(-sigma * (t + 3 + std::hypot(h, t)));
             },
             -end, end, 200'000);
}

SceneKit lit_floor() {
  SceneKit kit;
  kit.shape(RectangleShape{}, {}, kit.diffuse(.5));
  kit.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, rgb(1)});
  kit.scene.integrator.max_depth = kOnce;
  kit.look({-3, .1, .4}, {0, 0, 0}, 1e-3);
  return kit;
}

SceneKit column(const Way& way, const Slab& slab, bool transmitted) {
  SceneKit kit;
  way.choose(kit);
  const double top = slab.tau + 3, bottom = -2, half = (top - bottom) / 2, middle = (top + bottom) / 2;
  const MediumIndex m =
      way.medium(kit, rgb(1), rgb(slab.albedo), slab.g, box({-40, -40, -1}, {40, 40, slab.tau + 1}));
  const BsdfIndex mirror = kit.mirror(), black = kit.diffuse(0), null = kit.null();
  const BsdfIndex face = slab.ior == 1 ? null : kit.glass(slab.ior);
  const double reach = slab.reach();
  for (const double x : {-slab.wall, slab.wall}) {
    kit.shape(RectangleShape{}, translate({x, 0, middle}) * rotate_y(90) * scale(half, reach, 1), mirror);
    kit.shape(RectangleShape{}, translate({0, x, middle}) * rotate_x(90) * scale(reach, half, 1), mirror);
  }
  kit.container(RectangleShape{}, translate({0, 0, slab.tau}) * scale(reach), face, m);
  kit.container(RectangleShape{}, rotate_x(180) * scale(reach), face, m);
  if (slab.split)
    kit.container(RectangleShape{}, translate({0, 0, slab.tau / 3}) * scale(reach), null, m).exterior = m;
  kit.shape(RectangleShape{}, translate({0, 0, transmitted ? slab.tau + 2 : -1}) * scale(reach), black);
  kit.environment();
  kit.look({.1, .15, slab.tau + 1}, {.1, .15, 0}, 1e-3, {0, 1, 0});
  return kit;
}

AssetIndex text_file(SceneKit& kit, const std::string& name, const std::string& bytes) {
  static const ScratchFolder folder;
  const Asset asset{name, sha256(bytes), bytes.size()};
  const auto path = folder.path() / asset.digest.hex();
  std::ofstream(path, std::ios::binary) << bytes;
  kit.files[asset.digest] = path;
  return SceneKit::push<AssetTag>(kit.scene.assets, asset);
}

SceneKit half_space(const Way& way, double albedo, double depth, double cosine) {
  SceneKit kit;
  way.choose(kit);
  const MediumIndex m = way.medium(kit, rgb(depth), rgb(albedo), 0, box({-.5, -.5, -1}, {.5, .5, 0}));
  kit.container(CubeShape{}, translate({0, 0, -.5}) * scale(.5), kit.null(), m);
  kit.shape(RectangleShape{}, translate({0, 0, -1.25}) * scale(2), kit.diffuse(0));
  kit.environment();
  kit.look({2 * std::sqrt(1 - cosine * cosine), 0, 2 * cosine}, {0, 0, 0}, 1e-3, {0, 1, 0});
  return kit;
}

}  // namespace ls::cases

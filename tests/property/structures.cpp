#include "tests/property/structures.h"

namespace ls::test {
namespace {

SceneBuilder lit_room() {
  SceneBuilder builder({12, 12});
  const BsdfIndex wall = builder.bsdf(DiffuseBsdf{builder.texture({.75, .5, .25})});
  // Clear of the media: which of two surfaces in one place a ray meets first is another question.
  builder.shape(RectangleShape{}, translate({0, 0, -1.25}) * scale(4), wall);
  builder.shape(RectangleShape{}, translate({0, 2, 0}) * rotate_x(90) * scale(4), wall);
  builder.look({0, -5, 1}, {0, 0, 0}, 45);
  builder.scene.film.filter = TentFilter{};
  builder.scene.integrator.max_depth = 6;
  return builder;
}
const Transform kBox = translate({-1, -1, -1}) * scale(2);

SceneBuilder cloud() {
  SceneBuilder builder = lit_room();
  std::vector<float> values(6 * 5 * 4);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>((i * 7919) % 11) / 4;
  const MediumIndex m = builder.heterogeneous(builder.grid({6, 5, 4}, values, kBox), {.9, .8, .5}, .75, .5);
  builder.container(CubeShape{}, {}, builder.null(), m);
  builder.scene.emitters.push_back(PointEmitter{{1.5, -2, 2}, {8, 6, 4}});
  builder.scene.emitters.push_back(DirectionalEmitter{{.25, .5, -1}, {1, .5, .25}});
  return builder;
}
SceneBuilder coloured_cloud() {
  SceneBuilder builder = lit_room();
  std::vector<float> values(6 * 5 * 4 * 3);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>((i * 7919) % 11) / 4;
  const MediumIndex m =
      builder.heterogeneous(builder.grid({6, 5, 4}, values, kBox, 3), {.9, .8, .5}, .75, .5);
  builder.container(CubeShape{}, {}, builder.null(), m);
  builder.scene.emitters.push_back(PointEmitter{{1.5, -2, 2}, {8, 6, 4}});
  builder.environment(.125);
  return builder;
}
SceneBuilder coloured_fog() {
  SceneBuilder builder = lit_room();
  builder.container(SphereShape{}, {}, builder.null(), builder.homogeneous({.25, 1, 2}, {.9, .7, .5}, -.25));
  builder.scene.emitters.push_back(
      SpotEmitter{look_at({0, -1.5, 2.5}, {0, 0, 0}, {0, 1, 0}), {20, 20, 30}, 30, 10, {}});
  builder.environment(.125);
  return builder;
}
SceneBuilder milk_in_glass() {
  SceneBuilder builder = lit_room();
  builder.container(SphereShape{}, {}, builder.glass(1.5), builder.homogeneous({2, 3, 4}, {.95, .9, .8}));
  builder.lamp(RectangleShape{}, translate({0, 0, 3}) * rotate_x(180), {4, 3, 2});
  return builder;
}
SceneBuilder surfaces() {
  SceneBuilder builder = lit_room();
  const TextureIndex rough = builder.texture({.25, .25, .25});
  builder.shape(
      SphereShape{}, translate({-1, 0, 0}) * scale(.75),
      builder.bsdf(RoughConductorBsdf{
          Microfacet::ggx, rough, rough, {.2, .9, 1.1}, {3.9, 2.4, 2.2}, builder.texture({1, 1, 1})}));
  builder.shape(
      CubeShape{}, translate({1.25, 0, -.5}) * scale(.5),
      builder.bsdf(PlasticBsdf{1.5, 1, false, builder.texture({.5, .25, .125}), builder.texture({1, 1, 1})}));
  builder.lamp(DiskShape{}, translate({0, 0, 3}) * rotate_x(180), {4, 3, 2});
  builder.scene.emitters.push_back(DirectionalEmitter{{.25, .5, -1}, {1, .5, .25}, .5});
  builder.environment(.125);
  builder.scene.sensor.aperture_radius = .0625;
  builder.scene.sensor.focus_distance = 5;
  return builder;
}
// A leaf, a rough pane before fog, and a lamp with an intensity by direction behind both.
SceneBuilder sheets() {
  SceneBuilder builder = lit_room();
  const TextureIndex rough = builder.texture({.25, .25, .25}), white = builder.texture({1, 1, 1});
  builder.shape(DiskShape{}, translate({-1, -.5, 0}) * rotate_x(70) * scale(.75),
                builder.bsdf(DiffuseTransmissionBsdf{builder.texture({.25, .5, .25}),
                                                     builder.texture({.25, .375, .125})}));
  builder.container(
      CubeShape{}, translate({1, 0, 0}) * rotate_x(20) * scale(.5),
      builder.bsdf(RoughThinDielectricBsdf{Microfacet::ggx, rough, rough, 1.5, 1, white, white}),
      builder.homogeneous({.5, 1, 2}, {.9, .7, .5}));
  const TextureIndex dim = builder.texture({2, 2, 2}), bright = builder.texture({8, 6, 4});
  builder.scene.textures.push_back(CheckerboardTexture{dim, bright, {{2, 0, 0, 0, 2, 0, 0, 0, 1}}});
  const TextureIndex board{static_cast<std::uint32_t>(builder.scene.textures.size() - 1)};
  builder.scene.emitters.push_back(
      GoniometricEmitter{translate({0, 1, 1}) * rotate_x(30), {1, .75, .5}, board});
  return builder;
}
SceneBuilder flame() {
  SceneBuilder builder = lit_room();
  HeterogeneousMedium m;
  std::vector<float> values{0, .5f, 1, .25f, .75f, 0, 1, .5f};
  m.sigma_t = builder.grid({2, 2, 2}, values, kBox);
  m.albedo = builder.constant({.5, .5, .5});
  m.phase = builder.phase(0);
  m.source_radiance = builder.constant({2, 1, .5});
  builder.container(CubeShape{}, {}, builder.null(), SceneBuilder::push<MediumTag>(builder.scene.media, m));
  return builder;
}

}  // namespace

std::vector<NamedScene> different_scenes() {
  std::vector<NamedScene> all{{"a cloud", cloud()},
                              {"coloured fog", coloured_fog()},
                              {"milk in glass", milk_in_glass()},
                              {"surfaces", surfaces()},
                              {"sheets", sheets()},
                              {"a flame", flame()}};
  SceneBuilder distant = cloud();
  distant.scene.integrator.name = "volpath_distant_mis";
  all.push_back({"a cloud, distances by light", distant});
  all.push_back({"a cloud of three channels", coloured_cloud()});
  return all;
}

bool may_stand_twice(const Emitter& e) {
  return !std::holds_alternative<ConstantEmitter>(e) && !std::holds_alternative<EnvmapEmitter>(e);
}

void dim(Emitter& e, double by) {
  const auto times = [&](Rgb& c) {
    for (double& x : c) x *= by;
  };
  std::visit(
      [&](auto& light) {
        if constexpr (requires { light.scale; })
          light.scale *= by;
        else if constexpr (requires { light.radiance; })
          times(light.radiance);
        else if constexpr (requires { light.irradiance; })
          times(light.irradiance);
        else
          times(light.intensity);
      },
      e);
}

}  // namespace ls::test

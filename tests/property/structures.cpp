#include "tests/property/structures.h"

#include "common/base/overloaded.h"

namespace ls::test {
namespace {

SceneKit lit_room() {
  SceneKit kit({12, 12});
  const BsdfIndex wall = kit.bsdf(DiffuseBsdf{kit.texture({.75, .5, .25})});
  // Clear of the media: which of two surfaces in one place a ray meets first is another question.
  kit.shape(RectangleShape{}, translate({0, 0, -1.25}) * scale(4), wall);
  kit.shape(RectangleShape{}, translate({0, 2, 0}) * rotate_x(90) * scale(4), wall);
  kit.look({0, -5, 1}, {0, 0, 0}, 45);
  kit.scene.film.filter = TentFilter{};
  kit.scene.integrator.max_depth = 6;
  return kit;
}
const Transform kBox = translate({-1, -1, -1}) * scale(2);

SceneKit cloud() {
  SceneKit kit = lit_room();
  std::vector<float> values(6 * 5 * 4);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>((i * 7919) % 11) / 4;
  const MediumIndex m = kit.heterogeneous(kit.grid({6, 5, 4}, values, kBox), {.9, .8, .5}, .75, .5);
  kit.container(CubeShape{}, {}, kit.null(), m);
  kit.scene.emitters.push_back(PointEmitter{{1.5, -2, 2}, {8, 6, 4}});
  kit.scene.emitters.push_back(DirectionalEmitter{{.25, .5, -1}, {1, .5, .25}});
  return kit;
}
SceneKit coloured_cloud() {
  SceneKit kit = lit_room();
  std::vector<float> values(6 * 5 * 4 * 3);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>((i * 7919) % 11) / 4;
  const MediumIndex m = kit.heterogeneous(kit.grid({6, 5, 4}, values, kBox, 3), {.9, .8, .5}, .75, .5);
  kit.container(CubeShape{}, {}, kit.null(), m);
  kit.scene.emitters.push_back(PointEmitter{{1.5, -2, 2}, {8, 6, 4}});
  kit.environment(.125);
  return kit;
}
SceneKit coloured_fog() {
  SceneKit kit = lit_room();
  kit.container(SphereShape{}, {}, kit.null(), kit.homogeneous({.25, 1, 2}, {.9, .7, .5}, -.25));
  kit.scene.emitters.push_back(
      SpotEmitter{look_at({0, -1.5, 2.5}, {0, 0, 0}, {0, 1, 0}), {20, 20, 30}, 30, 10, {}});
  kit.environment(.125);
  return kit;
}
SceneKit milk_in_glass() {
  SceneKit kit = lit_room();
  kit.container(SphereShape{}, {}, kit.glass(1.5), kit.homogeneous({2, 3, 4}, {.95, .9, .8}));
  kit.shape(RectangleShape{}, translate({0, 0, 3}) * rotate_x(180), kit.diffuse(0)).emitter =
      AreaEmitter{kit.texture({4, 3, 2})};
  return kit;
}
SceneKit surfaces() {
  SceneKit kit = lit_room();
  const TextureIndex rough = kit.texture({.25, .25, .25});
  kit.shape(SphereShape{}, translate({-1, 0, 0}) * scale(.75),
            kit.bsdf(RoughConductorBsdf{
                Microfacet::ggx, rough, rough, {.2, .9, 1.1}, {3.9, 2.4, 2.2}, kit.texture({1, 1, 1})}));
  kit.shape(CubeShape{}, translate({1.25, 0, -.5}) * scale(.5),
            kit.bsdf(PlasticBsdf{1.5, 1, false, kit.texture({.5, .25, .125}), kit.texture({1, 1, 1})}));
  kit.shape(DiskShape{}, translate({0, 0, 3}) * rotate_x(180), kit.diffuse(0)).emitter =
      AreaEmitter{kit.texture({4, 3, 2})};
  kit.scene.emitters.push_back(DirectionalEmitter{{.25, .5, -1}, {1, .5, .25}, .5});
  kit.environment(.125);
  kit.scene.sensor.aperture_radius = .0625;
  kit.scene.sensor.focus_distance = 5;
  return kit;
}
SceneKit flame() {
  SceneKit kit = lit_room();
  HeterogeneousMedium m;
  std::vector<float> values{0, .5f, 1, .25f, .75f, 0, 1, .5f};
  m.sigma_t = kit.grid({2, 2, 2}, values, kBox);
  m.albedo = kit.constant({.5, .5, .5});
  m.phase = kit.phase(0);
  m.source_radiance = kit.constant({2, 1, .5});
  kit.container(CubeShape{}, {}, kit.null(), SceneKit::push<MediumTag>(kit.scene.media, m));
  return kit;
}

}  // namespace

std::vector<NamedScene> different_scenes() {
  std::vector<NamedScene> all{{"a cloud", cloud()},
                              {"coloured fog", coloured_fog()},
                              {"milk in glass", milk_in_glass()},
                              {"surfaces", surfaces()},
                              {"a flame", flame()}};
  SceneKit distant = cloud();
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
      overloaded{[&](ConstantEmitter& c) { times(c.radiance); },
                 [&](DirectionalEmitter& d) { times(d.irradiance); },
                 [&](PointEmitter& p) { times(p.intensity); }, [&](SpotEmitter& s) { times(s.intensity); },
                 [&](EnvmapEmitter& v) { v.scale *= by; }, [&](ProjectorEmitter& p) { p.scale *= by; }},
      e);
}

}  // namespace ls::test

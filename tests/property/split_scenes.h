// Pictures whose light is told apart, of scenes of every technique.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/image/aov/aov.h"
#include "core/scene/analysis/light_groups.h"
#include "tests/property/metamorphic.h"
#include "tests/support/lamp_room.h"
#include "tests/support/sky_room.h"
#include "tests/support/sky_yard.h"

namespace ls::test {

// Puts the lights into the groups "a", "b" and none in turn, all environments into one.
inline void group_lights(Scene& scene) {
  const std::array<std::string, 3> names = {"a", "b", ""};
  std::size_t next = 0;
  const auto name = [&] { return names[next++ % names.size()]; };
  for (Shape& s : scene.shapes)
    if (s.emitter) s.emitter->light_group = name();
  const std::string sky = name();
  for (Emitter& e : scene.emitters)
    std::visit(
        [&](auto& light) {
          using Kind = std::decay_t<decltype(light)>;
          constexpr bool kSky = std::is_same_v<Kind, ConstantEmitter> || std::is_same_v<Kind, EnvmapEmitter>;
          light.light_group = kSky ? sky : name();
        },
        e);
  for (Medium& m : scene.media)
    if (scene::gives_off_light(m)) std::visit([&](auto& medium) { medium.light_group = name(); }, m);
}

struct Picture {
  std::vector<float> sums;
  AovPlanes planes;
  std::size_t pixels = 0;
  std::string variant;

  std::span<const float> plane(const std::string& name) const {
    const auto at = std::ranges::find(planes.names, name) - planes.names.begin();
    EXPECT_LT(static_cast<std::size_t>(at), planes.names.size()) << name;
    return std::span(sums).subspan((kPartialChannels + static_cast<std::size_t>(at)) * pixels, pixels);
  }
};
inline Picture picture(const SceneBuilder& builder, std::vector<std::string> aovs, std::uint64_t spp,
                       std::uint64_t seed, int deep = 0) {
  RenderSettings settings = settings_of(builder.scene, seed);
  settings.aov = names_of(parse_aovs(aovs).value());
  if (aovs_of(settings).has(Aov::light_groups)) settings.light_groups = scene::light_groups_of(builder.scene);
  settings.deep = deep;
  const auto world = render::build_world(builder.scene, settings, builder.files, 2);
  if (!world) throw std::runtime_error(world.error().message);
  Picture p;
  p.pixels = settings.size.pixels();
  p.planes = planes_of(aovs_of(settings));
  p.variant = render::describe(**world).variant;
  p.sums = render::render_tile(**world, {0, 0, settings.size.width, settings.size.height}, {0, spp}, nullptr,
                               nullptr)
               .sums;
  return p;
}

// Scenes of every technique: the different scenes, a room whose paths are shared, one whose light comes from
// light vertices, one under a sky seen through a portal, and random scenes.
inline std::vector<NamedScene> all_scenes() {
  std::vector<NamedScene> all = scenes();
  const auto add = [&](std::string name, SceneBuilder builder) {
    all.push_back({std::move(name), std::move(builder)});
  };
  for (const bool chromatic : {false, true}) {
    LampRoom room{.glossy = true, .fog = .4, .chromatic = chromatic, .path_reuse = 4};
    SceneBuilder builder = room.builder();
    builder.scene.emitters.push_back(DirectionalEmitter{{-1, -1, -.1}, {2, 3, 4}, 5});
    builder.lamp(SphereShape{}, translate({-.4, .5, .3}) * scale(.1), {3, 9, 4});
    builder.scene.emitters.erase(builder.scene.emitters.begin());  // the sky
    add(fmt::format("shared paths, chromatic {}", chromatic), std::move(builder));
  }
  SceneBuilder yard = sky_yard({16, 16});
  yard.scene.integrator.path_reuse = 4;
  yard.scene.emitters.push_back(DirectionalEmitter{{.2, .3, -1}, {3, 2, 1}, 25});
  add("shared paths under a sky and a sun", std::move(yard));
  for (const double fog : {0., .4}) {
    SceneBuilder sunny = SunnyRoom{.glossy = true, .fog = fog, .light_vertices = 64}.builder();
    sunny.lamp(SphereShape{}, translate({-.4, .5, .3}) * scale(.1), {3, 9, 4});
    add(fmt::format("light vertices, fog {}", fog), std::move(sunny));
  }
  SceneBuilder portal = SkyRoom{.sky_portals = 1}.builder();
  portal.lamp(SphereShape{}, translate({-.4, .5, .3}) * scale(.1), {3, 9, 4});
  add("sky portal", std::move(portal));
  for (const char* integrator : {"volpath_distant_mis", "whitted"}) {
    SceneBuilder builder = LampRoom{.fog = .4}.builder();
    builder.scene.integrator.name = integrator;
    builder.scene.emitters.push_back(PointEmitter{{0, .5, 0}, {1, 2, 3}});
    add(integrator, std::move(builder));
  }
  for (NamedScene& s : all) group_lights(s.builder.scene);
  return all;
}

// A sample's radiance and its groups are sums of at most 2^8 contributions in float32, each of which adds an
// error of at most 2^-24 of the sum of the magnitudes. Sums over samples are in double. Both sums are rounded
// to float32 at the end, which is far less.
inline constexpr double kClose = 2 * 0x1p8 * 0x1p-24;

}  // namespace ls::test

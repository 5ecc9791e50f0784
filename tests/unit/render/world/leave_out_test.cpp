// Features that a scene does not need take no time, and leaving them out does not change a bit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/analysis/prune.h"
#include "tests/support/render_check.h"
#include "worker/render/base/work_counters.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

const PixelRect kAll{0, 0, 12, 8};
TileResult render(const World& w) { return render_tile(w, kAll, {0, 16}, nullptr, nullptr); }

SceneBuilder plain_room() {
  SceneBuilder builder({12, 8});
  const BsdfIndex white = builder.diffuse(.6);
  builder.shape(RectangleShape{}, translate({0, 0, -1}) * test::scale(3), white);
  builder.shape(RectangleShape{}, translate({0, 0, 2}) * test::rotate_x(180) * test::scale(.5), white)
      .emitter = AreaEmitter{builder.texture({3, 2, 1})};
  builder.scene.emitters.push_back(PointEmitter{{1, -1, 1}, {1, 1, 1}});
  builder.environment(.1);
  builder.look({0, -5, 1}, {0, 0, 0}, 40);
  // Dead parts add segments to paths. Camera points and lamp directions would draw random numbers by segment,
  // so they are switched off
  builder.scene.integrator.camera_points = -1;
  builder.scene.integrator.phase_only = true;
  return builder;
}
SceneBuilder foggy() {
  SceneBuilder builder = plain_room();
  builder.container(CubeShape{}, test::scale(.9), builder.null(),
                    builder.homogeneous({.8, .8, .8}, {.9, .5, .2}));
  return builder;
}
SceneBuilder cloudy() {
  SceneBuilder builder = plain_room();
  const VolumeIndex v =
      builder.grid({2, 2, 2}, {0, 1, 2, 3, 4, 5, 6, 7}, translate({-1, -1, -1}) * test::scale(2));
  builder.container(CubeShape{}, test::scale(.9), builder.null(), builder.heterogeneous(v, {.9, .9, .9}));
  return builder;
}
SceneBuilder with(SceneBuilder builder, auto change) {
  change(builder);
  return builder;
}

// Scenes with dead parts: no ray stops at them, and next-event estimation does not choose them.
std::vector<SceneBuilder> scenes_with_dead_parts() {
  std::vector<SceneBuilder> all;
  for (SceneBuilder (*base)() : {plain_room, foggy, cloudy}) {
    const auto blended = [](double weight, bool of_glass) {
      return [=](SceneBuilder& k) {
        const BsdfIndex other = of_glass ? k.glass(1.5) : k.mirror();
        const TextureIndex w = k.texture({weight, weight, weight});
        k.shape(SphereShape{}, translate({.2, -.6, .4}) * test::scale(.4),
                k.bsdf(BlendBsdf{w, k.diffuse(.4), other}));
      };
    };
    all.push_back(with(base(), blended(0, false)));
    all.push_back(with(base(), blended(1, false)));
    all.push_back(with(base(), blended(1, true)));
    all.push_back(with(base(), [](SceneBuilder& k) {  // a mask that hides no part of a ball
      k.shape(SphereShape{}, translate({.2, -.6, .4}) * test::scale(.4),
              k.bsdf(MaskBsdf{k.texture({1, 1, 1}), k.diffuse(.4)}));
    }));
    all.push_back(with(base(), [](SceneBuilder& k) {  // a mask that hides all of a ball except for its light
      k.shape(SphereShape{}, translate({.2, -.6, .4}) * test::scale(.4),
              k.bsdf(MaskBsdf{k.texture({0, 0, 0}), k.diffuse(.4)}))
          .emitter = AreaEmitter{k.texture({1, 2, 3})};
    }));
    all.push_back(with(base(), [](SceneBuilder& k) {  // black lights before and after others
      k.scene.emitters.insert(k.scene.emitters.begin(), PointEmitter{{2, -1, 1}, {0, 0, 0}});
      k.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, {0, 0, 0}});
      k.scene.shapes.front().emitter = AreaEmitter{k.texture({0, 0, 0})};
    }));
    all.push_back(with(base(), [](SceneBuilder& k) {  // a medium without effect, seen through its boundary
      const MediumIndex fog = k.homogeneous({.5, .5, .5}, {.5, .5, .5});
      Shape& s = k.container(SphereShape{}, translate({.2, -2.6, .4}) * test::scale(.4), k.null(),
                             k.homogeneous({0, 0, 0}, {.5, .5, .5}));
      k.container(SphereShape{}, translate({.2, -2.6, 2.4}) * test::scale(.4), k.null(), fog);
      static_cast<void>(s);
    }));
  }
  return all;
}

TEST(LeaveOut, RemovingUnusedPartsChangesNoBit) {
  int changed = 0, scene = 0;
  for (SceneBuilder builder : scenes_with_dead_parts()) {
    const auto before = render(*test::world_of(builder));
    const scene::Pruned pruned = scene::pruned(builder.scene, {});
    EXPECT_FALSE(pruned.left_out.empty()) << scene;
    builder.scene = pruned.scene;
    const auto world = test::world_of(builder);
    EXPECT_EQ(render(*world).sums, before.sums) << scene;
    changed += world->null_transmission;
    ++scene;
  }
  // No mask or blend is left that shadow rays would have to handle.
  EXPECT_EQ(changed, 0);
}

TEST(LeaveOut, WorldHasOnlyStructuresThatItsSceneUses) {
  const auto bytes = [](const SceneBuilder& builder) {
    std::map<std::string, std::uint64_t> b;
    for (const auto& s : describe(*test::world_of(builder)).structures) b[s.name] = s.bytes;
    return b;
  };
  auto vacuum = bytes(plain_room());
  for (const char* name : {"textures", "environment map", "grid values", "majorant cells", "light tree"})
    EXPECT_EQ(vacuum.at(name), 0u) << name;
  for (const char* name : {"geometry", "bvh", "materials", "light table"})
    EXPECT_GT(vacuum.at(name), 0u) << name;
  EXPECT_EQ(bytes(foggy()).at("grid values"), 0u);
  EXPECT_GE(bytes(cloudy()).at("grid values"), 8 * sizeof(float));
  EXPECT_GT(bytes(cloudy()).at("majorant cells"), 0u);
  const auto many = bytes(with(plain_room(), [](SceneBuilder& k) {
    for (int i = 0; i < 40; ++i) k.scene.emitters.push_back(PointEmitter{{1. * i, -1, 3}, {1, 1, 1}});
  }));
  EXPECT_GT(many.at("light tree"), 0u);
}

TEST(LeaveOut, ListsTheLightTreesLightsOrWhyThereIsNoTree) {
  const auto tree_of = [](int lamps, int setting) {
    const auto world = test::world_of(with(plain_room(), [&](SceneBuilder& k) {
      for (int i = 0; i < lamps; ++i) k.scene.emitters.push_back(PointEmitter{{1. * i, -1, 3}, {1, 1, 1}});
      k.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, {1, 1, 1}});
      k.scene.integrator.light_tree = setting;
    }));
    for (const auto& s : describe(*world).structures)
      if (s.name == "light tree") return s.detail;
    return std::string();
  };

  EXPECT_EQ(tree_of(100, 0), "102 lights") << "two are the room's, and the distant one is not in it";
  EXPECT_EQ(tree_of(100, -1), "switched off");
  EXPECT_EQ(tree_of(3, 0), "too few lights with a place to choose among");
}

TEST(LeaveOut, ChoosesTheCheapestVariantThatMeetsTheNeeds) {
  const auto variant = [](const SceneBuilder& builder) { return describe(*test::world_of(builder)).variant; };
  EXPECT_EQ(variant(plain_room()), "surfaces");
  EXPECT_EQ(variant(with(plain_room(),
                         [](SceneBuilder& k) {
                           k.shape(SphereShape{}, translate({.2, -.6, .4}), k.null());
                         })),
            "surfaces that light passes");
  EXPECT_EQ(variant(with(plain_room(),
                         [](SceneBuilder& k) {
                           k.shape(SphereShape{}, translate({.2, -.6, .4}),
                                   k.bsdf(MaskBsdf{k.texture({.5, .5, .5}), k.diffuse(.4)}));
                         })),
            "surfaces that light passes");
  EXPECT_EQ(variant(foggy()), "homogeneous grey media");
  EXPECT_EQ(variant(cloudy()), "grey grids");
  // Fog on a floor: only the general instantiation handles coincident surfaces.
  EXPECT_EQ(variant(with(foggy(),
                         [](SceneBuilder& k) {
                           k.shape(RectangleShape{}, translate({0, 0, -.9}) * test::scale(3), k.diffuse(.5));
                         })),
            "everything");
  auto world = test::world_of(cloudy());
  EXPECT_THAT(covering_variants(*world), testing::Contains(all_variants(*world).back()));
}

TEST(LeaveOut, SingleLightNeedsNoChoiceAndNoTree) {
  SceneBuilder builder = plain_room();
  builder.scene.emitters.clear();
  const auto world = test::world_of(builder);
  EXPECT_EQ(world->lights.count(), 1u);
  EXPECT_FALSE(world->lights.has_tree());
  EXPECT_EQ(world->lights.choose({~0u, 1, 2}, {V3(0), V3(0, 0, 1)}).probability, 1.f);
}

#ifdef LIGHTSHAFT_COUNT

WorkCounters counted(const SceneBuilder& builder) {
  const auto world = test::world_of(builder);
  work_counters() = {};
  render(*world);
  return work_counters();
}

TEST(LeaveOutCounters, AreZeroForUnusedFeatures) {
  const WorkCounters vacuum = counted(plain_room());
  EXPECT_GT(vacuum.shadow_rays, 0u);
  EXPECT_EQ(
      vacuum.density + vacuum.macro_cells + vacuum.phase + vacuum.transmittance + vacuum.medium_emission, 0u);
  EXPECT_EQ(vacuum.equiangular + vacuum.boundary_rays + vacuum.null_transmission, 0u);
  EXPECT_EQ(vacuum.texels + vacuum.instances + vacuum.user_geometry + vacuum.light_tree, 0u);
  EXPECT_EQ(vacuum.environment_map + vacuum.lens, 0u);

  const WorkCounters fog = counted(foggy());
  EXPECT_GT(std::min({fog.phase, fog.transmittance, fog.equiangular, fog.boundary_rays}), 0u);
  EXPECT_EQ(fog.density + fog.macro_cells + fog.medium_emission + fog.null_transmission + fog.texels +
                fog.light_tree + fog.lens,
            0u);

  // In grids, points are sampled equi-angularly only about point lights in them or near them.
  EXPECT_GT(counted(cloudy()).equiangular, 0u);
  const WorkCounters cloud = counted(with(cloudy(), [](SceneBuilder& k) { k.scene.emitters.clear(); }));
  EXPECT_GT(std::min({cloud.phase, cloud.density, cloud.macro_cells}), 0u);
  EXPECT_EQ(cloud.transmittance + cloud.equiangular + cloud.medium_emission + cloud.null_transmission +
                cloud.texels,
            0u);
}

TEST(LeaveOutCounters, CountWhatIsUsed) {
  const WorkCounters lens =
      counted(with(plain_room(), [](SceneBuilder& k) { k.scene.sensor.aperture_radius = .1; }));
  EXPECT_EQ(lens.lens, 12u * 8 * 16);
  const WorkCounters lights = counted(with(plain_room(), [](SceneBuilder& k) {
    for (int i = 0; i < 40; ++i) k.scene.emitters.push_back(PointEmitter{{1. * i, -1, 3}, {1, 1, 1}});
  }));
  EXPECT_GT(lights.light_tree, 0u);
  const WorkCounters ball = counted(with(plain_room(), [](SceneBuilder& k) {
    k.shape(SphereShape{}, translate({.2, -.6, .4}) * test::scale(.4),
            k.bsdf(MaskBsdf{k.texture({.5, .5, .5}), k.diffuse(.4)}));
  }));
  EXPECT_GT(std::min(ball.user_geometry, ball.null_transmission), 0u);
}

#endif

}  // namespace
}  // namespace ls::render

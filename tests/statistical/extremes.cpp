// What single voxels, dense cells and textures do to estimators that are right on average grids and lights.
#include <random>

#include "tests/statistical/case.h"

namespace ls::test {
namespace {

// A voxel of a million among empty ones, seen past it: nothing is in the way, although the mean of its cells
// is far from nothing (STABILITY N10).
Case past_a_hot_voxel() {
  SceneBuilder builder;
  std::vector<float> values(16 * 16 * 16, 0);
  values[(8 * 16 + 8) * 16 + 8] = 1e6f;
  builder.container(CubeShape{}, translate({.5, .5, .5}) * scale(.5), builder.null(),
                    builder.heterogeneous(builder.grid({16, 16, 16}, values, Transform{}), rgb(0)));
  // Absorption is tracked by flights on camera rays and by transmittance on shadow rays: here a white floor
  // behind the cube lit from in front of it.
  builder.shape(RectangleShape{}, translate({2, .5, .5}) * rotate_y(-90), builder.diffuse(.5));
  builder.scene.emitters.push_back(DirectionalEmitter{{1, 0, 0}, rgb(1)});
  builder.scene.integrator.max_depth = 2;
  builder.look({-3, 10.5 / 16, 8.5 / 16}, {.5, 10.5 / 16, 8.5 / 16}, 1e-5);
  return {"past_a_hot_voxel", builder, grey(.5 / kPi), 256};
}

// Cells so dense that their voxels are followed one by one, others that are tracked. Albedo 1 is asked up to
// optical depth 256.
Case dense_furnace() {
  std::mt19937 rng(6);
  std::vector<float> values(12 * 9 * 7);
  for (float& x : values) x = rng() % 3 == 0 ? static_cast<float>(rng() % 1000) / 250.f : 0.f;
  SceneBuilder builder;
  const VolumeIndex v = builder.grid({12, 9, 7}, values, translate({-1, -1, -1}) * scale(2));
  builder.container(CubeShape{}, {}, builder.null(), builder.heterogeneous(v, rgb(1), 30, .8));
  builder.environment();
  builder.look({.4, -6, .7}, {0, 0, 0}, 30);
  return {"furnace_dense_grid", builder, grey(1), 64};
}

// A sphere light in quarters of two colours over a floor: from below as much is seen of one as of the other.
Case checkered_sphere() {
  constexpr double kReflectance = .5, kRadius = .5, kDistance = 2;
  SceneBuilder builder;
  builder.shape(RectangleShape{}, scale(3), builder.diffuse(kReflectance));
  const TextureIndex dark = builder.texture(rgb(.25)), bright = builder.texture(rgb(1.5));
  builder.scene.textures.push_back(CheckerboardTexture{dark, bright, {}});
  const TextureIndex board{static_cast<std::uint32_t>(builder.scene.textures.size() - 1)};
  builder.shape(SphereShape{}, translate({0, 0, kDistance}) * scale(kRadius), builder.diffuse(0)).emitter =
      AreaEmitter{board};
  builder.scene.integrator.max_depth = 2;
  builder.look({-2, 1, .6}, {0, 0, 0}, 1e-3);
  constexpr double kRadiance = (.25 + 1.5) / 2, kSine = kRadius / kDistance;
  return {"direct_checkered_sphere", builder, grey(kReflectance * kRadiance * kSine * kSine), 1024};
}

}  // namespace

void add_extremes(std::vector<Case>& cases) {
  cases.push_back(past_a_hot_voxel());
  cases.push_back(dense_furnace());
  cases.push_back(checkered_sphere());
}

}  // namespace ls::test

// A fire between a floor and a ball.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/support/scene_builder.h"

namespace ls::test {

struct Fire {
  bool glossy = false, absorbed = false, black_body = false, fog = false, coloured = false;
  int emissive_grids = 0;

  // A flame of 12 x 20 x 12 voxels between a floor and a ball, seen from above. The middle of it glows.
  SceneBuilder builder(FrameSize size) const {
    constexpr std::array<int, 3> kVoxels{12, 20, 12};
    SceneBuilder b(size);
    b.look({0, 3.5, -4}, {0, .3, 0}, 50, {0, 1, 0});
    std::vector<float> smoke, glow;
    for (int z = 0; z < kVoxels[2]; ++z)
      for (int y = 0; y < kVoxels[1]; ++y)
        for (int x = 0; x < kVoxels[0]; ++x) {
          const double dx = (x + .5) / 6 - 1, dz = (z + .5) / 6 - 1;
          const double core = std::max(0., 1 - 1.2 * std::hypot(dx, dz)) * std::max(0., 1 - y / 18.);
          smoke.push_back(static_cast<float>(core));
          glow.push_back(static_cast<float>(core * core * core));
        }
    const Transform place = translate({-.3, .4, -.3}) * scale(.6, 1, .6);
    const MediumIndex flame = b.heterogeneous(b.grid(kVoxels, smoke, place), {.6, .5, .4}, 3, .4);
    auto& medium = std::get<HeterogeneousMedium>(b.scene.media[flame.value]);
    if (black_body) {
      medium.temperature = b.grid(kVoxels, glow, place);
      medium.temperature_scale = 3000;
      medium.temperature_offset = 2500;
      medium.peak_one = true;
      medium.emission_scale = 20;
    } else {
      (absorbed ? medium.source_radiance : medium.emission) = b.grid(kVoxels, glow, place);
      medium.emission_scale = 20;
    }
    if (coloured) medium.tint = {1, .6, .3};
    b.scene.integrator.emissive_grids = emissive_grids;
    b.scene.integrator.max_depth = 8;
    const MediumIndex outside =
        fog ? b.homogeneous(coloured ? Rgb{.1, .2, .3} : Rgb{.2, .2, .2}, {.9, .9, .9}, .5) : MediumIndex{};
    const BsdfIndex floor = glossy
                                ? b.bsdf(RoughConductorBsdf{.distribution = {},
                                                            .alpha_u = b.texture({.15, .15, .15}),
                                                            .alpha_v = b.texture({.15, .15, .15}),
                                                            .specular_reflectance = b.texture({.8, .8, .8})})
                                : b.diffuse(.6);
    b.shape(RectangleShape{}, rotate_x(-90) * scale(5), floor);
    b.shape(SphereShape{}, translate({1.1, .5, .3}) * scale(.5), b.diffuse(.7));
    Shape& box = b.container(CubeShape{}, translate({0, .9, 0}) * scale(.3, .5, .3), b.null(), flame);
    if (fog) {
      box.exterior = outside;
      b.container(SphereShape{}, scale(4.8), b.null(), outside);
      b.scene.sensor.medium = outside;
      b.look({0, 3, -3.3}, {0, .3, 0}, 50, {0, 1, 0});
    }
    return b;
  }
};

}  // namespace ls::test

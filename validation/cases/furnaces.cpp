// Furnace tests: uniform light from all directions and no absorption make everything as bright as the light.
#include <fmt/format.h>

#include "validation/fixtures/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

constexpr Rgb kColours{1, 2.5, 4};
const Transform kBox = box({-1, -1, -1}, {1, 1, 1});

void white_sky(Table& t) {
  const auto add = [&](const char* name, auto fill) {
    SceneBuilder contents;
    fill(contents);
    SceneBuilder builder = furnace(contents);
    for (const bool distant : {false, true}) {
      const Configuration configuration{false, distant};
      configuration.choose(builder);
      t.mean(fmt::format("7.6c-{}/{}", name, configuration.integrator_name()), "7.6c N64",
             "A white furnace: what absorbs nothing is as bright as the sky.", builder, grey(1),
             {.channels = true});
    }
  };
  add("sphere-isotropic",
      [](SceneBuilder& k) { k.container(SphereShape{}, {}, k.null(), k.homogeneous(rgb(2), rgb(1))); });
  add("cube-forward-chromatic",
      [](SceneBuilder& k) { k.container(CubeShape{}, {}, k.null(), k.homogeneous(kColours, rgb(1), .9)); });
  add("grid-backward", [](SceneBuilder& k) {
    const VolumeIndex v = k.grid({12, 9, 7}, patchy(12 * 9 * 7, 5), kBox);
    k.container(CubeShape{}, {}, k.null(), k.heterogeneous(v, rgb(1), 2, -.5));
  });
  add("rotated-grid-in-sphere", [](SceneBuilder& k) {
    const Transform box = rotate_x(20) * translate({-.5, -.5, -.5});
    const MediumIndex m = k.heterogeneous(k.grid({6, 5, 4}, patchy(120, 9), box), rgb(1), 3, .6);
    k.container(SphereShape{}, {}, k.null(), m);
  });
  // A grid with a density for each channel. Without `warm` it absorbs nothing. With `warm` it absorbs, and
  // its source radiance (emission per length divided by the absorption coefficient) equals the radiance of
  // the sky: such a medium is invisible, whatever its albedo.
  for (const bool warm : {false, true})
    add(warm ? "three-channel-grid-in-balance" : "three-channel-grid", [warm](SceneBuilder& k) {
      const VolumeIndex v = k.grid({12, 9, 7}, patchy(12 * 9 * 7 * 3, 5), kBox, 3);
      const MediumIndex m = k.heterogeneous(v, warm ? Rgb{.8, .3, .5} : rgb(1), 2, -.5);
      if (warm) k.set_emission(m, rgb(1), true);
      k.container(CubeShape{}, {}, k.null(), m);
    });
  // Some macro cells are so dense that the optical depth is integrated voxel by voxel. In the others a
  // tracker (an algorithm that steps from collision to collision) samples tentative collisions.
  add("dense-grid", [](SceneBuilder& k) {
    const VolumeIndex v = k.grid({12, 9, 7}, patchy(12 * 9 * 7, 6), kBox);
    k.container(CubeShape{}, {}, k.null(), k.heterogeneous(v, rgb(1), 30, .8));
  });
  add("glass-sphere", [](SceneBuilder& k) { k.shape(SphereShape{}, {}, k.glass(1.5)); });
  add("glass-sphere-filled", [](SceneBuilder& k) {
    k.container(SphereShape{}, {}, k.glass(1.4), k.homogeneous(rgb(2), rgb(1), .5));
  });
  add("mirror-cube", [](SceneBuilder& k) { k.shape(CubeShape{}, rotate_x(30) * rotate_y(20), k.mirror()); });
}

// Walls of radiance 1 around a medium without absorption. Light sampling, phase function sampling and
// equi-angular sampling all find the walls, and only correct MIS weights give the radiance 1.
void shining_walls(Table& t) {
  const auto add = [&](const char* name, const Geometry& walls, const Transform& to_world, auto medium) {
    SceneBuilder builder;
    const MediumIndex m = medium(builder);
    builder.lamp(walls, to_world).flip_normals = true;
    builder.scene.sensor.medium = m;
    builder.look({.2, -.3, .1}, {.5, .9, 0}, 60);
    for (const bool distant : {false, true}) {
      const Configuration configuration{false, distant};
      configuration.choose(builder);
      t.mean(fmt::format("7.6c-{}/{}", name, configuration.integrator_name()), "7.6c N27",
             "Shining walls around a medium that absorbs nothing: as bright as they are.", builder, grey(1),
             {.channels = true});
    }
  };
  const auto thin = [](SceneBuilder& k) { return k.homogeneous(rgb(1), rgb(1), 0); };
  const auto forward = [](SceneBuilder& k) { return k.homogeneous(rgb(1), rgb(1), .7); };
  const auto chromatic = [](SceneBuilder& k) { return k.homogeneous(kColours, rgb(1), .3); };
  const auto grid = [](SceneBuilder& k) {
    return k.heterogeneous(k.grid({8, 8, 8}, patchy(512, 3), translate({-2, -2, -2}) * scale(4)), rgb(1), 1,
                           .4);
  };
  add("shining-sphere-isotropic", SphereShape{}, {}, thin);
  add("shining-sphere-chromatic", SphereShape{}, {}, chromatic);
  add("shining-cube-forward", CubeShape{}, {}, forward);
  add("shining-cube-grid", CubeShape{}, {}, grid);
  {
    // A room of five emitting rectangles and a window, through which the environment is seen. When these
    // lights are present, light sampling never chooses the environment: only paths that leave through the
    // window find it.
    SceneBuilder builder;
    const MediumIndex m = builder.homogeneous(rgb(.8), rgb(1), .2);
    const BsdfIndex open = builder.null();
    const Transform sides[] = {Transform{},  rotate_x(90),  rotate_x(-90),
                               rotate_y(90), rotate_y(-90), rotate_x(180)};
    for (int i = 0; i < 6; ++i) {  // six rectangles at distance 1 from the origin, facing it
      const Transform to_world = sides[i] * translate({0, 0, -1});
      if (i == 5) {
        // The window. The medium ends here. The window's normal points inwards, so the medium is on its
        // exterior side.
        Shape& window = builder.shape(RectangleShape{}, to_world, open);
        window.exterior = m;
        window.is_medium_transition = true;
      } else {
        builder.lamp(RectangleShape{}, to_world);
      }
    }
    builder.environment();
    builder.scene.sensor.medium = m;
    builder.look({.2, -.3, .1}, {.5, .9, .3}, 60);
    t.mean("7.6c-shining-room-with-window/volpath", "7.6c 7.7",
           "Five shining walls and the sky: only right weights add up to 1.", builder, grey(1));
  }
}

// White furnaces: the contents absorb nothing, and light of radiance 1 comes from all sides, from an
// environment or from the walls of a box. Each is rendered with several settings that sample light from
// points along path segments.
void surrounded(Table& t) {
  constexpr Configuration kVolpath{}, kMis{false, true}, kPoint{.camera_points = 1},
      kPoints{.camera_points = 5}, kEquiangular{false, true, DistanceSampling::equiangular},
      kExponential{false, true, DistanceSampling::exponential};
  struct Surroundings {
    const char* name;
    void (*add)(SceneBuilder&);
    std::vector<Configuration> configurations;
  };
  const Surroundings all[] = {
      {"a-constant", [](SceneBuilder& builder) { builder.environment(); }, {kMis, kPoint, kPoints}},
      {"a-map",
       [](SceneBuilder& builder) { add_sky(builder, SkyImage(16, 9, 1), rotate_x(30) * rotate_y(20)); },
       {kVolpath, kEquiangular, kMis, kPoint, kPoints}},
      {"walls",
       [](SceneBuilder& builder) { builder.lamp(CubeShape{}, scale(4)).flip_normals = true; },
       {kExponential, kEquiangular, kMis, kPoint, kPoints}}};
  const auto add = [&](const Surroundings& s, const char* name, SceneBuilder builder,
                       const Configuration& configuration) {
    s.add(builder);
    builder.look({.4, -3, .7}, {0, 0, 0}, 30);
    configuration.choose(builder);
    t.mean(fmt::format("7.6c-{}-in-{}/{}", name, s.name, configuration.integrator_name()), "7.6c N27",
           "White media in light from everywhere: as bright as that.", builder, grey(1), {.channels = true});
  };
  SceneBuilder ball, grid, glass;
  ball.container(SphereShape{}, {}, ball.null(), ball.homogeneous(kColours, rgb(1), .6));
  grid.container(CubeShape{}, {}, grid.null(),
                 grid.heterogeneous(grid.grid({12, 9, 7}, patchy(12 * 9 * 7, 5), kBox), rgb(1), 2, -.5));
  glass.container(SphereShape{}, {}, glass.glass(1.4), glass.homogeneous(rgb(2), rgb(1), .5));
  for (const Surroundings& s : all)
    for (const Configuration& configuration : s.configurations) {
      add(s, "chromatic-ball", ball, configuration);
      add(s, "grid", grid, configuration);
    }
  add(all[1], "filled-glass", glass, kVolpath);
}

}  // namespace

void add_furnaces(Table& t) {
  white_sky(t);
  shining_walls(t);
  surrounded(t);
}

}  // namespace ls::cases

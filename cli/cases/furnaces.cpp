// Where light comes from everywhere and nothing absorbs, everything is as bright as the light.
#include <fmt/format.h>

#include <random>

#include "cli/cases/case.h"
#include "cli/cases/stages.h"

namespace ls::cases {
namespace {

constexpr Rgb kColours{1, 2.5, 4};

std::vector<float> random_densities(std::size_t n, unsigned seed) {
  std::mt19937 rng(seed);
  std::vector<float> v(n);
  // Many empty voxels, some dense ones.
  for (float& x : v) x = rng() % 3 == 0 ? static_cast<float>(rng() % 1000) / 250.f : 0.f;
  return v;
}

void white_sky(Table& t) {
  const auto add = [&](const char* name, SceneKit kit) {
    kit.environment();
    kit.look({.4, -6, .7}, {0, 0, 0}, 30);
    for (const bool distant : {false, true}) {
      const Way way{false, distant};
      way.choose(kit);
      t.mean(fmt::format("7.6c-{}/{}", name, way.integrator_name()), "7.6c N64",
             "A white furnace: what absorbs nothing is as bright as the sky.", kit, grey(1),
             {.channels = true});
    }
  };
  {
    SceneKit kit;
    kit.container(SphereShape{}, {}, kit.null(), kit.homogeneous(rgb(2), rgb(1)));
    add("sphere-isotropic", kit);
  }
  {
    SceneKit kit;
    kit.container(CubeShape{}, {}, kit.null(), kit.homogeneous(kColours, rgb(1), .9));
    add("cube-forward-chromatic", kit);
  }
  {
    SceneKit kit;
    const Transform box = translate({-1, -1, -1}) * scale(2);
    const VolumeIndex v = kit.grid({12, 9, 7}, random_densities(12 * 9 * 7, 5), box);
    kit.container(CubeShape{}, {}, kit.null(), kit.heterogeneous(v, rgb(1), 2, -.5));
    add("grid-backward", kit);
  }
  {
    SceneKit kit;
    const Transform box = rotate_x(20) * translate({-.5, -.5, -.5});
    const MediumIndex m =
        kit.heterogeneous(kit.grid({6, 5, 4}, random_densities(120, 9), box), rgb(1), 3, .6);
    kit.container(SphereShape{}, {}, kit.null(), m);
    add("rotated-grid-in-sphere", kit);
  }
  {
    SceneKit kit;
    kit.shape(SphereShape{}, {}, kit.glass(1.5));
    add("glass-sphere", kit);
  }
  {
    SceneKit kit;
    kit.container(SphereShape{}, {}, kit.glass(1.4), kit.homogeneous(rgb(2), rgb(1), .5));
    add("glass-sphere-filled", kit);
  }
  {
    SceneKit kit;
    kit.shape(CubeShape{}, rotate_x(30) * rotate_y(20), kit.mirror());
    add("mirror-cube", kit);
  }
}

// Walls that shine 1 around a medium that does not absorb: light sampling, phase sampling and equi-angular
// sampling all find the walls, and only right weights add up to 1.
void shining_walls(Table& t) {
  const auto add = [&](const char* name, const Geometry& walls, const Transform& to_world, auto medium) {
    SceneKit kit;
    const MediumIndex m = medium(kit);
    const BsdfIndex black = kit.diffuse(0);
    const TextureIndex light = kit.texture(rgb(1));
    Shape& s = kit.shape(walls, to_world, black);
    s.flip_normals = true;
    s.emitter = AreaEmitter{light};
    kit.scene.sensor.medium = m;
    kit.look({.2, -.3, .1}, {.5, .9, 0}, 60);
    for (const bool distant : {false, true}) {
      const Way way{false, distant};
      way.choose(kit);
      t.mean(fmt::format("7.6c-{}/{}", name, way.integrator_name()), "7.6c N27",
             "Shining walls around a medium that absorbs nothing: as bright as they are.", kit, grey(1),
             {.channels = true});
    }
  };
  const auto thin = [](SceneKit& k) { return k.homogeneous(rgb(1), rgb(1), 0); };
  const auto forward = [](SceneKit& k) { return k.homogeneous(rgb(1), rgb(1), .7); };
  const auto chromatic = [](SceneKit& k) { return k.homogeneous(kColours, rgb(1), .3); };
  const auto grid = [](SceneKit& k) {
    return k.heterogeneous(k.grid({8, 8, 8}, random_densities(512, 3), translate({-2, -2, -2}) * scale(4)),
                           rgb(1), 1, .4);
  };
  add("shining-sphere-isotropic", SphereShape{}, {}, thin);
  add("shining-sphere-chromatic", SphereShape{}, {}, chromatic);
  add("shining-cube-forward", CubeShape{}, {}, forward);
  add("shining-cube-grid", CubeShape{}, {}, grid);
  {
    // Six rectangles and the sky through a missing one: many lights, one of them never sampled.
    SceneKit kit;
    const MediumIndex m = kit.homogeneous(rgb(.8), rgb(1), .2);
    const BsdfIndex black = kit.diffuse(0), open = kit.null();
    const TextureIndex light = kit.texture(rgb(1));
    const Transform sides[] = {Transform{},  rotate_x(90),  rotate_x(-90),
                               rotate_y(90), rotate_y(-90), rotate_x(180)};
    for (int i = 0; i < 6; ++i) {  // each a unit away, facing the origin
      const Transform to_world = sides[i] * translate({0, 0, -1});
      if (i == 5) {
        // The sky's side: a window that ends the medium; the normal looks inwards.
        Shape& window = kit.shape(RectangleShape{}, to_world, open);
        window.exterior = m;
        window.is_medium_transition = true;
      } else {
        kit.shape(RectangleShape{}, to_world, black).emitter = AreaEmitter{light};
      }
    }
    kit.environment();
    kit.scene.sensor.medium = m;
    kit.look({.2, -.3, .1}, {.5, .9, .3}, 60);
    t.mean("7.6c-shining-room-with-window/volpath", "7.6c 7.7",
           "Five shining walls and the sky: only right weights add up to 1.", kit, grey(1));
  }
}

}  // namespace

void add_furnaces(Table& t) {
  white_sky(t);
  shining_walls(t);
}

}  // namespace ls::cases

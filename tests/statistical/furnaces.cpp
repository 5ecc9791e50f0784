// Where light comes from everywhere and nothing absorbs, everything is as bright as the light.
#include <random>

#include "tests/statistical/case.h"

namespace ls::test {
namespace {

constexpr Rgb kColours{1, 2.5, 4};

std::vector<float> random_densities(std::size_t n, unsigned seed) {
  std::mt19937 rng(seed);
  std::vector<float> v(n);
  // Many empty voxels, some dense ones.
  for (float& x : v) x = rng() % 3 == 0 ? static_cast<float>(rng() % 1000) / 250.f : 0.f;
  return v;
}

void white_sky(std::vector<Case>& cases) {
  const auto add = [&](const char* name, const SceneKit& kit, std::uint64_t spp) {
    Case c{name, kit, grey(1), spp};
    c.kit.environment();
    c.kit.look({.4, -6, .7}, {0, 0, 0}, 30);
    cases.push_back(std::move(c));
  };
  {
    SceneKit kit;
    kit.container(SphereShape{}, {}, kit.null(), kit.homogeneous(rgb(2), rgb(1)));
    add("furnace_sphere_isotropic", kit, 256);
  }
  {
    SceneKit kit;
    kit.container(CubeShape{}, {}, kit.null(), kit.homogeneous(kColours, rgb(1), .9));
    add("furnace_cube_forward_chromatic", kit, 2048);
  }
  {
    SceneKit kit;
    const Transform box = translate({-1, -1, -1}) * scale(2);
    const VolumeIndex v = kit.grid({12, 9, 7}, random_densities(12 * 9 * 7, 5), box);
    kit.container(CubeShape{}, {}, kit.null(), kit.heterogeneous(v, rgb(1), 2, -.5));
    add("furnace_grid_backward", kit, 256);
  }
  {
    SceneKit kit;
    const Transform box = rotate_x(20) * translate({-.5, -.5, -.5});
    const MediumIndex m =
        kit.heterogeneous(kit.grid({6, 5, 4}, random_densities(120, 9), box), rgb(1), 3, .6);
    kit.container(SphereShape{}, {}, kit.null(), m);
    add("furnace_rotated_grid_in_sphere", kit, 256);
  }
  {
    SceneKit kit;
    kit.shape(SphereShape{}, {}, kit.glass(1.5));
    add("furnace_glass_sphere", kit, 256);
  }
  {
    SceneKit kit;
    kit.container(SphereShape{}, {}, kit.glass(1.4), kit.homogeneous(rgb(2), rgb(1), .5));
    add("furnace_glass_sphere_filled", kit, 512);
  }
  {
    SceneKit kit;
    kit.shape(CubeShape{}, rotate_x(30) * rotate_y(20), kit.mirror());
    add("furnace_mirror_cube", kit, 64);
  }
}

// Walls that shine 1 around a medium that does not absorb: light sampling, phase sampling and equi-angular
// sampling all find the walls, and only right weights add up to 1.
void shining_walls(std::vector<Case>& cases) {
  const auto add = [&](const char* name, const Geometry& walls, const Transform& t, auto medium,
                       std::uint64_t spp) {
    SceneKit kit;
    const MediumIndex m = medium(kit);
    const BsdfIndex black = kit.diffuse(0);
    const TextureIndex light = kit.texture(rgb(1));
    Shape& s = kit.shape(walls, t, black);
    s.flip_normals = true;
    s.emitter = AreaEmitter{light};
    kit.scene.sensor.medium = m;
    kit.look({.2, -.3, .1}, {.5, .9, 0}, 60);
    cases.push_back({name, kit, grey(1), spp});
  };
  const auto thin = [](SceneKit& k) { return k.homogeneous(rgb(1), rgb(1), 0); };
  const auto forward = [](SceneKit& k) { return k.homogeneous(rgb(1), rgb(1), .7); };
  const auto chromatic = [](SceneKit& k) { return k.homogeneous(kColours, rgb(1), .3); };
  const auto grid = [](SceneKit& k) {
    return k.heterogeneous(k.grid({8, 8, 8}, random_densities(512, 3), translate({-2, -2, -2}) * scale(4)),
                           rgb(1), 1, .4);
  };
  add("shining_sphere_isotropic", SphereShape{}, {}, thin, 1024);
  add("shining_sphere_chromatic", SphereShape{}, {}, chromatic, 4096);
  add("shining_cube_forward", CubeShape{}, {}, forward, 1024);
  add("shining_cube_grid", CubeShape{}, {}, grid, 1024);
  {
    // Six rectangles and the sky through a missing one: many lights, one of them never sampled.
    SceneKit kit;
    const MediumIndex m = kit.homogeneous(rgb(.8), rgb(1), .2);
    const BsdfIndex black = kit.diffuse(0), open = kit.null();
    const TextureIndex light = kit.texture(rgb(1));
    const Transform sides[] = {Transform{},  rotate_x(90),  rotate_x(-90),
                               rotate_y(90), rotate_y(-90), rotate_x(180)};
    for (int i = 0; i < 6; ++i) {  // each a unit away, facing the origin
      const Transform t = sides[i] * translate({0, 0, -1});
      if (i == 5) {
        // The sky's side: a window that ends the medium; the normal looks inwards.
        Shape& window = kit.shape(RectangleShape{}, t, open);
        window.exterior = m;
        window.is_medium_transition = true;
      } else {
        kit.shape(RectangleShape{}, t, black).emitter = AreaEmitter{light};
      }
    }
    kit.environment();
    kit.scene.sensor.medium = m;
    kit.look({.2, -.3, .1}, {.5, .9, .3}, 60);
    cases.push_back({"shining_room_with_window", kit, grey(1), 1024});
  }
}

}  // namespace

void add_furnaces(std::vector<Case>& cases) {
  white_sky(cases);
  shining_walls(cases);
}

}  // namespace ls::test

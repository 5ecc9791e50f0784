// Closed bodies of every size, and what is inside: no light leaks, none is lost.
#include <fmt/format.h>

#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/checks.h"

namespace ls::cases {
namespace {

constexpr double kOutside = 1e6;  // radiance around a room: one leak among a million paths is seen

// Grey walls that shine, seen from inside: everywhere 1 / (1 - .5).
SceneKit room(const Geometry& g, double size, const Vec3& shift = {0, 0, 0}) {
  SceneKit kit;
  Shape& s = kit.shape(g, translate(shift) * scale(size), kit.diffuse(.5));
  s.flip_normals = true;
  s.emitter = AreaEmitter{kit.texture(rgb(1))};
  kit.environment(kOutside);
  kit.look({shift[0] + .1 * size, shift[1] + .2 * size, shift[2] - .3 * size},
           {shift[0], shift[1], shift[2] + size}, 120, {0, 1, 0});
  kit.scene.sensor.near_clip = 1e-6 * size;
  kit.scene.sensor.far_clip = 1e3 * size;
  return kit;
}

void closed(Table& t) {
  for (const double size : {1e-4, 1e-2, 1., 1e2, 1e4, 1e6}) {
    t.mean(fmt::format("N39-closed-box-{:g}", size), "N39 7.6c",
           "A closed grey box that shines, before a sky a million times as bright: 2.",
           [=] { return room(CubeShape{}, size); }, grey(2),
           {.band = 1e-3, .slow = size != 1e-4 && size != 1e6});
    t.mean(fmt::format("N39-closed-sphere-{:g}", size), "N39 7.6c", "Likewise a sphere.",
           [=] { return room(SphereShape{}, size); }, grey(2), {.band = 1e-3, .slow = size != 1});
  }
  t.mean("N39-closed-box-shifted", "N39 N11", "The box a hundred thousand of its sizes from the origin.",
         [] {
           return room(CubeShape{}, 1, {1e5, -1e5, 1e5});
         },
         grey(2), {.band = 1e-3});
  // Ten million rays and more: a path has about two from the walls and as many to the sky.
  t.exact(
      "N39-leaks", "N39", "Of ten million rays in closed boxes of six sizes none gets out.",
      [](const Bench& b) {
        Figure f{.expected = 0, .got = 0};
        for (const double size : {1e-4, 1e-2, 1., 1e2, 1e4, 1e6}) {
          const auto p = shoot(room(CubeShape{}, size), 2048, b);
          if (!p) return Figure{.why = p.error().message};
          for (const float sum : p->sums) f.got += sum > 1e4;
          f.unhealthy += p->health.nonfinite;
        }
        return f;
      },
      true);
}

// The mean way of light inside a body in even light from all around is 4 V / S, however it is scattered on
// it (Blanco and Fournier 2003): 4/3 in the unit ball. What it gives off per length shows it, to rays evenly
// spread over its disk, which is pi / 4 of the view.
SceneKit ball(bool grid, double sigma_s, double g) {
  SceneKit kit;
  MediumIndex m;
  if (grid) {
    m = kit.heterogeneous(
        kit.grid({7, 7, 7}, std::vector<float>(7 * 7 * 7, .5f), translate({-1, -1, -1}) * scale(2)), rgb(1),
        2 * sigma_s, g);
  } else {
    m = kit.homogeneous(rgb(sigma_s), rgb(1), g);
  }
  kit.glow(m, rgb(1));
  kit.container(SphereShape{}, {}, kit.null(), m);
  kit.look({0, -5, 0}, {0, 0, 0});
  kit.scene.sensor.projection = Projection::orthographic;
  return kit;
}

void paths(Table& t) {
  for (const bool grid : {false, true})
    for (const double sigma_s : {0., 2., 16.})
      for (const double g : {0., .8}) {
        if (sigma_s == 0 && g != 0) continue;
        t.mean(fmt::format("7.6d-mean-path-{:g}-g{:g}/{}", sigma_s, g, grid ? "grid" : "homogeneous"), "7.6d",
               "Light's mean way through the unit ball is 4/3, however it is scattered.",
               [=] { return ball(grid, sigma_s, g); }, grey(kPi / 3),
               {.band = sigma_s > 2 ? .005 : kBand,
                .why_band = sigma_s > 2 ? "many scatterings, and ways that vary by more than their mean" : "",
                .slow = sigma_s > 2 || g != 0});
      }
}

// White everywhere, whatever the shape, the coat and the phase function.
void furnaces(Table& t) {
  for (const bool grid : {false, true})
    for (const double g : {-.5, .9})
      for (const bool glass : {false, true}) {
        t.mean(fmt::format("7.6c-furnace-{}-g{:g}/{}", glass ? "glass" : "null", g,
                           grid ? "grid" : "homogeneous"),
               "7.6c N64", "A ball that absorbs nothing, in glass or not, in a white sky: 1.",
               [=] {
                 SceneKit kit;
                 const std::vector<float> values{.5f, 2, 0, 1, 1.5f, 0, 1, 2};
                 const MediumIndex m =
                     grid ? kit.heterogeneous(kit.grid({2, 2, 2}, values, translate({-1, -1, -1}) * scale(2)),
                                              rgb(1), 3, g)
                          : kit.homogeneous(rgb(3), rgb(1), g);
                 kit.container(SphereShape{}, {}, glass ? kit.glass(1.5) : kit.null(), m);
                 kit.environment();
                 kit.look({0, -5, .5}, {0, 0, 0}, 20);
                 return kit;
               },
               grey(1), {.band = .003});
      }
}

}  // namespace

void add_rooms(Table& t) {
  closed(t);
  paths(t);
  furnaces(t);
}

}  // namespace ls::cases

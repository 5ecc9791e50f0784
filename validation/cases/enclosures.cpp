// Closed bodies of all sizes with light inside: no light leaks out, none is lost.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"

namespace ls::cases {
namespace {

// The radiance outside of a room, so high that a single leak in a million paths would be noticed.
constexpr double kOutside = 1e6;

// A room with grey emitting walls, seen from inside: the radiance is 1 / (1 - .5) everywhere.
SceneBuilder room(const Geometry& g, double size, const Vec3& shift = {0, 0, 0}) {
  SceneBuilder builder;
  Shape& s = builder.shape(g, translate(shift) * scale(size), builder.diffuse(.5));
  s.flip_normals = true;
  s.emitter = AreaEmitter{builder.texture(rgb(1))};
  builder.environment(kOutside);
  builder.look({shift[0] + .1 * size, shift[1] + .2 * size, shift[2] - .3 * size},
               {shift[0], shift[1], shift[2] + size}, 120, {0, 1, 0});
  builder.scene.sensor.near_clip = 1e-6 * size;
  builder.scene.sensor.far_clip = 1e3 * size;
  return builder;
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
  // More than ten million rays in all: each path has about two from wall to wall, and about two towards the
  // environment (shadow rays).
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

// The mean path length of light through a body in uniform light is 4 V / S, however it is scattered (Blanco
// and Fournier 2003): 4/3 in the unit ball. A medium that emits 1 per length measures it: the rays of the
// view are spread evenly over the ball's disk, which fills pi / 4 of the view.
SceneBuilder ball(bool grid, double sigma_s, double g) {
  SceneBuilder builder;
  MediumIndex m;
  if (grid) {
    m = builder.heterogeneous(
        builder.grid({7, 7, 7}, std::vector<float>(7 * 7 * 7, .5f), translate({-1, -1, -1}) * scale(2)),
        rgb(1), 2 * sigma_s, g);
  } else {
    m = builder.homogeneous(rgb(sigma_s), rgb(1), g);
  }
  builder.set_emission(m, rgb(1));
  builder.container(SphereShape{}, {}, builder.null(), m);
  builder.look({0, -5, 0}, {0, 0, 0});
  builder.scene.sensor.projection = Projection::orthographic;
  return builder;
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

// A furnace: every pixel is white, with any shape, coating and phase function.
void furnaces(Table& t) {
  for (const bool grid : {false, true})
    for (const double g : {-.5, .9})
      for (const bool glass : {false, true}) {
        t.mean(fmt::format("7.6c-furnace-{}-g{:g}/{}", glass ? "glass" : "null", g,
                           grid ? "grid" : "homogeneous"),
               "7.6c N64", "A ball that absorbs nothing, in glass or not, in a white sky: 1.",
               [=] {
                 SceneBuilder builder;
                 const std::vector<float> values{.5f, 2, 0, 1, 1.5f, 0, 1, 2};
                 const MediumIndex m =
                     grid ? builder.heterogeneous(
                                builder.grid({2, 2, 2}, values, translate({-1, -1, -1}) * scale(2)), rgb(1),
                                3, g)
                          : builder.homogeneous(rgb(3), rgb(1), g);
                 builder.container(SphereShape{}, {}, glass ? builder.glass(1.5) : builder.null(), m);
                 builder.environment();
                 builder.look({0, -5, .5}, {0, 0, 0}, 20);
                 return builder;
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

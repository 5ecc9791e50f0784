// Closed rooms of many sizes that emit light, and translucent bodies that emit light or are lit from all
// sides. No light may leak into or out of a room. A body that absorbs nothing or almost nothing must lose no
// light, however it scatters.
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

// The radiance outside of a room. It is so high that a single leak in a million paths would be noticed.
constexpr double kOutside = 1e6;

// A closed room seen from inside. Its walls emit radiance 1 and reflect half, so the radiance is 1 / (1 - .5)
// everywhere.
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
  // Three million paths: 2048 samples for each of 256 pixels in six rooms. Each path has about two rays from
  // wall to wall and about two shadow rays towards the environment, so there are more than ten million rays
  // in all.
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

// The mean path length of light through a body in uniform light is 4 V / S, with V its volume and S its
// surface, however it scatters (Blanco and Fournier 2003). For the unit ball it is 4/3. A medium that emits 1
// per length and absorbs nothing measures it: the radiance of the body, averaged over all rays, is the mean
// path length. The rays of the view are spread evenly over the silhouette of the ball, a disk with a share of
// pi / 4 of the view.
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

// A white furnace: a body without absorption in a white sky. Every pixel has the radiance of the sky,
// whatever the phase function, and whether or not the body has a glass surface.
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

Transform rotate_z(double degrees) {
  const double a = degrees * kPi / 180, c = std::cos(a), s = std::sin(a);
  return {{c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
}

// The four Gauss-Legendre points on [0, 1], each with its weight.
constexpr std::array<std::array<double, 2>, 4> kGauss = {{{.06943184420297371, .17392742256872693},
                                                          {.33000947820757187, .32607257743127307},
                                                          {.66999052179242813, .32607257743127307},
                                                          {.93056815579702629, .17392742256872693}}};

// Sixteen unit cubes that are filled with the medium, each in a cell of 2 x 2 with black walls. They measure
// the mean path length 4 V / S (see ball()) by a quadrature over directions: sixteen directions in one
// octant, since a cube looks the same from all eight octants. Each cube is turned so that it is seen along
// one of these directions. The emission of a cube, 1 per length, is multiplied by the weight of its
// direction, by 16 (the number of cubes) and by 4 (the area of a cell), and divided by 1.5, the mean
// projected area S / 4. So the mean of the frame is the mean over all directions of the light that a cube
// emits in a direction, divided by S / 4. The cubes absorb nothing, so this is 4 V / S.
SceneBuilder cubes(const Configuration& configuration, double sigma_s, double g) {
  SceneBuilder builder({16, 16});
  configuration.choose(builder);
  const BsdfIndex black = builder.diffuse(0);
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      const double turn = std::acos(kGauss[i][0]) * 180 / kPi, about = kGauss[j][0] * 90;
      const Transform place =
          translate({-3 + 2. * static_cast<double>(i), -3 + 2. * static_cast<double>(j), 0}) *
          rotate_y(-turn) * rotate_z(-about) * scale(.5);
      const MediumIndex m =
          configuration.medium(builder, rgb(sigma_s), rgb(1), g, place * box({-1, -1, -1}, {1, 1, 1}));
      const double light = 16 * kGauss[i][1] * kGauss[j][1] * 4 / 1.5;
      builder.set_emission(m, rgb(light));
      builder.container(CubeShape{}, place, builder.null(), m);
    }
  for (const double x : {-2., 0., 2.}) {
    builder.shape(RectangleShape{}, translate({x, 0, 0}) * rotate_y(90) * scale(2, 4, 1), black);
    builder.shape(RectangleShape{}, translate({0, x, 0}) * rotate_x(90) * scale(4, 2, 1), black);
  }
  builder.scene.sensor.projection = Projection::orthographic;
  builder.scene.sensor.to_world = look_at({0, 0, 8}, {0, 0, 0}, {0, 1, 0}) * scale(4, 4, 1);
  builder.scene.sensor.near_clip = 1e-6;
  builder.scene.sensor.far_clip = 1e3;
  return builder;
}

void mean_way_through_a_cube(Table& t) {
  struct Row {
    Configuration configuration;
    double sigma_s, g;
  };
  for (const Row& r : {Row{{false, false}, 0, 0}, Row{{false, false}, 2, 0}, Row{{false, false}, 8, .8},
                       Row{{true, false}, 2, -.5}, Row{{true, true}, 2, 0}})
    t.mean(fmt::format("7.6d-cube-{:g}-g{:g}{}", r.sigma_s, r.g, r.configuration.name()), "7.6d",
           "Light's mean way through the unit cube is 4 V / S = 2/3, however it is scattered.",
           [=] { return cubes(r.configuration, r.sigma_s, r.g); }, grey(2. / 3),
           // The quadrature has four points for each of two angles. Scattering changes the light in each
           // direction by about a tenth. The quadrature integrates this part with a relative error of 1e-3,
           // which is 1e-4 of the answer.
           {.slack = 2e-4, .slow = r.sigma_s > 2 || r.configuration.grid});
}

// A ball of radius 1, extinction 16 and albedo 1 - 1e-7, so its absorption coefficient is 1.6e-6. Its source
// radiance is 1e6, so it emits 1.6 per length (source radiance times absorption coefficient). Its radiance,
// averaged over all rays, is this emission times the mean path length, 4/3. If the renderer rounded the
// albedo to float32, the absorption coefficient would be wrong by a fifth.
void bodies_all_but_white(Table& t) {
  constexpr double kDepth = 16, kAbsorbed = 1e-7, kSource = 1e6;
  for (const Configuration& configuration : all_configurations())
    t.mean("N16-light-of-an-albedo-of-1-less-1e-7" + configuration.name(), "N16 7.6d",
           "What a medium of albedo 1 - 1e-7 absorbs, seen by the light that it gives off for it.",
           [=] {
             SceneBuilder builder;
             configuration.choose(builder);
             const MediumIndex m = configuration.medium(builder, rgb(kDepth), rgb(1 - kAbsorbed), 0,
                                                        box({-1, -1, -1}, {1, 1, 1}));
             builder.set_emission(m, rgb(kSource), true);
             builder.container(SphereShape{}, {}, builder.null(), m);
             builder.look({0, -5, 0}, {0, 0, 0});
             builder.scene.sensor.projection = Projection::orthographic;
             return builder;
           },
           // The answer neglects that the ball absorbs some of its own light: a share of 1.6e-6 per length,
           // over path lengths of about 20, is within the slack.
           grey(kPi / 3 * kDepth * kAbsorbed * kSource),
           {.band = .01,
            .why_band = "16 mean free paths: ways that vary by more than their mean",
            .slack = 5e-5,
            .slow = configuration.distant});
}

}  // namespace

void add_rooms(Table& t) {
  closed(t);
  paths(t);
  furnaces(t);
}

void add_bodies(Table& t) {
  mean_way_through_a_cube(t);
  bodies_all_but_white(t);
}

}  // namespace ls::cases

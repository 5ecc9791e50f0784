// Bodies that emit and scatter, but absorb nothing or almost nothing: all emitted light leaves them, whatever
// happens inside.
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

Transform rotate_z(double degrees) {
  const double a = degrees * kPi / 180, c = std::cos(a), s = std::sin(a);
  return {{c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
}

// Gauss-Legendre points on [0, 1], and their weights.
constexpr std::array<std::array<double, 2>, 4> kGauss = {{{.06943184420297371, .17392742256872693},
                                                          {.33000947820757187, .32607257743127307},
                                                          {.66999052179242813, .32607257743127307},
                                                          {.93056815579702629, .17392742256872693}}};

// Sixteen unit cubes, each in a cell of 2 x 2 with black walls. A quadrature over an octant has sixteen
// directions (a cube looks the same from all eight octants). Each cube is turned so that it is seen along one
// of them, and its emission is scaled by that direction's weight. So the frame's mean is the mean over all
// directions of a cube's light, divided by its mean projected area, S / 4 = 1.5. The cubes emit 1 per length
// and absorb nothing, so this is 4 V / S, the mean path length.
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
           // The quadrature has four points per angle. It is accurate to 1e-3 of the part of the answer that
           // scattering changes, which is a tenth of it.
           {.slack = 2e-4, .slow = r.sigma_s > 2 || r.configuration.grid});
}

// A ball of albedo 1 - 1e-7 with a source radiance of 1e6: per length it emits its absorption coefficient,
// 1.6e-6, times that source. Its light is the mean path length, 4/3, times this emission. An albedo rounded
// to float32 would be off by a fifth of 1e-7.
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
           // Reabsorption takes a share of 1.6e-6 per length, over path lengths of about 20.
           grey(kPi / 3 * kDepth * kAbsorbed * kSource),
           {.band = .01,
            .why_band = "16 mean free paths: ways that vary by more than their mean",
            .slack = 5e-5,
            .slow = configuration.distant});
}

}  // namespace

void add_bodies(Table& t) {
  mean_way_through_a_cube(t);
  bodies_all_but_white(t);
}

}  // namespace ls::cases

// Bodies that give off light and scatter it, but absorb none or next to none: what leaves them is what was
// given off, whatever happens inside.
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/stages.h"

namespace ls::cases {
namespace {

Transform rotate_z(double degrees) {
  const double a = degrees * kPi / 180, c = std::cos(a), s = std::sin(a);
  return {{c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
}

// Gauss and Legendre's points of [0, 1], and their weights.
constexpr std::array<std::array<double, 2>, 4> kGauss = {{{.06943184420297371, .17392742256872693},
                                                          {.33000947820757187, .32607257743127307},
                                                          {.66999052179242813, .32607257743127307},
                                                          {.93056815579702629, .17392742256872693}}};

// Sixteen unit cubes, each in a cell of 2 x 2 with black walls, seen along directions that are points of a
// quadrature over an octant (a cube looks the same from all eight), each as bright as its direction's weight:
// the frame's mean is that over all directions, of what the cube sends out over its mean shadow, S / 4 = 1.5.
// A unit of radiance is given off per length, and none is lost: 4 V / S, the mean way through it.
SceneKit cubes(const Way& way, double sigma_s, double g) {
  SceneKit kit({16, 16});
  way.choose(kit);
  const BsdfIndex black = kit.diffuse(0);
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      const double turn = std::acos(kGauss[i][0]) * 180 / kPi, about = kGauss[j][0] * 90;
      const Transform place =
          translate({-3 + 2. * static_cast<double>(i), -3 + 2. * static_cast<double>(j), 0}) *
          rotate_y(-turn) * rotate_z(-about) * scale(.5);
      const MediumIndex m = way.medium(kit, rgb(sigma_s), rgb(1), g, place * box({-1, -1, -1}, {1, 1, 1}));
      const double light = 16 * kGauss[i][1] * kGauss[j][1] * 4 / 1.5;
      kit.glow(m, rgb(light));
      kit.container(CubeShape{}, place, kit.null(), m);
    }
  for (const double x : {-2., 0., 2.}) {
    kit.shape(RectangleShape{}, translate({x, 0, 0}) * rotate_y(90) * scale(2, 4, 1), black);
    kit.shape(RectangleShape{}, translate({0, x, 0}) * rotate_x(90) * scale(4, 2, 1), black);
  }
  kit.scene.sensor.projection = Projection::orthographic;
  kit.scene.sensor.to_world = look_at({0, 0, 8}, {0, 0, 0}, {0, 1, 0}) * scale(4, 4, 1);
  kit.scene.sensor.near_clip = 1e-6;
  kit.scene.sensor.far_clip = 1e3;
  return kit;
}

void mean_way_through_a_cube(Table& t) {
  struct Row {
    Way way;
    double sigma_s, g;
  };
  for (const Row& r : {Row{{false, false}, 0, 0}, Row{{false, false}, 2, 0}, Row{{false, false}, 8, .8},
                       Row{{true, false}, 2, -.5}, Row{{true, true}, 2, 0}})
    t.mean(fmt::format("7.6d-cube-{:g}-g{:g}{}", r.sigma_s, r.g, r.way.name()), "7.6d",
           "Light's mean way through the unit cube is 4 V / S = 2/3, however it is scattered.",
           [=] { return cubes(r.way, r.sigma_s, r.g); }, grey(2. / 3),
           // Four points in each angle: 1e-3 of what scattering changes, a tenth.
           {.slack = 2e-4, .slow = r.sigma_s > 2 || r.way.grid});
}

// A ball of albedo 1 - 1e-7 that gives off its absorption coefficient times 1e6: its light is the mean way,
// 4/3, times that coefficient, 1.6 x 1e-6. An albedo that goes through float32 is off by a fifth of 1e-7.
void bodies_all_but_white(Table& t) {
  constexpr double kDepth = 16, kAbsorbed = 1e-7, kSource = 1e6;
  for (const Way& way : all_ways())
    t.mean("N16-light-of-an-albedo-of-1-less-1e-7" + way.name(), "N16 7.6d",
           "What a medium of albedo 1 - 1e-7 absorbs, seen by the light that it gives off for it.",
           [=] {
             SceneKit kit;
             way.choose(kit);
             const MediumIndex m =
                 way.medium(kit, rgb(kDepth), rgb(1 - kAbsorbed), 0, box({-1, -1, -1}, {1, 1, 1}));
             if (auto* h = std::get_if<HomogeneousMedium>(&kit.scene.media[m.value])) {
               h->source_radiance = rgb(kSource);
             } else {
               const VolumeIndex v = kit.constant(rgb(kSource));
               std::get<HeterogeneousMedium>(kit.scene.media[m.value]).source_radiance = v;
             }
             kit.container(SphereShape{}, {}, kit.null(), m);
             kit.look({0, -5, 0}, {0, 0, 0});
             kit.scene.sensor.projection = Projection::orthographic;
             return kit;
           },
           // Reabsorbed: a share of 1.6e-6 per length, over ways of some 20.
           grey(kPi / 3 * kDepth * kAbsorbed * kSource),
           {.band = .01,
            .why_band = "16 mean free paths: ways that vary by more than their mean",
            .slack = 5e-5,
            .slow = way.distant});
}

}  // namespace

void add_bodies(Table& t) {
  mean_way_through_a_cube(t);
  bodies_all_but_white(t);
}

}  // namespace ls::cases

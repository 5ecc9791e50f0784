// Albedos 0, 1 and almost 1, slabs so deep that light is scattered hundreds of times, Russian roulette, and
// phase functions up to |g| = 0.9999, where other renderers clamp.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

SceneBuilder white_cube(const Configuration& configuration, const Rgb& sigma_t, double g) {
  SceneBuilder builder;
  configuration.choose(builder);
  const MediumIndex m = configuration.medium(builder, sigma_t, rgb(1), g, box({-1, -1, -1}, {1, 1, 1}));
  builder.container(CubeShape{}, {}, builder.null(), m);
  return furnace(builder);
}

void white(Table& t) {
  for (const Configuration& configuration : all_configurations()) {
    for (const double tau : {1e-6, 1., 64.}) {
      for (const double g : {0., .9999}) {
        // Russian roulette acts on paths of more than 1024 vertices, so that their weights are no longer
        // exactly 1. At depth 64 with g = 0 such paths occur, so that case is left out; in the others nearly
        // all paths are shorter.
        if (tau > 1 && g == 0) continue;
        t.exact(fmt::format("N16-white-depth-{:g}-g-{:g}{}", tau, g, configuration.name()), "N16 N17 7.6c",
                "Albedo 1 in a white sky: every path weighs 1 exactly, in every sample.",
                [=](const Bench& b) {
                  return every_value(b, white_cube(configuration, rgb(tau / 2), g), 64, grey(1), 0);
                });
      }
    }
    t.mean("N16-white-chromatic" + configuration.name(), "N16 7.6c",
           "The same with extinctions of .5, 1 and 4: weights differ, their mean is 1.",
           [=] {
             return white_cube(configuration, {.5, 1, 4}, .3);
           },
           grey(1), {.channels = true});
    t.exact("N16-black" + configuration.name(), "N16", "Albedo 0 in the sun: no light is scattered, exactly.",
            [=](const Bench& b) {
              return every_value(b, lit_cube(configuration, rgb(1), rgb(0)), 16, grey(0), 0);
            });
  }
}

// A slab of albedo 1 - 1e-7. It absorbs a share of the light that is 1e-7 times the mean number of
// scatterings, about 40 here. So to five digits it reflects like a slab of albedo 1.
void all_but_white(Table& t) {
  for (const Configuration& configuration : two_configurations()) {
    t.mean("N16-all-but-white-16" + configuration.name(), "N16 7.2",
           "Albedo 1 - 1e-7, optical depth 16: as white.",
           [=] {
             return column(configuration, {1 - 1e-7, 0, 16}, false);
           },
           grey(.903632), {.slack = 1e-5});
  }
}

// Returns the transmittance T of a white slab for light at normal incidence, by the formula for large optical
// depths tau: T = (4/3) K / (tau + 1.42089) with K = (sqrt(3) / 4) H(1), where Chandrasekhar's H(1) is
// 2.907811. Already at tau = 16 the formula gives all digits of the tabulated value, 0.096368.
double white_transmittance(double tau) { return std::sqrt(3.) / 3 * 2.907811 / (tau + 1.42089); }

void deep(Table& t) {
  for (const Configuration& configuration : both_media()) {
    for (const double tau : {64., 256.}) {
      if (tau > 100 && configuration.grid) continue;  // takes minutes; grids are tested at depth 64
      t.mean(
          fmt::format("N17-white-slab-{:g}{}", tau, configuration.name()), "N17 N16 7.2",
          "A white slab this deep: paths of hundreds of vertices, ended by no cap.",
          [=] { return column(configuration, {.tau = tau}, false); }, grey(1 - white_transmittance(tau)),
          // At depth 256 most of the variance comes from a few very long paths, which occur in few pixels. A
          // short pilot run would find no such path, or overestimate their share.
          {.slack = 1e-6, .slow = true, .paths = tau < 100 ? 0u : 1u << 17, .frames = tau < 100 ? 0u : 64u});
    }
  }
  t.mean("N17-through-a-white-slab-64/homogeneous/volpath", "N17 7.2",
         "What a white slab of optical depth 64 lets through.", [] { return column({}, {.tau = 64}, true); },
         grey(white_transmittance(64)),
         {.band = .1,
          .why_band = "one path of forty gets through, after a thousand scatterings",
          .slack = 1e-4,
          .slow = true,
          .paths = 1u << 16});
}

void roulette(Table& t) {
  for (const int depth : {1, 5, 1000}) {
    for (const Configuration& configuration : two_configurations()) {
      t.mean(fmt::format("N61-roulette-from-{}{}", depth, configuration.name()), "N61 7.2",
             "Roulette from the first vertex on, or never: the same slab.",
             [=] {
               SceneBuilder builder = column(configuration, {.9, 0, 1}, false);
               builder.scene.integrator.rr_depth = depth;
               return builder;
             },
             grey(.267410), {.slack = 1e-5});
    }
  }
}

// Parallel light that is scattered towards the camera by 0 degrees if g > 0, by 180 degrees otherwise. In
// both cases the camera sees the peak of the phase function p. For g > 0, 4 pi p(0) = (1 + g) / (1 - g)^2,
// which is 1.9999e8 at g = 0.9999.
void phase_peaks(Table& t) {
  const auto add = [&](const std::string& id, const char* rows, const Configuration& configuration,
                       double g) {
    t.mean(id, rows, "Light scattered straight on: 4 pi p = (1 + |g|) / (1 - |g|)^2, not clamped.",
           [=] { return head_on(configuration, g, .5, g > 0); }, grey(head_on_answer(g, .5)),
           // The slack: g is rounded to float32, by at most 2^-25, so 1 - |g| has a relative error of
           // 2^-25 / (1 - |g|), and the peak depends on the square of 1 - |g|.
           {.band = .003, .slack = 2 * 0x1p-25 / (1 - std::abs(g))});
  };
  for (const Configuration& configuration : all_configurations()) {
    for (const double g : {.99, .999, .9999, -.99, -.9999})
      add(fmt::format("N18-peak-g-{:g}{}", g, configuration.name()), "N18", configuration, g);
  }
}

// Returns the share of singly scattered light that is deflected by less than the angle q (`degrees`). The
// camera measures it by looking through the medium at a sun of angular radius q, which phase function
// sampling and light sampling both find.
double share_within(double g, double degrees) {
  const double h = std::sin(degrees * kPi / 360), x = 2 * h * h;  // x is 1 - cos q
  return (1 - g) * (1 + g) / (2 * g) * (1 / (1 - g) - 1 / std::sqrt((1 - g) * (1 - g) + 2 * g * x));
}

void cones(Table& t) {
  struct Cone {
    double g, degrees;
  };
  for (const Configuration& configuration : all_configurations()) {
    for (const Cone c : {Cone{.9999, .0115}, Cone{.999, .115}, Cone{.99, .6}}) {
      const double radius = c.degrees * kPi / 180, x = 2 * std::pow(std::sin(radius / 2), 2);
      // The sun has radiance 1, so its irradiance is its projected solid angle. The slack is for the path
      // length through the cube: it is the same for all directions of the light up to a share of
      // radius^2 / 2, which is 5.5e-5 at 0.6 degrees.
      const double irradiance = 2 * kPi * x * (1 - x / 2);
      t.mean(fmt::format("N18-cone-g-{:g}{}", c.g, configuration.name()), "N18 N26",
             "A sun of a few thousandths of a degree, seen directly and by light scattered into the view.",
             [=] {
               SceneBuilder builder = unit_cube(configuration, rgb(1), rgb(1), c.g);
               builder.scene.emitters.push_back(DirectionalEmitter{{-1, 0, 0}, rgb(irradiance), c.degrees});
               builder.scene.integrator.max_depth = kOnce;
               builder.look({-3, .5, .5}, {.5, .5, .5}, 1e-5);
               return builder;
             },
             grey(std::exp(-1.) * (1 + share_within(c.g, c.degrees))), {.slack = radius * radius});
    }
  }
}

void small_and_forbidden(Table& t) {
  for (const Configuration& configuration : all_configurations()) {
    for (const double g : {1e-7, -1e-7, 1e-30})
      t.mean(
          fmt::format("N18-all-but-isotropic-g-{:g}{}", g, configuration.name()), "N18",
          "A g of next to nothing is isotropic scattering: there is no division by it.",
          [=] {
            SceneBuilder builder = lit_cube(configuration, rgb(1), rgb(1));
            const PhaseIndex last = SceneBuilder::push<PhaseTag>(builder.scene.phases, HgPhase{g});
            std::visit([&](auto& m) { m.phase = last; }, builder.scene.media[0]);
            return builder;
          },
          grey(lit_cube_answer(1, 1)));
  }
  for (const double g : {1., -1., .99999999999})
    t.exact(fmt::format("N19-g-{:g}-is-refused{}", g, g < 1 && g > 0 ? "-too" : ""), "N19",
            "A phase function that is a delta is refused, saying so.", [g](const Bench& b) {
              return refused(b, unit_cube({}, rgb(1), rgb(1), g), {"between -1 and 1"});
            });
}

// Tabulated reflectance R and transmittance T of slabs with Henyey-Greenstein phase functions (van de Hulst
// 1980), among them one that scatters backwards.
void slabs(Table& t) {
  struct Row {
    Slab slab;
    double r, t;
  };
  for (const Configuration& configuration : two_configurations()) {
    for (const Row& row : {Row{{.9, .75, 2}, .097395, .660958}, Row{{1, .85, 8}, .358432, .641568},
                           Row{{1, -.5, 2}, .620494, .379506}}) {
      for (const bool through : {false, true}) {
        // On grids, the reflectance of a forward-scattering slab takes half a minute. It is tested on
        // homogeneous media only.
        if (configuration.grid && !through && row.slab.g > 0) continue;
        t.mean(fmt::format("7.2-slab-a{:g}-g{:g}-tau{:g}-{}{}", row.slab.albedo, row.slab.g, row.slab.tau,
                           through ? "T" : "R", configuration.name()),
               "7.2 N18", "A slab of Henyey-Greenstein scattering at normal incidence, tabulated.",
               [=] { return column(configuration, row.slab, through); }, grey(through ? row.t : row.r),
               {.slack = 1e-5, .slow = !through || configuration.grid || row.slab.tau > 4});
      }
    }
  }
}

}  // namespace

void add_albedos(Table& t) {
  white(t);
  all_but_white(t);
  deep(t);
  roulette(t);
}

void add_phases(Table& t) {
  phase_peaks(t);
  cones(t);
  small_and_forbidden(t);
  slabs(t);
}

}  // namespace ls::cases

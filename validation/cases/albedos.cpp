// Media of albedo 0, 1 and almost 1, slabs so deep that light is scattered hundreds of times, and Russian
// roulette.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

SceneBuilder furnace(const Configuration& configuration, const Rgb& sigma_t, const Rgb& albedo, double g) {
  SceneBuilder builder;
  configuration.choose(builder);
  const MediumIndex m = configuration.medium(builder, sigma_t, albedo, g, box({-1, -1, -1}, {1, 1, 1}));
  builder.container(CubeShape{}, {}, builder.null(), m);
  builder.environment();
  builder.look({.4, -6, .7}, {0, 0, 0}, 30);
  return builder;
}

void white(Table& t) {
  for (const Configuration& configuration : all_configurations()) {
    for (const double tau : {1e-6, 1., 64.}) {
      for (const double g : {0., .9999}) {
        // Russian roulette acts on paths of more than 1024 vertices, and changes their weights from exactly
        // 1. At depth 64 with g = 0 such paths occur, so that case is left out; in the others nearly all
        // paths are shorter.
        if (tau > 1 && g == 0) continue;
        t.exact(fmt::format("N16-white-depth-{:g}-g-{:g}{}", tau, g, configuration.name()), "N16 N17 7.6c",
                "Albedo 1 in a white sky: every path weighs 1 exactly, in every sample.",
                [=](const Bench& b) {
                  return every_value(b, furnace(configuration, rgb(tau / 2), rgb(1), g), 64, grey(1), 0);
                });
      }
    }
    t.mean("N16-white-chromatic" + configuration.name(), "N16 7.6c",
           "The same with extinctions of .5, 1 and 4: weights differ, their mean is 1.",
           [=] {
             return furnace(configuration, {.5, 1, 4}, rgb(1), .3);
           },
           grey(1), {.channels = true});
    t.exact("N16-black" + configuration.name(), "N16", "Albedo 0 in the sun: no light is scattered, exactly.",
            [=](const Bench& b) {
              return every_value(b, lit_cube(configuration, rgb(1), rgb(0)), 16, grey(0), 0);
            });
  }
}

// A slab of albedo 1 - 1e-7. The share of light that it absorbs is 1e-7 times the mean number of scatterings,
// which is about 40 here.
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

// The transmittance of a white slab at normal incidence by the formula for large depths tau:
// T = (4/3) K / (tau + 1.42089) with K = (sqrt(3) / 4) H(1), where Chandrasekhar's H(1) is 2.907811. Already
// at tau = 16 the formula gives the tabulated 0.096368 to all digits.
double white_transmittance(double tau) { return std::sqrt(3.) / 3 * 2.907811 / (tau + 1.42089); }

void deep(Table& t) {
  for (const Configuration& configuration : both_media()) {
    for (const double tau : {64., 256.}) {
      if (tau > 100 && configuration.grid) continue;  // takes minutes, and depth 64 shows the same
      t.mean(
          fmt::format("N17-white-slab-{:g}{}", tau, configuration.name()), "N17 N16 7.2",
          "A white slab this deep: paths of hundreds of vertices, ended by no cap.",
          [=] { return column(configuration, {.tau = tau}, false); }, grey(1 - white_transmittance(tau)),
          // At depth 256 the error comes from a few very long paths, and few pixels have one. A short first
          // run would find none of them, or overestimate their share.
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

}  // namespace

void add_albedos(Table& t) {
  white(t);
  all_but_white(t);
  deep(t);
  roulette(t);
}

}  // namespace ls::cases

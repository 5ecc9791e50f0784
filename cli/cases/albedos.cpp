// Albedos 0, 1 and all but 1; roulette; depths at which light is scattered hundreds of times.
#include <fmt/format.h>

#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/checks.h"
#include "cli/cases/stages.h"

namespace ls::cases {
namespace {

SceneKit furnace(const Way& way, const Rgb& sigma_t, const Rgb& albedo, double g) {
  SceneKit kit;
  way.choose(kit);
  const MediumIndex m = way.medium(kit, sigma_t, albedo, g, box({-1, -1, -1}, {1, 1, 1}));
  kit.container(CubeShape{}, {}, kit.null(), m);
  kit.environment();
  kit.look({.4, -6, .7}, {0, 0, 0}, 30);
  return kit;
}

void white(Table& t) {
  for (const Way& way : all_ways()) {
    for (const double tau : {1e-6, 1., 64.}) {
      for (const double g : {0., .9999}) {
        // Paths of more than 1024 vertices may be ended by chance; these are shorter but for few in the last.
        if (tau > 1 && g == 0) continue;
        t.exact(fmt::format("N16-white-depth-{:g}-g-{:g}{}", tau, g, way.name()), "N16 N17 7.6c",
                "Albedo 1 in a white sky: every path weighs 1 exactly, in every sample.",
                [=](const Bench& b) {
                  return every_value(b, furnace(way, rgb(tau / 2), rgb(1), g), 64, grey(1), 0);
                });
      }
    }
    t.mean("N16-white-chromatic" + way.name(), "N16 7.6c",
           "The same with extinctions of .5, 1 and 4: weights differ, their mean is 1.",
           [=] {
             return furnace(way, {.5, 1, 4}, rgb(1), .3);
           },
           grey(1), {.channels = true});
    t.exact("N16-black" + way.name(), "N16", "Albedo 0 in the sun: no light is scattered, exactly.",
            [=](const Bench& b) { return every_value(b, lit_cube(way, rgb(1), rgb(0)), 16, grey(0), 0); });
  }
}

// A slab whose albedo is 1 - 1e-7: what is absorbed is 1e-7 times the mean number of scatterings, some 40
// here.
void all_but_white(Table& t) {
  for (const Way& way : two_ways()) {
    t.mean("N16-all-but-white-16" + way.name(), "N16 7.2", "Albedo 1 - 1e-7, optical depth 16: as white.",
           [=] {
             return column(way, {1 - 1e-7, 0, 16}, false);
           },
           grey(.903632), {.slack = 1e-5});
  }
}

// T = (4/3) K / (tau + 1.42089) of a white slab at normal incidence, K = sqrt(3) / 4 H(1), H(1) = 2.907811;
// at tau = 16 the tabulated .096368 to all digits.
double white_transmittance(double tau) { return std::sqrt(3.) / 3 * 2.907811 / (tau + 1.42089); }

void deep(Table& t) {
  for (const Way& way : both_media()) {
    for (const double tau : {64., 256.}) {
      if (tau > 100 && way.grid) continue;  // minutes, for what 64 shows as well
      t.mean(
          fmt::format("N17-white-slab-{:g}{}", tau, way.name()), "N17 N16 7.2",
          "A white slab this deep: paths of hundreds of vertices, ended by no cap.",
          [=] { return column(way, {.tau = tau}, false); }, grey(1 - white_transmittance(tau)),
          // Few paths are so long that they matter: a small first run sees none of them, or thinks there were
          // more, and few pixels have one.
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
    for (const Way& way : two_ways()) {
      t.mean(fmt::format("N61-roulette-from-{}{}", depth, way.name()), "N61 7.2",
             "Roulette from the first vertex on, or never: the same slab.",
             [=] {
               SceneKit kit = column(way, {.9, 0, 1}, false);
               kit.scene.integrator.rr_depth = depth;
               return kit;
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

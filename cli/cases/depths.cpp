// Optical depths from 0 to 1e6: what is seen through, given off and scattered.
#include <fmt/format.h>

#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/checks.h"
#include "cli/cases/stages.h"

namespace ls::cases {
namespace {

constexpr double kThin[] = {1e-12, 1e-9, 1e-6, 1e-3};
// A figure that every sample gives alike is a product of some ten float32 numbers, 2^-24 each.
constexpr double kTenRoundings = 6e-7;

constexpr Way kDistant{false, true}, kDistantGrid{true, true}, kVolpath{false, false};

// (1 - e^-x) / x.
double phi(double x) { return x == 0 ? 1 : -std::expm1(-x) / x; }

void nothing(Table& t) {
  for (const Way& way : all_ways()) {
    t.exact(
        "N01-no-extinction" + way.name(), "N1",
        "A medium that takes a part in 1e30, and so stays in the scene, shows a white sky as 1 exactly, in "
        "every sample.",
        [way](const Bench& b) {
          SceneKit kit = unit_cube(way, rgb(1e-30));
          kit.environment();
          return every_value(b, kit, 64, grey(1), 0);
        });
    if (!way.grid) continue;
    t.exact("N01-zeros" + way.name(), "N1",
            "A grid whose values are all 0, which only its file says, shows 1 exactly, in every sample.",
            [way](const Bench& b) {
              SceneKit kit = unit_cube(way, rgb(1));
              std::get<HeterogeneousMedium>(kit.scene.media.at(0)).sigma_t =
                  kit.grid({3, 4, 5}, std::vector<float>(60, 0), {});
              kit.environment();
              return every_value(b, kit, 64, grey(1), 0);
            });
  }
}

// L = eps (1 - e^-tau) / sigma along a unit: deterministic but for macro cells of grids that are drawn.
void emission(Table& t) {
  for (const Way& way : both_media()) {
    for (const double tau : kThin) {
      t.exact(fmt::format("N02-emission-{:g}{}", tau, way.name()), "N2 N7 7.6b",
              "A unit of a medium that absorbs this little gives off eps (1 - e^-tau) / sigma.",
              [=](const Bench& b) {
                SceneKit kit = unit_cube(way, rgb(tau));
                kit.glow(MediumIndex{0}, rgb(1));
                return every_value(b, kit, 64, grey(phi(tau)), kTenRoundings);
              });
    }
    for (const double tau : {0., 1., 1e3, 1e6}) {
      t.mean(fmt::format("N67-emission-{:g}{}", tau, way.name()), "N67 N3 N7 7.6b",
             "Light given off without extinction is eps d; at depth it is eps / sigma.",
             [=] {
               SceneKit kit = unit_cube(way, rgb(tau));
               kit.glow(MediumIndex{0}, rgb(1));
               return kit;
             },
             grey(phi(tau)), {.band = 1e-4});
    }
  }
}

void thin_scattering(Table& t) {
  for (const double tau : kThin) {
    for (const Way& way : {kDistant, kDistantGrid}) {
      t.mean(fmt::format("N02-sunlit-{:g}{}", tau, way.name()), "N2",
             "Sunlight scattered once in a medium this thin: proportional to its depth.",
             [=] { return lit_cube(way, rgb(tau), rgb(1)); }, grey(lit_cube_answer(tau, 1)), {.band = 1e-4});
    }
    for (const Way& way : {kVolpath, kDistant, kDistantGrid}) {
      t.mean(fmt::format("N02-lamplit-{:g}{}", tau, way.name()), "N2 N22",
             "A lamp's light scattered once in a medium this thin: proportional to its depth.",
             [=] {
               SceneKit kit = passing(way, rgb(tau), rgb(1));
               kit.scene.emitters.push_back(PointEmitter{{.5, 0, 0}, rgb(1 / (4 * kPi))});
               return kit;
             },
             grey(passing_answer(.5, tau)), {.band = 1e-3});
    }
  }
}

void opaque(Table& t) {
  for (const Way& way : all_ways()) {
    for (const double tau : {1e3, 1e6}) {
      t.exact(fmt::format("N03-nothing-gets-through-{:g}{}", tau, way.name()), "N3",
              "Of a white sky behind this depth nothing is left, exactly.", [=](const Bench& b) {
                SceneKit kit = unit_cube(way, rgb(tau));
                kit.environment();
                return every_value(b, kit, 64, grey(0), 0);
              });
    }
  }
  // 1 - sqrt(1 - a) H(1), Chandrasekhar 1950; six digits of it. From 1e5 on the mean free path is less than
  // what rays keep off surfaces (2^-20 of the world): it is from where a path truly stands that its way to
  // the face is measured. At 1e6 it is 17 float32 places at the face's height: where light comes from next to
  // the face is a trapezoidal sum over these instead of an integral, which for even scattering, int E_2(z)
  // dz, is 3.1e-3 too much.
  constexpr double kDigits = 2e-6, kPlaces = 3.1e-3;
  for (const Way& way : all_ways()) {
    for (const double tau : {1e3, 1e5, 1e6}) {
      const bool coarse = tau == 1e6;
      if (tau == 1e5 && way.grid != way.distant) continue;
      if (coarse && way.grid && way.distant) continue;  // half a minute; three ways are left
      t.mean(fmt::format("N03-semi-infinite-a.9-{:g}{}", tau, way.name()), "N3 7.1",
             "An all but endless medium of this depth reflects what Chandrasekhar's H gives.",
             [=] { return half_space(way, .9, tau, 1); }, grey(.414947),
             {.band = coarse ? .006 : kBand,
              .why_band =
                  coarse ? "17 float32 places to a mean free path at the face's height: a sum that is .31 % "
                           "above its integral"
                         : "",
              .slack = coarse ? kPlaces : kDigits});
    }
  }
}

// Light straight down through an absorber onto a floor: only shadow rays see it.
void shadows(Table& t) {
  for (const double tau : {20., 30., 80.}) {
    const double expected = std::exp(-tau) / (2 * kPi);
    // The exponent is a float32 of 2^-24: what it does to e^-tau.
    const double tolerance = kTenRoundings + 2 * tau * 0x1p-24;
    for (const Way& way : both_media()) {
      t.exact(fmt::format("N05-shadow-{:g}{}", tau, way.name()), "N5 N60",
              "A shadow ray through this depth: e^-tau to the last digits, not by chance.",
              [=](const Bench& b) {
                SceneKit kit = lit_floor();
                way.choose(kit);
                const MediumIndex m = way.medium(kit, rgb(tau), rgb(0), 0, box({-1, -1, 1}, {1, 1, 2}));
                kit.container(CubeShape{}, translate({0, 0, 1.5}) * scale(1, 1, .5), kit.null(), m);
                return every_value(b, kit, 16, grey(expected), tolerance);
              });
    }
  }
  // Where densities change, little light is walked by few (kRouletteDepth): right in the mean.
  // Density 0, 1, 2, 3 at the centres of four voxels along z, clamped beyond: 1.5 in all.
  t.mean("N05-shadow-ramp-8/grid/volpath", "N5 7.6a",
         "A shadow ray through a ramp of densities, by residual tracking.",
         [] {
           SceneKit kit = lit_floor();
           const VolumeIndex ramp = kit.grid({1, 1, 4}, {0, 1, 2, 3}, box({-1, -1, 1}, {1, 1, 2}));
           kit.container(CubeShape{}, translate({0, 0, 1.5}) * scale(1, 1, .5), kit.null(),
                         kit.heterogeneous(ramp, rgb(0), 8 / 1.5));
           return kit;
         },
         grey(std::exp(-8.) / (2 * kPi)),
         {.band = .02,
          .why_band = "an e^-8 of the light, by the few shadow rays that are walked on in the dark"});
}

}  // namespace

void add_depths(Table& t) {
  nothing(t);
  emission(t);
  thin_scattering(t);
  opaque(t);
  shadows(t);
}

}  // namespace ls::cases

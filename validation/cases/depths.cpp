// Optical depths from 0 to 1e6: transmittance, emission and scattering.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

constexpr double kThin[] = {1e-12, 1e-9, 1e-6, 1e-3};
// The relative tolerance for values that are equal in all samples. Each is a product of about ten float32
// numbers with relative errors of 2^-24 = 6e-8.
constexpr double kTenRoundings = 6e-7;

constexpr Configuration kDistant{false, true}, kDistantGrid{true, true}, kVolpath{false, false};

double phi(double x) { return x == 0 ? 1 : -std::expm1(-x) / x; }

void nothing(Table& t) {
  for (const Configuration& configuration : all_configurations()) {
    t.exact(
        "N01-no-extinction" + configuration.name(), "N1",
        "A medium that takes a part in 1e30, and so stays in the scene, shows a white sky as 1 exactly, in "
        "every sample.",
        [configuration](const Bench& b) {
          return every_value(b, in_white(unit_cube(configuration, rgb(1e-30))), 64, grey(1), 0);
        });
    if (!configuration.grid) continue;
    t.exact("N01-zeros" + configuration.name(), "N1",
            "A grid whose values are all 0, which only its file says, shows 1 exactly, in every sample.",
            [configuration](const Bench& b) {
              SceneBuilder builder = unit_cube(configuration, rgb(1));
              std::get<HeterogeneousMedium>(builder.scene.media.at(0)).sigma_t =
                  builder.grid({3, 4, 5}, std::vector<float>(60, 0), {});
              builder.environment();
              return every_value(b, builder, 64, grey(1), 0);
            });
  }
}

// A medium that emits eps per length and has the extinction sigma, seen along a ray of length 1: the optical
// depth tau equals sigma. The radiance is eps (1 - e^-tau) / sigma. The estimate has no variance, except in
// those macro cells of grids in which a tracker, an algorithm that steps from collision to collision, samples
// free flights.
void emission(Table& t) {
  const auto emitting = [](const Configuration& configuration, double tau) {
    SceneBuilder builder = unit_cube(configuration, rgb(tau));
    builder.set_emission(MediumIndex{0}, rgb(1));
    return builder;
  };
  for (const Configuration& configuration : both_media()) {
    for (const double tau : kThin) {
      t.exact(fmt::format("N02-emission-{:g}{}", tau, configuration.name()), "N2 N7 7.6b",
              "A unit of a medium that absorbs this little gives off eps (1 - e^-tau) / sigma.",
              [=](const Bench& b) {
                return every_value(b, emitting(configuration, tau), 64, grey(phi(tau)), kTenRoundings);
              });
    }
    for (const double tau : {0., 1., 1e3, 1e6}) {
      t.mean(fmt::format("N67-emission-{:g}{}", tau, configuration.name()), "N67 N3 N7 7.6b",
             "Light given off without extinction is eps d; at depth it is eps / sigma.",
             [=] { return emitting(configuration, tau); }, grey(phi(tau)), {.band = 1e-4});
    }
  }
}

void thin_scattering(Table& t) {
  for (const double tau : kThin) {
    for (const Configuration& configuration : {kDistant, kDistantGrid}) {
      t.mean(fmt::format("N02-sunlit-{:g}{}", tau, configuration.name()), "N2",
             "Sunlight scattered once in a medium this thin: proportional to its depth.",
             [=] { return lit_cube(configuration, rgb(tau), rgb(1)); }, grey(lit_cube_answer(tau, 1)),
             {.band = 1e-4});
    }
    for (const Configuration& configuration : {kVolpath, kDistant, kDistantGrid}) {
      t.mean(fmt::format("N02-lamplit-{:g}{}", tau, configuration.name()), "N2 N22",
             "A lamp's light scattered once in a medium this thin: proportional to its depth.",
             [=] { return beside_a_watt(passing(configuration, rgb(tau), rgb(1)), .5); },
             grey(passing_answer(.5, tau)), {.band = 1e-3});
    }
  }
}

void opaque(Table& t) {
  for (const Configuration& configuration : all_configurations()) {
    for (const double tau : {1e3, 1e6}) {
      t.exact(fmt::format("N03-nothing-gets-through-{:g}{}", tau, configuration.name()), "N3",
              "Of a white sky behind this depth nothing is left, exactly.", [=](const Bench& b) {
                return every_value(b, in_white(unit_cube(configuration, rgb(tau))), 64, grey(0), 0);
              });
    }
  }
  // The answer is 1 - sqrt(1 - a) H(1), to six digits, with the albedo a = 0.9 and Chandrasekhar's function H
  // (1950). The mean free path is 1e-5 at depth 1e5 and 1e-6 at depth 1e6, while rays start about 2e-6 from
  // the surface that they leave (2^-20 of the scene's largest coordinate). So the distance to the face must
  // be measured from the path's true position, not from the offset origin of the ray. At depth 1e6 the mean
  // free path is 17 ulps of float32 at the face's height. Next to the face the renderer then computes a
  // trapezoidal sum over float32 positions z instead of an integral over z. For isotropic scattering the
  // integrand is E_2(z), the second exponential integral, and the sum is larger than the integral by a share
  // of 3.1e-3.
  constexpr double kDigits = 2e-6, kPlaces = 3.1e-3;
  for (const Configuration& configuration : all_configurations()) {
    for (const double tau : {1e3, 1e5, 1e6}) {
      const bool coarse = tau == 1e6;
      if (tau == 1e5 && configuration.grid != configuration.distant) continue;
      if (coarse && configuration.grid && configuration.distant)
        continue;  // takes half a minute; three other configurations test this depth
      t.mean(fmt::format("N03-semi-infinite-a.9-{:g}{}", tau, configuration.name()), "N3 7.1",
             "An all but endless medium of this depth reflects what Chandrasekhar's H gives.",
             [=] { return half_space(configuration, .9, tau, 1); }, grey(.414947),
             {.band = coarse ? .006 : kBand,
              .why_band =
                  coarse ? "17 float32 places to a mean free path at the face's height: a sum that is .31 % "
                           "above its integral"
                         : "",
              .slack = coarse ? kPlaces : kDigits});
    }
  }
}

// Light falls straight down through an absorber onto a floor, where only shadow rays find it.
void shadows(Table& t) {
  for (const double tau : {20., 30., 80.}) {
    const double expected = std::exp(-tau) / (2 * kPi);
    // The relative tolerance has two terms. The first is for the rounding of the factors of the radiance. The
    // second is for the exponent tau, the product of a coefficient and a length: each has a relative rounding
    // error of 2^-24, which changes e^-tau by a share of tau 2^-24.
    const double tolerance = kTenRoundings + 2 * tau * 0x1p-24;
    for (const Configuration& configuration : both_media()) {
      t.exact(fmt::format("N05-shadow-{:g}{}", tau, configuration.name()), "N5 N60",
              "A shadow ray through this depth: e^-tau to the last digits, not by chance.",
              [=](const Bench& b) {
                SceneBuilder builder = lit_floor();
                configuration.choose(builder);
                const MediumIndex m =
                    configuration.medium(builder, rgb(tau), rgb(0), 0, box({-1, -1, 1}, {1, 1, 2}));
                builder.container(CubeShape{}, translate({0, 0, 1.5}) * scale(1, 1, .5), builder.null(), m);
                return every_value(b, builder, 16, grey(expected), tolerance);
              });
    }
  }
  // Where the density varies, a shadow ray estimates its transmittance in steps. When little transmittance is
  // left, Russian roulette (kRouletteDepth) ends most of these estimates and increases the weights of the
  // others, so the mean stays the same. The density is 0, 1, 2, 3 at the centres of four voxels along z and
  // constant below the first and above the last centre, so its integral over the unit length is 1.5.
  t.mean("N05-shadow-ramp-8/grid/volpath", "N5 7.6a",
         "A shadow ray through a ramp of densities, by residual tracking.",
         [] {
           SceneBuilder builder = lit_floor();
           const VolumeIndex ramp = builder.grid({1, 1, 4}, {0, 1, 2, 3}, box({-1, -1, 1}, {1, 1, 2}));
           builder.container(CubeShape{}, translate({0, 0, 1.5}) * scale(1, 1, .5), builder.null(),
                             builder.heterogeneous(ramp, rgb(0), 8 / 1.5));
           return builder;
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

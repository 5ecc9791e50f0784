// The five t-tests (statistical tests of a mean) that scenes/validate/make_tests.py writes as scene files.
// They test light in media, for which each channel has a closed form. The scene is a cube [-1, 1]^3 seen
// along z through its middle, so the path length is 2. Both integrators render it, volpath_distant_mis with
// two ways of sampling distances.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

constexpr double kWay = 2;
constexpr Configuration kConfigurations[] = {
    {false, false}, {false, true, DistanceSampling::exponential}, {false, true, DistanceSampling::mis}};

SceneBuilder cube(const Configuration& configuration, const Rgb& sigma_a, const Rgb& sigma_s) {
  SceneBuilder builder;
  configuration.choose(builder);
  Rgb sigma_t, albedo;
  for (std::size_t k = 0; k < 3; ++k) {
    sigma_t[k] = sigma_a[k] + sigma_s[k];
    albedo[k] = sigma_t[k] > 0 ? sigma_s[k] / sigma_t[k] : 0;
  }
  const MediumIndex m = configuration.medium(builder, sigma_t, albedo, 0, box({-1, -1, -1}, {1, 1, 1}));
  builder.container(CubeShape{}, {}, builder.null(), m);
  builder.look({0, 0, -5}, {0, 0, 0}, 1e-3, {0, 1, 0});
  return builder;
}

template <class F>
Channels each(F f) {
  return {f(std::size_t{0}), f(std::size_t{1}), f(std::size_t{2})};
}

void absorption(Table& t, const Configuration& configuration) {
  const Rgb sigma{.2, .5, 3};
  t.mean(
      "seed-absorption" + configuration.name(), "seed 7.6a", "Light of 1 from behind: exp(-sigma_a d).",
      [=] { return in_white(cube(configuration, sigma, rgb(0))); },
      each([&](std::size_t k) { return std::exp(-sigma[k] * kWay); }));
}

void emission(Table& t, const Configuration& configuration) {
  const Rgb sigma{.2, 1, 0}, emitted{1, 2, .5};
  t.mean(
      "seed-emission" + configuration.name(), "seed 7.6b",
      "Radiance per length: e (1 - exp(-sigma_a d)) / sigma_a.",
      [=] {
        SceneBuilder builder = cube(configuration, sigma, rgb(0));
        std::get<HomogeneousMedium>(builder.scene.media[0]).emission = emitted;
        return builder;
      },
      each([&](std::size_t k) {
        return emitted[k] * (sigma[k] > 0 ? -std::expm1(-sigma[k] * kWay) / sigma[k] : kWay);
      }));
}

void constant_grid(Table& t, Configuration configuration) {
  configuration.grid = true;
  for (const double s : {.1, .5}) {
    t.mean(fmt::format("seed-hetero-constant-{:g}{}", s, configuration.name()), "seed 7.6a",
           "A grid of density 3 at a scale of .5: exp(-3 scale sigma_a d), the density counted once.",
           [=] {
             SceneBuilder builder;
             configuration.choose(builder);
             const VolumeIndex three =
                 builder.grid({2, 2, 2}, std::vector<float>(8, 3), box({-1, -1, -1}, {1, 1, 1}));
             const BsdfIndex null = builder.null();
             builder.container(CubeShape{}, {}, null, builder.heterogeneous(three, rgb(0), .5 * s));
             builder.scene.emitters.push_back(ConstantEmitter{{1, 2, 4}});
             builder.look({0, 0, -5}, {0, 0, 0}, 1e-3, {0, 1, 0});
             return builder;
           },
           {std::exp(-3 * s), 2 * std::exp(-3 * s), 4 * std::exp(-3 * s)});
  }
}

void furnace(Table& t, const Configuration& configuration) {
  for (const bool scatters : {false, true}) {
    t.mean(fmt::format("seed-furnace-{}{}", scatters ? "scattering" : "noscatter", configuration.name()),
           "seed 7.6c",
           "Light of 1 from everywhere: 1, where red and green meet nothing of the medium and where all is "
           "scattered.",
           [=] {
             return in_white(cube(configuration, rgb(0), scatters ? Rgb{.5, 1, 2} : Rgb{0, 0, .5}));
           },
           grey(1), {.channels = true});
  }
}

void scattering(Table& t, const Configuration& configuration) {
  const Rgb a{.1, .5, 2}, s{.4, .5, 1}, e{1, 2, 3};
  t.mean(
      "seed-scattering-distant" + configuration.name(), "seed 7.6f",
      "Sunlight scattered once: E / (4 pi) sigma_s / sigma_t (1 - exp(-sigma_t d)) exp(-sigma_t h).",
      [=] {
        SceneBuilder builder = cube(configuration, a, s);
        builder.scene.emitters.push_back(DirectionalEmitter{{0, -1, 0}, e});
        builder.scene.integrator.max_depth = kOnce;
        return builder;
      },
      each([&](std::size_t k) {
        const double sigma = a[k] + s[k];
        return e[k] / (4 * kPi) * s[k] / sigma * -std::expm1(-sigma * kWay) * std::exp(-sigma);
      }));
}

}  // namespace

void add_seed(Table& t) {
  for (const Configuration& configuration : kConfigurations) {
    absorption(t, configuration);
    emission(t, configuration);
    constant_grid(t, configuration);
    furnace(t, configuration);
    scattering(t, configuration);
  }
}

}  // namespace ls::cases

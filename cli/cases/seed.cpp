// The five t-tests of light in media (scenes/validate/make_tests.py), with closed forms for each channel: a
// cube
// [-1, 1]^3 seen along z through its middle, a way of 2, by the integrators in their ways of sampling
// distances.
#include <fmt/format.h>

#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/stages.h"

namespace ls::cases {
namespace {

constexpr double kWay = 2;
constexpr Way kWays[] = {
    {false, false}, {false, true, DistanceSampling::exponential}, {false, true, DistanceSampling::mis}};

SceneKit cube(const Way& way, const Rgb& sigma_a, const Rgb& sigma_s) {
  SceneKit kit;
  way.choose(kit);
  Rgb sigma_t, albedo;
  for (std::size_t k = 0; k < 3; ++k) {
    sigma_t[k] = sigma_a[k] + sigma_s[k];
    albedo[k] = sigma_t[k] > 0 ? sigma_s[k] / sigma_t[k] : 0;
  }
  const MediumIndex m = way.medium(kit, sigma_t, albedo, 0, box({-1, -1, -1}, {1, 1, 1}));
  kit.container(CubeShape{}, {}, kit.null(), m);
  kit.look({0, 0, -5}, {0, 0, 0}, 1e-3, {0, 1, 0});
  return kit;
}

template <class F>
Channels each(F f) {
  return {f(std::size_t{0}), f(std::size_t{1}), f(std::size_t{2})};
}

void absorption(Table& t, const Way& way) {
  const Rgb sigma{.2, .5, 3};
  t.mean(
      "seed-absorption" + way.name(), "seed 7.6a", "Light of 1 from behind: exp(-sigma_a d).",
      [=] {
        SceneKit kit = cube(way, sigma, rgb(0));
        kit.environment();
        return kit;
      },
      each([&](std::size_t k) { return std::exp(-sigma[k] * kWay); }));
}

void emission(Table& t, const Way& way) {
  const Rgb sigma{.2, 1, 0}, emitted{1, 2, .5};
  t.mean(
      "seed-emission" + way.name(), "seed 7.6b", "Radiance per length: e (1 - exp(-sigma_a d)) / sigma_a.",
      [=] {
        SceneKit kit = cube(way, sigma, rgb(0));
        std::get<HomogeneousMedium>(kit.scene.media[0]).emission = emitted;
        return kit;
      },
      each([&](std::size_t k) {
        return emitted[k] * (sigma[k] > 0 ? -std::expm1(-sigma[k] * kWay) / sigma[k] : kWay);
      }));
}

void constant_grid(Table& t, Way way) {
  way.grid = true;
  for (const double s : {.1, .5}) {
    t.mean(fmt::format("seed-hetero-constant-{:g}{}", s, way.name()), "seed 7.6a",
           "A grid of density 3 at a scale of .5: exp(-3 scale sigma_a d), the density counted once.",
           [=] {
             SceneKit kit;
             way.choose(kit);
             const VolumeIndex three =
                 kit.grid({2, 2, 2}, std::vector<float>(8, 3), box({-1, -1, -1}, {1, 1, 1}));
             const BsdfIndex null = kit.null();
             kit.container(CubeShape{}, {}, null, kit.heterogeneous(three, rgb(0), .5 * s));
             kit.scene.emitters.push_back(ConstantEmitter{{1, 2, 4}});
             kit.look({0, 0, -5}, {0, 0, 0}, 1e-3, {0, 1, 0});
             return kit;
           },
           {std::exp(-3 * s), 2 * std::exp(-3 * s), 4 * std::exp(-3 * s)});
  }
}

void furnace(Table& t, const Way& way) {
  for (const bool scatters : {false, true}) {
    t.mean(fmt::format("seed-furnace-{}{}", scatters ? "scattering" : "noscatter", way.name()), "seed 7.6c",
           "Light of 1 from everywhere: 1, where red and green meet nothing of the medium and where all is "
           "scattered.",
           [=] {
             SceneKit kit = cube(way, rgb(0), scatters ? Rgb{.5, 1, 2} : Rgb{0, 0, .5});
             kit.environment();
             return kit;
           },
           grey(1), {.channels = true});
  }
}

void scattering(Table& t, const Way& way) {
  const Rgb a{.1, .5, 2}, s{.4, .5, 1}, e{1, 2, 3};
  t.mean(
      "seed-scattering-distant" + way.name(), "seed 7.6f",
      "Sunlight scattered once: E / (4 pi) sigma_s / sigma_t (1 - exp(-sigma_t d)) exp(-sigma_t h).",
      [=] {
        SceneKit kit = cube(way, a, s);
        kit.scene.emitters.push_back(DirectionalEmitter{{0, -1, 0}, e});
        kit.scene.integrator.max_depth = kOnce;
        return kit;
      },
      each([&](std::size_t k) {
        const double sigma = a[k] + s[k];
        return e[k] / (4 * kPi) * s[k] / sigma * -std::expm1(-sigma * kWay) * std::exp(-sigma);
      }));
}

}  // namespace

void add_seed(Table& t) {
  for (const Way& way : kWays) {
    absorption(t, way);
    emission(t, way);
    constant_grid(t, way);
    furnace(t, way);
    scattering(t, way);
  }
}

}  // namespace ls::cases

// Optical depths from 0 to 1e6: what is seen through, given off and scattered in a unit of a medium.
#include <fmt/format.h>

#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/checks.h"
#include "cli/cases/ways.h"

namespace ls::cases {
namespace {

constexpr double kThin[] = {1e-12, 1e-9, 1e-6, 1e-3};

// The unit cube of a medium, seen along x through its middle.
SceneKit cube(const Way& way, const Rgb& sigma_t, const Rgb& albedo = rgb(0), double g = 0) {
  SceneKit kit;
  way.choose(kit);
  const MediumIndex m = way.medium(kit, sigma_t, albedo, g, Transform{});
  kit.container(CubeShape{}, translate({.5, .5, .5}) * scale(.5), kit.null(), m);
  kit.look({-3, .5, .5}, {.5, .5, .5});
  return kit;
}

SceneKit emitting(const Way& way, double sigma_a) {
  SceneKit kit = cube(way, rgb(sigma_a));
  if (way.grid) {
    auto& m = std::get<HeterogeneousMedium>(kit.scene.media[0]);
    m.emission = kit.constant(rgb(1));
  } else {
    std::get<HomogeneousMedium>(kit.scene.media[0]).emission = rgb(1);
  }
  return kit;
}

// (1 - e^-x) / x.
double phi(double x) { return x == 0 ? 1 : -std::expm1(-x) / x; }

void nothing(Table& t) {
  for (const Way& way : all_ways()) {
    t.exact("N01-no-extinction" + way.name(), "N1",
            "A medium without extinction before a white sky: 1 exactly, in every sample.",
            [way](const Bench& b) {
              SceneKit kit = cube(way, rgb(0));
              kit.environment();
              return every_value(b, kit, 64, grey(1), 0);
            });
  }
}

void glow(Table& t) {
  for (const Way& way : both_media()) {
    for (const double tau : kThin) {
      t.mean(fmt::format("N02-emission-{:g}{}", tau, way.name()), "N2 7.6b",
             "A unit of a medium that absorbs this little gives off eps (1 - e^-tau) / sigma.",
             [=] { return emitting(way, tau); }, grey(phi(tau)), {.band = 1e-4});
    }
    for (const double tau : {0., 1., 1e3, 1e6}) {
      t.mean(fmt::format("N67-emission-{:g}{}", tau, way.name()), "N67 N3 7.6b",
             "Light given off without extinction is eps d; at depth it is eps / sigma.",
             [=] { return emitting(way, tau); }, grey(phi(tau)), {.band = 1e-3});
    }
  }
}

}  // namespace

void add_depths(Table& t) {
  nothing(t);
  glow(t);
}

}  // namespace ls::cases

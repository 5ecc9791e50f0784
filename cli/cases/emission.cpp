// Media that give off light: closed forms of emission with absorption, and equilibria with scattering, in
// which everything is as bright as the source.
#include <fmt/format.h>

#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/stages.h"

namespace ls::cases {
namespace {

constexpr Rgb kSigma{0, 1, 16}, kEmission{1, 2.5, 4};

// Two homogeneous or constant media whose light is told in the two ways.
void glow(SceneKit& kit, MediumIndex m, const Rgb& emission, bool per_absorption) {
  if (auto* h = std::get_if<HomogeneousMedium>(&kit.scene.media[m.value])) {
    (per_absorption ? h->source_radiance : h->emission) = emission;
    return;
  }
  const VolumeIndex v = kit.constant(emission);
  auto& h = std::get<HeterogeneousMedium>(kit.scene.media[m.value]);
  (per_absorption ? h.source_radiance : h.emission) = v;
}

std::vector<float> hills(std::size_t n) {
  std::vector<float> v(n);
  for (std::size_t i = 0; i < n; ++i) v[i] = static_cast<float>((i * 7919) % 13) / 6;
  return v;
}

// A cube of an absorbing medium in the dark, seen through its middle: a unit of it.
void absorbing(Table& t) {
  const auto add = [&](const char* name, bool grid, bool per_absorption, const Rgb& sigma) {
    SceneKit kit;
    const MediumIndex m =
        grid ? kit.heterogeneous(kit.constant(sigma), rgb(0)) : kit.homogeneous(sigma, rgb(0));
    glow(kit, m, kEmission, per_absorption);
    kit.container(CubeShape{}, translate({.5, .5, .5}) * scale(.5), kit.null(), m);
    kit.look({-3, .5, .5}, {.5, .5, .5});
    Channels expected;
    for (std::size_t k = 0; k < 3; ++k) {
      const double absorbed = -std::expm1(-sigma[k]);
      expected[k] = kEmission[k] * (per_absorption ? absorbed : sigma[k] > 0 ? absorbed / sigma[k] : 1);
    }
    t.mean(std::string("7.6b-") + name, "7.6b N67",
           "Light given off by a unit of an absorber, in two ways to tell it.", kit, expected,
           {.band = .001});
  };
  add("without-extinction", false, false, rgb(0));
  add("per-length/homogeneous", false, false, kSigma);
  add("per-length/grid", true, false, kSigma);
  add("per-absorption/homogeneous", false, true, {.5, 1, 16});
  add("per-absorption/grid", true, true, {.5, 1, 16});
}

// Walls of radiance B around a medium of source B that scatters, too: B in every direction (an isothermal
// enclosure). Mirrors for walls are the same.
void enclosures(Table& t) {
  const auto add = [&](const char* name, bool mirrors, auto medium, bool per_absorption) {
    SceneKit kit;
    const MediumIndex m = medium(kit);
    Channels expected;
    Rgb emission{};
    for (std::size_t k = 0; k < 3; ++k) {
      expected[k] = kEmission[k];
      const auto* h = std::get_if<HomogeneousMedium>(&kit.scene.media[m.value]);
      emission[k] = kEmission[k] * (per_absorption ? 1 : h->sigma_t[k] * (1 - h->albedo[k]));
    }
    glow(kit, m, emission, per_absorption);
    const BsdfIndex walls = mirrors ? kit.mirror() : kit.diffuse(0);
    const TextureIndex light = kit.texture(kEmission);
    Shape& s = kit.shape(CubeShape{}, {}, walls);
    s.flip_normals = true;
    if (!mirrors) s.emitter = AreaEmitter{light};
    kit.scene.sensor.medium = m;
    kit.look({.2, -.3, .1}, {.5, .9, 0}, 60);
    for (const bool distant : {false, true}) {
      const Way way{false, distant};
      way.choose(kit);
      t.mean(fmt::format("7.6b-{}/{}", name, way.integrator_name()), "7.6b",
             "Isothermal: walls and a medium of one source, in every direction as bright as that.", kit,
             expected,
             {.band = mirrors ? .005 : kBand,
              .why_band = mirrors ? "nothing shines but the medium, and paths end by roulette alone" : "",
              .slow = mirrors});
    }
  };
  const auto chromatic = [](SceneKit& k) { return k.homogeneous({.5, 1, 3}, {.8, .5, .9}, .6); };
  const auto grid = [](SceneKit& k) {
    return k.heterogeneous(k.grid({8, 8, 8}, hills(512), translate({-2, -2, -2}) * scale(4)), {.6, .6, .6}, 1,
                           .4);
  };
  add("enclosure-per-length/homogeneous", false, chromatic, false);
  add("enclosure-source/homogeneous", false, chromatic, true);
  add("enclosure/grid", false, grid, true);
  add("enclosure-of-mirrors/homogeneous", true, chromatic, true);
}

// A scattering slab of source 1 before the dark: 1 - R - T (STABILITY section 7). Mirrors at the sides make
// it endless.
void slabs(Table& t) {
  const auto add = [&](const char* name, double albedo, double g, double tau, double expected) {
    SceneKit kit;
    const MediumIndex m = kit.homogeneous(rgb(1), rgb(albedo), g);
    glow(kit, m, rgb(1), true);
    const BsdfIndex mirror = kit.mirror(), null = kit.null();
    const double top = tau + 3, bottom = -2, half = (top - bottom) / 2, middle = (top + bottom) / 2;
    for (const double x : {-.5, .5}) {
      kit.shape(RectangleShape{}, translate({x, 0, middle}) * rotate_y(90) * scale(half, .6, 1), mirror);
      kit.shape(RectangleShape{}, translate({0, x, middle}) * rotate_x(90) * scale(.6, half, 1), mirror);
    }
    kit.container(RectangleShape{}, translate({0, 0, tau}) * scale(.6), null, m);
    kit.container(RectangleShape{}, rotate_x(180) * scale(.6), null, m);
    kit.look({.1, .15, tau + 1}, {.1, .15, 0}, 1e-3, {0, 1, 0});
    t.mean(std::string("7.6b-") + name, "7.6b 7.2",
           "A scattering slab of source 1 before the dark: 1 - R - T.", kit, grey(expected),
           {.slack = 5e-6, .slow = true});
  };
  add("slab-a.9-tau1", .9, 0, 1, .140965);
  add("slab-a.9-g.75-tau2", .9, .75, 2, .241647);
  add("slab-a.5-tau1", .5, 0, 1, .454823);
}

}  // namespace

void add_emission(Table& t) {
  absorbing(t);
  enclosures(t);
  slabs(t);
}

}  // namespace ls::cases

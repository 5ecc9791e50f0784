// Emissive media. With absorption only, the answers are closed forms. With scattering they follow from
// equilibrium: between walls whose radiance equals the source radiance of the medium (emission per length
// divided by the absorption coefficient), the radiance has this value everywhere, in every direction.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

constexpr Rgb kSigma{0, 1, 16}, kEmission{1, 2.5, 4};

std::vector<float> hills(std::size_t n) {
  std::vector<float> v(n);
  for (std::size_t i = 0; i < n; ++i) v[i] = static_cast<float>((i * 7919) % 13) / 6;
  return v;
}

// A cube of a medium that emits and absorbs, without any other light. It is seen through its middle, so that
// the path through it has length 1.
void absorbing(Table& t) {
  const auto add = [&](const char* name, bool grid, bool per_absorption, const Rgb& sigma) {
    SceneBuilder builder;
    const MediumIndex m =
        grid ? builder.heterogeneous(builder.constant(sigma), rgb(0)) : builder.homogeneous(sigma, rgb(0));
    builder.set_emission(m, kEmission, per_absorption);
    builder.container(CubeShape{}, translate({.5, .5, .5}) * scale(.5), builder.null(), m);
    builder.look({-3, .5, .5}, {.5, .5, .5});
    Channels expected;
    for (std::size_t k = 0; k < 3; ++k) {
      const double absorbed = -std::expm1(-sigma[k]);
      expected[k] = kEmission[k] * (per_absorption ? absorbed : sigma[k] > 0 ? absorbed / sigma[k] : 1);
    }
    t.mean(std::string("7.6b-") + name, "7.6b N67",
           "Light given off by a unit of an absorber, in two ways to tell it.", builder, expected,
           {.band = .001});
  };
  add("without-extinction", false, false, rgb(0));
  add("per-length/homogeneous", false, false, kSigma);
  add("per-length/grid", true, false, kSigma);
  add("per-absorption/homogeneous", false, true, {.5, 1, 16});
  add("per-absorption/grid", true, true, {.5, 1, 16});
}

// A medium that also scatters, of source radiance B, between walls that emit the radiance B: an isothermal
// enclosure, in which the radiance is B in every direction. With mirror walls that emit nothing the answer is
// the same.
void enclosures(Table& t) {
  const auto add = [&](const char* name, bool mirrors, auto medium, bool per_absorption) {
    SceneBuilder builder;
    const MediumIndex m = medium(builder);
    Channels expected;
    Rgb emission{};
    for (std::size_t k = 0; k < 3; ++k) {
      expected[k] = kEmission[k];
      const auto* h = std::get_if<HomogeneousMedium>(&builder.scene.media[m.value]);
      emission[k] = kEmission[k] * (per_absorption ? 1 : h->sigma_t[k] * (1 - h->albedo[k]));
    }
    builder.set_emission(m, emission, per_absorption);
    const BsdfIndex walls = mirrors ? builder.mirror() : builder.diffuse(0);
    const TextureIndex light = builder.texture(kEmission);
    Shape& s = builder.shape(CubeShape{}, {}, walls);
    s.flip_normals = true;
    if (!mirrors) s.emitter = AreaEmitter{light};
    builder.scene.sensor.medium = m;
    builder.look({.2, -.3, .1}, {.5, .9, 0}, 60);
    for (const bool distant : {false, true}) {
      const Configuration configuration{false, distant};
      configuration.choose(builder);
      t.mean(fmt::format("7.6b-{}/{}", name, configuration.integrator_name()), "7.6b",
             "Isothermal: walls and a medium of one source, in every direction as bright as that.", builder,
             expected,
             {.band = mirrors ? .005 : kBand,
              .why_band = mirrors ? "nothing shines but the medium, and paths end by roulette alone" : "",
              .slow = mirrors});
    }
  };
  const auto chromatic = [](SceneBuilder& k) { return k.homogeneous({.5, 1, 3}, {.8, .5, .9}, .6); };
  const auto grid = [](SceneBuilder& k) {
    return k.heterogeneous(k.grid({8, 8, 8}, hills(512), translate({-2, -2, -2}) * scale(4)), {.6, .6, .6}, 1,
                           .4);
  };
  add("enclosure-per-length/homogeneous", false, chromatic, false);
  add("enclosure-source/homogeneous", false, chromatic, true);
  add("enclosure/grid", false, grid, true);
  add("enclosure-of-mirrors/homogeneous", true, chromatic, true);
}

// A scattering slab with source radiance 1 in front of a black wall. Its radiance is 1 - R - T, with R and T
// the slab's reflectance and transmittance (docs/measurements/stability.md 7.6b). Mirrors at the sides make
// it infinite.
void emitting_slabs(Table& t) {
  const auto add = [&](const char* name, double albedo, double g, double tau, double expected) {
    SceneBuilder builder = column({}, {.albedo = albedo, .g = g, .tau = tau, .wall = .5}, false);
    builder.set_emission(MediumIndex{0}, rgb(1), true);
    builder.scene.emitters.clear();
    t.mean(std::string("7.6b-") + name, "7.6b 7.2",
           "A scattering slab of source 1 before the dark: 1 - R - T.", builder, grey(expected),
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
  emitting_slabs(t);
}

}  // namespace ls::cases

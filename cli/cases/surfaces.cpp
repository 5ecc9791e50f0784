// Surfaces at the ends of what they can be: smooth, rough, grazing, index-matched, transparent.
#include <fmt/format.h>

#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/checks.h"

namespace ls::cases {
namespace {

BsdfIndex rough_mirror(SceneKit& kit, double alpha, Microfacet d = Microfacet::ggx) {
  const TextureIndex a = kit.texture(rgb(alpha));
  return kit.bsdf(RoughConductorBsdf{d, a, a, {0, 0, 0}, {1, 1, 1}, kit.texture(rgb(1))});
}

// A sheet in z = 0 seen from this many degrees off its normal, with something to see in it.
SceneKit sheet(double degrees, auto make) {
  SceneKit kit;
  kit.shape(RectangleShape{}, scale(1e3), make(kit));
  const double a = degrees * kPi / 180;
  kit.look({5 * std::sin(a), 0, 5 * std::cos(a)}, {0, 0, 0}, 1e-3, {0, 1, 0});
  return kit;
}
SceneKit in_white(SceneKit kit) {
  kit.environment();
  return kit;
}
// A wall of two colours behind and a sky, so that it matters where a ray goes.
SceneKit before_a_wall(SceneKit kit) {
  const TextureIndex dark = kit.texture(rgb(.25)), bright = kit.texture({1, .75, .5});
  kit.scene.textures.push_back(CheckerboardTexture{dark, bright, {{8, 0, 0, 0, 8, 0, 0, 0, 1}}});
  const TextureIndex board{static_cast<std::uint32_t>(kit.scene.textures.size() - 1)};
  kit.shape(RectangleShape{}, translate({0, 0, -3}) * scale(6), kit.diffuse(0)).emitter = AreaEmitter{board};
  kit.environment(.125);
  kit.look({1, .5, 6}, {0, 0, 0}, 30, {0, 1, 0});
  return kit;
}

void microfacets(Table& t) {
  t.exact("N33-alpha-0", "N33",
          "A metal without roughness, and one of 5e-4, are the smooth metal, bit for bit.",
          [](const Bench& b) {
            const auto ball = [](auto make) {
              SceneKit kit;
              kit.shape(SphereShape{}, {}, make(kit));
              return before_a_wall(kit);
            };
            const SceneKit smooth = ball([](SceneKit& k) {
              return k.bsdf(ConductorBsdf{{0, 0, 0}, {1, 1, 1}, k.texture(rgb(1))});
            });
            Figure all = same_bits(b, ball([](SceneKit& k) { return rough_mirror(k, 0); }), smooth, 16);
            all.got += same_bits(b, ball([](SceneKit& k) { return rough_mirror(k, 5e-4); }), smooth, 16).got;
            return all;
          });
  for (const auto d : {Microfacet::ggx, Microfacet::beckmann})
    for (const double alpha : {1e-3, 2e-3, .01})
      t.mean(fmt::format("N38-furnace-{:g}-{}", alpha, d == Microfacet::ggx ? "ggx" : "beckmann"),
             "N33 N34 N38",
             "A white metal this smooth in a white sky: masking takes less than alpha^2 of the light.",
             [=] { return in_white(sheet(30, [=](SceneKit& k) { return rough_mirror(k, alpha, d); })); },
             grey(1), {.band = .002, .slack = alpha * alpha});
  t.mean("N38-furnace-1", "N38 7.6g",
         "A white metal of roughness 1 from above, scattered once: 1 - ln 2 (height-correlated GGX).",
         [] { return in_white(sheet(0, [](SceneKit& k) { return rough_mirror(k, 1); })); },
         grey(1 - std::log(2.)), {.band = .003});
  for (const double degrees : {89., 89.99, 89.9999})
    t.exact(fmt::format("N35-grazing-{:g}", degrees), "N35", "A perfect mirror at a grazing angle: 1.",
            [=](const Bench& b) {
              return every_value(b, in_white(sheet(degrees, [](SceneKit& k) { return k.mirror(); })), 16,
                                 grey(1), 1e-6);
            });
  t.exact("N35-grazing-rough", "N35",
          "A rough white metal at a grazing angle: healthy, and not more than it gets.",
          [](const Bench& b) -> Figure {
            const auto p = shoot(in_white(sheet(89.99, [](SceneKit& k) { return rough_mirror(k, .3); })), 256,
                                 b.seed, b.threads);
            if (!p) return {.why = p.error().message};
            double mean = 0;
            const auto n = static_cast<std::size_t>(p->size.width) * static_cast<std::size_t>(p->size.height);
            for (std::size_t i = 0; i < n; ++i) mean += p->mean(i, 1) / static_cast<double>(n);
            return {.expected = .5,
                    .got = mean,
                    .tolerance = .5 + 1e-5,
                    .unhealthy = p->health.nonfinite + p->health.negative};
          });
}

void indices(Table& t) {
  for (const double n : {1.1, 1.5, 2.4, .7})
    t.exact(fmt::format("N64-glass-sphere-{:g}", n), "N64 N36",
            "Clear glass in a white sky is white in every sample.", [=](const Bench& b) {
              SceneKit kit;
              kit.shape(SphereShape{}, {}, kit.glass(n));
              kit.environment();
              kit.look({0, -5, .4}, {0, 0, 0}, 24);
              return every_value(b, kit, 64, grey(1), 2e-5);
            });
  t.same(
      "N36-index-matched", "N36", "Glass of its surroundings' index is not there.",
      [] {
        SceneKit kit;
        kit.shape(SphereShape{}, {}, kit.glass(1));
        return before_a_wall(kit);
      },
      [] { return before_a_wall(SceneKit()); }, {.band = .003, .channels = true});
  t.exact("N36-conductor-of-air", "N36", "A metal of index 1 + 0i reflects nothing.", [](const Bench& b) {
    return every_value(b,
                       in_white(sheet(40,
                                      [](SceneKit& k) {
                                        return k.bsdf(ConductorBsdf{{1, 1, 1}, {0, 0, 0}, k.texture(rgb(1))});
                                      })),
                       16, grey(0), 1e-6);
  });
  t.exact("N36-conductor-of-nothing", "N36", "A metal of index 0 + 0i reflects all.", [](const Bench& b) {
    return every_value(b,
                       in_white(sheet(40,
                                      [](SceneKit& k) {
                                        return k.bsdf(ConductorBsdf{{0, 0, 0}, {0, 0, 0}, k.texture(rgb(1))});
                                      })),
                       16, grey(1), 1e-6);
  });
  t.exact("N36-fresnel-normal", "N36 7.6g",
          "Glass of 1.5 reflects .04 of the light straight on: seen before black.", [](const Bench& b) {
            SceneKit kit = sheet(0, [](SceneKit& k) {
              return k.bsdf(PlasticBsdf{1.5, 1, false, k.texture(rgb(0)), k.texture(rgb(1))});
            });
            return every_value(b, in_white(kit), 16, grey(.04), 1e-6);
          });
}

}  // namespace

void add_surfaces(Table& t) {
  microfacets(t);
  indices(t);
}

}  // namespace ls::cases

// Surfaces with extreme parameters: perfectly smooth, very rough, seen at grazing angles, index-matched,
// transparent.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

BsdfIndex rough_mirror(SceneBuilder& builder, double alpha, Microfacet d = Microfacet::ggx) {
  const TextureIndex a = builder.texture(rgb(alpha));
  return builder.bsdf(RoughConductorBsdf{d, a, a, {0, 0, 0}, {1, 1, 1}, builder.texture(rgb(1))});
}

// A large rectangle in the plane z = 0 with the material that `make` returns, seen from `degrees` off its
// normal. The callers add the lights or walls whose light it reflects or transmits.
SceneBuilder sheet(double degrees, auto make) {
  SceneBuilder builder;
  builder.shape(RectangleShape{}, scale(1e3), make(builder));
  const double a = degrees * kPi / 180;
  builder.look({5 * std::sin(a), 0, 5 * std::cos(a)}, {0, 0, 0}, 1e-3, {0, 1, 0});
  return builder;
}
// Adds an environment and, behind the scene's shapes, a checkered wall of two colours, so that a ray with a
// wrong direction changes the image.
SceneBuilder before_a_wall(SceneBuilder builder) {
  const TextureIndex dark = builder.texture(rgb(.25)), bright = builder.texture({1, .75, .5});
  const TextureIndex board = SceneBuilder::push<TextureTag>(
      builder.scene.textures, CheckerboardTexture{dark, bright, {{8, 0, 0, 0, 8, 0, 0, 0, 1}}});
  builder.shape(RectangleShape{}, translate({0, 0, -3}) * scale(6), builder.diffuse(0)).emitter =
      AreaEmitter{board};
  builder.environment(.125);
  builder.look({1, .5, 6}, {0, 0, 0}, 30, {0, 1, 0});
  return builder;
}

// Returns the reflectance of a white GGX metal of roughness alpha in a white sky, seen from this many degrees
// off its normal. It is the mean, over the facet normals that are visible from this direction (Heitz 2018),
// of the shadowing of the reflected ray, 1 / (1 + lambda). It is computed by the midpoint rule. Masking and
// shadowing are separable, as in Mitsuba.
double unmasked_at(double degrees, double alpha) {
  constexpr int kSteps = 400;
  const double a = degrees * kPi / 180, l = std::hypot(alpha * std::sin(a), std::cos(a));
  const double sine = alpha * std::sin(a) / l, cosine = std::cos(a) / l, tilt = (1 + cosine) / 2;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const double r = std::sqrt((i + .5) / kSteps), p = 2 * kPi * (j + .5) / kSteps;
      const double y = r * std::cos(p), q = (1 - tilt) * std::sqrt(1 - y * y) + tilt * r * std::sin(p),
                   n = std::sqrt(std::max(0., 1 - y * y - q * q));
      const Vec3 h = unit({alpha * (n * sine - q * cosine), alpha * y, n * cosine + q * sine});
      const double twice = 2 * (std::sin(a) * h[0] + std::cos(a) * h[2]);
      const Vec3 w{twice * h[0] - std::sin(a), twice * h[1], twice * h[2] - std::cos(a)};
      const double slope2 = (w[0] * w[0] + w[1] * w[1]) / (w[2] * w[2]);
      if (w[2] > 0) sum += 2 / (1 + std::sqrt(1 + alpha * alpha * slope2));
    }
  return sum / (kSteps * kSteps);
}

void microfacets(Table& t) {
  t.exact(
      "N33-alpha-0", "N33", "A metal without roughness, and one of 5e-4, are the smooth metal, bit for bit.",
      [](const Bench& b) {
        const auto ball = [](auto make) {
          SceneBuilder builder;
          builder.shape(SphereShape{}, {}, make(builder));
          return before_a_wall(builder);
        };
        const SceneBuilder smooth = ball([](SceneBuilder& k) {
          return k.bsdf(ConductorBsdf{{0, 0, 0}, {1, 1, 1}, k.texture(rgb(1))});
        });
        Figure all = same_bits(b, ball([](SceneBuilder& k) { return rough_mirror(k, 0); }), smooth, 16);
        all.got += same_bits(b, ball([](SceneBuilder& k) { return rough_mirror(k, 5e-4); }), smooth, 16).got;
        return all;
      });
  t.exact("N33-principled-roughness-0", "N33",
          "A principled metal without roughness is one of alpha .001, roughness .0316, bit for bit.",
          [](const Bench& b) {
            const auto ball = [](double roughness) {
              SceneBuilder builder;
              const TextureIndex zero = builder.texture(rgb(0)), one = builder.texture(rgb(1)),
                                 rough = builder.texture(rgb(roughness));
              builder.shape(SphereShape{}, {},
                            builder.bsdf(PrincipledBsdf{
                                one, rough, zero, one, {}, 1.5, zero, zero, zero, zero, zero, zero}));
              return before_a_wall(builder);
            };
            Figure f = same_bits(b, ball(0), ball(.0316), 16);
            if (same_bits(b, ball(0), ball(.05), 16).got == 0)
              f.why = "nor does a roughness above it change a bit";
            return f;
          });
  for (const auto d : {Microfacet::ggx, Microfacet::beckmann})
    for (const double alpha : {1e-3, 2e-3, .01})
      t.mean(fmt::format("N38-furnace-{:g}-{}", alpha, d == Microfacet::ggx ? "ggx" : "beckmann"),
             "N33 N34 N38",
             "A white metal this smooth in a white sky: masking takes less than alpha^2 of the light.",
             [=] { return in_white(sheet(30, [=](SceneBuilder& k) { return rough_mirror(k, alpha, d); })); },
             grey(1), {.band = .002, .slack = alpha * alpha});
  t.mean(
      "N38-furnace-1", "N38 7.6g",
      "A white metal of roughness 1 from above, scattered once: 1 - ln 2 (GGX, where one way masks nothing).",
      [] { return in_white(sheet(0, [](SceneBuilder& k) { return rough_mirror(k, 1); })); },
      grey(1 - std::log(2.)), {.band = .003});
  for (const double degrees : {89., 89.99, 89.9999})
    t.exact(fmt::format("N35-grazing-{:g}", degrees), "N35", "A perfect mirror at a grazing angle: 1.",
            [=](const Bench& b) {
              return every_value(b, in_white(sheet(degrees, [](SceneBuilder& k) { return k.mirror(); })), 16,
                                 grey(1), 1e-6);
            });
  for (const double alpha : {.1, .3})
    t.mean(fmt::format("N35-grazing-rough-{:g}", alpha), "N35",
           "A rough white metal at 89.99 degrees: what facets leave of a white sky, by quadrature.",
           [=] { return in_white(sheet(89.99, [=](SceneBuilder& k) { return rough_mirror(k, alpha); })); },
           // The answer comes from the midpoint rule, which is accurate to 2e-5 here, since the integrand has
           // a square root at the rim of its domain.
           grey(unmasked_at(89.99, alpha)), {.slack = 2e-5});
}

void indices(Table& t) {
  for (const double n : {1.1, 1.5, 2.4, .7})
    t.exact(fmt::format("N64-glass-sphere-{:g}", n), "N64 N36",
            "Clear glass in a white sky is white in every sample.", [=](const Bench& b) {
              SceneBuilder builder;
              builder.shape(SphereShape{}, {}, builder.glass(n));
              builder.environment();
              builder.look({0, -5, .4}, {0, 0, 0}, 24);
              return every_value(b, builder, 64, grey(1), 2e-5);
            });
  t.same(
      "N36-index-matched", "N36", "Glass of its surroundings' index is not there.",
      [] {
        SceneBuilder builder;
        builder.shape(SphereShape{}, {}, builder.glass(1));
        return before_a_wall(builder);
      },
      [] { return before_a_wall(SceneBuilder()); }, {.band = .003, .channels = true});
  const auto conductor = [&](const char* id, const char* about, double eta, double expected) {
    t.exact(id, "N36", about, [=](const Bench& b) {
      const auto metal = [=](SceneBuilder& k) {
        return k.bsdf(ConductorBsdf{rgb(eta), rgb(0), k.texture(rgb(1))});
      };
      return every_value(b, in_white(sheet(40, metal)), 16, grey(expected), 1e-6);
    });
  };
  conductor("N36-conductor-of-air", "A metal of index 1 + 0i reflects nothing.", 1, 0);
  conductor("N36-conductor-of-nothing", "A metal of index 0 + 0i reflects all.", 0, 1);
  t.exact("N36-fresnel-normal", "N36 7.6g",
          "Glass of 1.5 reflects .04 of the light straight on: seen before black.", [](const Bench& b) {
            SceneBuilder builder = sheet(0, [](SceneBuilder& k) {
              return k.bsdf(PlasticBsdf{1.5, 1, false, k.texture(rgb(0)), k.texture(rgb(1))});
            });
            return every_value(b, in_white(builder), 16, grey(.04), 1e-6);
          });
}

BsdfIndex leaf(SceneBuilder& builder, const Rgb& reflectance, const Rgb& transmittance) {
  return builder.bsdf(DiffuseTransmissionBsdf{builder.texture(reflectance), builder.texture(transmittance)});
}
BsdfIndex pane(SceneBuilder& builder, double alpha, bool multiple_scattering = false) {
  const TextureIndex a = builder.texture(rgb(alpha)), white = builder.texture(rgb(1));
  return builder.bsdf(
      RoughThinDielectricBsdf{Microfacet::ggx, a, a, 1.5, 1, white, white, multiple_scattering});
}

void diffuse_sheets(Table& t) {
  t.exact("N64-leaf-in-white", "N64 7.6c",
          "A grey sheet that sends on all light, in a white sky: 1 in every sample.", [](const Bench& b) {
            return every_value(
                b, in_white(sheet(30, [](SceneBuilder& k) { return leaf(k, rgb(.25), rgb(.75)); })), 64,
                grey(1), 2e-6);
          });
  t.mean(
      "N64-coloured-leaf-in-white", "N64 7.6c",
      "A sheet that reflects one colour and lets the rest through is as bright as a white sky.",
      [] {
        return in_white(sheet(30, [](SceneBuilder& k) { return leaf(k, {.125, .75, .5}, {.875, .25, .5}); }));
      },
      grey(1), {.channels = true});
  // A lamp of intensity 3 at distance 2 gives the irradiance E = 3/4. The radiance of the sheet, of
  // reflectance R and transmittance T, is R E / pi on the side of the lamp and T E / pi on the other.
  for (const bool behind : {false, true})
    t.exact(behind ? "7.6g-leaf-before-a-lamp" : "7.6g-leaf-under-a-lamp", "7.6g",
            behind ? "A leaf with a point light behind it: T E / pi in every sample."
                   : "A leaf with a point light before it: R E / pi in every sample.",
            [behind](const Bench& b) {
              SceneBuilder builder = sheet(40, [](SceneBuilder& k) { return leaf(k, rgb(.25), rgb(.625)); });
              builder.scene.emitters.push_back(PointEmitter{{0, 0, behind ? -2. : 2.}, rgb(3)});
              // The frame shows a part of the sheet that is about 1e-4 wide. Over it, the cosine and the
              // distance to the lamp vary by about 1e-9; float32 rounding is about 1e-6.
              return every_value(b, builder, 4, grey((behind ? .625 : .25) * .75 / kPi), 1e-5);
            });
  // A lamp in the middle of a ball of radius 1 lights the wall of the ball through fog that absorbs. The wall
  // transmits T and reflects nothing, so its radiance outside is T / pi times the irradiance of the wall from
  // inside.
  t.exact("7.6g-lampshade-full-of-smoke", "7.6g",
          "A ball of paper around a lamp in smoke that absorbs: T I e^-sigma / pi from outside, in every "
          "sample.",
          [](const Bench& b) {
            SceneBuilder builder;
            builder.container(SphereShape{}, {}, leaf(builder, rgb(0), rgb(.5)),
                              builder.homogeneous(rgb(.75), rgb(0)));
            builder.scene.emitters.push_back(PointEmitter{{0, 0, 0}, rgb(2)});
            builder.look({0, -5, 0}, {0, 0, 0}, 10);
            return every_value(b, builder, 4, grey(.5 * 2 * std::exp(-.75) / kPi), 1e-5);
          });
}

void rough_sheets(Table& t) {
  for (const double alpha : {.1, .5, 1.})
    t.mean(fmt::format("N64-rough-sheet-in-white-{:g}", alpha), "N64 N38 7.6c",
           "A sheet of clear rough glass that loses nothing is as bright as a white sky.",
           [=] { return in_white(sheet(30, [=](SceneBuilder& k) { return pane(k, alpha, true); })); },
           // The slack is kEnergyTolerance, the error of the energy tables
           // (worker/render/bsdf/microfacet_tables.h).
           grey(1), {.slack = 5e-4});
  for (const double alpha : {.3, 1.})
    t.mean(fmt::format("N38-rough-sheet-{:g}", alpha), "N38",
           "A sheet of clear rough glass, scattered once: what a rough white metal leaves of a white sky, by "
           "quadrature.",
           [=] { return in_white(sheet(30, [=](SceneBuilder& k) { return pane(k, alpha); })); },
           // The slack is the error of the midpoint rule, as in N35-grazing-rough.
           grey(unmasked_at(30, alpha)), {.slack = 2e-5});
  t.exact("N33-rough-sheet-alpha-0", "N33",
          "A rough sheet of roughness 5e-4 is the smooth sheet, bit for bit.", [](const Bench& b) {
            const SceneBuilder smooth = before_a_wall(sheet(0, [](SceneBuilder& k) {
              const TextureIndex white = k.texture(rgb(1));
              return k.bsdf(ThinDielectricBsdf{1.5, 1, white, white});
            }));
            return same_bits(b, before_a_wall(sheet(0, [](SceneBuilder& k) { return pane(k, 5e-4); })),
                             smooth, 16);
          });
}

BsdfIndex coated_metal(SceneBuilder& builder, double ior, double coat_alpha, double alpha, const Rgb& eta,
                       const Rgb& k) {
  return builder.bsdf(CoatedConductorBsdf{ior, 1, coat_alpha, alpha, alpha, eta, k, builder.texture(rgb(1))});
}

// A coat of index 1.5 over a metal of index 3 + 4i, at normal incidence. The coat reflects F = 0.04 and
// transmits T = 1 - F; the metal below it has the relative index (3 + 4i) / 1.5 = a + b i and reflects R.
void coated_metals(Table& t) {
  constexpr double F = .04, a = 2, b = 8. / 3;
  constexpr double R = ((a - 1) * (a - 1) + b * b) / ((a + 1) * (a + 1) + b * b);
  const Rgb eta = rgb(3), k = rgb(4), white_eta = rgb(0), white_k = rgb(1);
  t.exact("N36-coated-metal", "N36 7.6g",
          "A smooth metal under a smooth coat, from above in a white sky: F + T^2 R / (1 - F R).",
          [=](const Bench& b) {
            return every_value(
                b, in_white(sheet(0, [=](SceneBuilder& s) { return coated_metal(s, 1.5, 0, 0, eta, k); })),
                16, grey(F + (1 - F) * (1 - F) * R / (1 - F * R)), 1e-6);
          });
  for (const double degrees : {30., 89.})
    t.exact(
        fmt::format("N64-coated-metal-white-{:g}", degrees), "N64 N35",
        "A metal that absorbs nothing under a smooth coat, in a white sky: 1.", [=](const Bench& b) {
          return every_value(
              b,
              in_white(sheet(
                  degrees, [=](SceneBuilder& s) { return coated_metal(s, 1.5, 0, 0, white_eta, white_k); })),
              16, grey(1), 1e-6);
        });
  // A lamp of intensity 3 at distance 2 gives the irradiance 3/4. Camera and lamp are in the same direction.
  // In this direction the BSDF of the metal, whose facets have alpha .02, is R D / 4 with D = 1 / (pi
  // alpha^2). The coat multiplies it by T^2 / (n^2 (1 - F R)), with n = 1.5 its index. Light that the coat
  // reflects back to the metal and that leaves later adds a share of 3e-6.
  t.exact(
      "7.6g-coated-metal-under-a-lamp", "7.6g",
      "A rough metal under a smooth coat, with a lamp behind the viewer: the facets' value through the coat.",
      [=](const Bench& b) {
        SceneBuilder builder =
            sheet(0, [=](SceneBuilder& s) { return coated_metal(s, 1.5, 0, .02, eta, k); });
        builder.scene.emitters.push_back(PointEmitter{{0, 0, 2}, rgb(3)});
        return every_value(b, builder, 4,
                           grey((1 - F) * (1 - F) / (2.25 * (1 - F * R)) * R / (4 * kPi * 4e-4) * .75), 3e-5);
      });
  t.exact("N36-coat-of-air", "N36", "A coat of its surroundings' index is not there, bit for bit.",
          [=](const Bench& b) {
            const SceneBuilder metal =
                before_a_wall(sheet(0, [](SceneBuilder& s) { return rough_mirror(s, .2); }));
            return same_bits(
                b,
                before_a_wall(sheet(
                    0, [=](SceneBuilder& s) { return coated_metal(s, 1, .3, .2, white_eta, white_k); })),
                metal, 16);
          });
  t.exact("N33-coated-metal-alpha-0", "N33", "A coat and a metal of roughness 5e-4 are smooth, bit for bit.",
          [=](const Bench& b) {
            const auto scene = [=](double alpha) {
              return before_a_wall(
                  sheet(0, [=](SceneBuilder& s) { return coated_metal(s, 1.5, alpha, alpha, eta, k); }));
            };
            return same_bits(b, scene(5e-4), scene(0), 16);
          });
}

}  // namespace

void add_surfaces(Table& t) {
  microfacets(t);
  indices(t);
  diffuse_sheets(t);
  rough_sheets(t);
  coated_metals(t);
}

}  // namespace ls::cases

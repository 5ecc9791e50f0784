// Compares our materials with values of Mitsuba 3, in a table that make_oracle.py wrote.
#include <gmock/gmock.h>

#include <charconv>
#include <map>
#include <string_view>

#include "tests/unit/bsdf/materials.h"

namespace ls::render::test {
namespace {

struct OracleRow {
  std::string_view material;
  double wo[3], wi[3], f_cos[3];
};
constexpr OracleRow kOracle[] = {
#include "tests/unit/bsdf/oracle_values.inc"
};

std::map<std::string, Scene> materials() {
  std::map<std::string, Scene> m;
  m["diffuse"] = diffuse({.2, .5, .9});
  m["twosided"] = two_sided(diffuse({.2, .5, .9}));
  for (const auto& [d, name] :
       {std::pair{Microfacet::beckmann, "beckmann"}, std::pair{Microfacet::ggx, "ggx"}}) {
    for (const auto& [a, text] :
         {std::pair{.02, "0.02"}, std::pair{.1, "0.1"}, std::pair{.5, "0.5"}, std::pair{1., "1.0"}})
      m[fmt::format("conductor_{}_{}", name, text)] = rough_metal(d, a, a, kGoldEta, kGoldK);
    m[fmt::format("conductor_{}_aniso", name)] = rough_metal(d, .3, .05, kGoldEta, kGoldK, {.9, .8, .7});
    for (const double a : {.05, .1, .3, .7})
      m[fmt::format("plastic_{}_{}", name, a)] = rough_plastic(d, a, 1.49, 1.000277, false, {.1, .27, .9});
    m[fmt::format("plastic_{}_nonlinear", name)] =
        rough_plastic(d, .2, 1.9, 1, true, {.1, .27, .9}, {1, .5, .25});
    for (const double a : {.1, .5})
      m[fmt::format("glass_{}_{}", name, a)] = rough_glass(d, a, a, 1.5, 1, {.9, .8, .7}, {.5, .6, .7});
    m[fmt::format("glass_{}_aniso", name)] = rough_glass(d, .4, .1, 1.333, 1);
  }
  for (const double ior : {1.49, 1.9})
    m[fmt::format("smooth_plastic_{}", ior)] = plastic(ior, 1, false, {.1, .27, .9});
  m["smooth_plastic_nonlinear"] = plastic(1.49, 1, true, {.1, .27, .9});
  m["principled"] = principled({});
  m["principled_metal"] = principled(metal_values());
  m["principled_cloth"] = principled(cloth_values());
  m["principled_thin"] = principled(
      {.roughness = .4, .metallic = .2, .eta = .8, .spec_tint = .5, .clearcoat = 1, .clearcoat_gloss = .9});
  m["principled_glass"] = principled(glass_values());
  m["principled_glass_all"] = principled(all_values());
  for (const bool plain : {false, true}) {
    const Scene gold = rough_metal(Microfacet::ggx, .4, .15, kGoldEta, kGoldK);
    m[plain ? "normalmap_plain" : "normalmap"] = mapped(gold, {.85, .35, .75}, plain);
    m[plain ? "bumpmap_plain" : "bumpmap"] = bumped(gold, .7, plain);
  }
  m["mask"] = masked(diffuse({.2, .5, .9}), .3);
  m["blend"] = blend(diffuse({.2, .5, .9}), rough_metal(Microfacet::ggx, .3, .3, kGoldEta, kGoldK), .25);
  return m;
}

V3 vec(const double (&v)[3]) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

// Both renderers compute in float32. The half vector is accurate to about 1e-7. With the exponent e = (tan /
// alpha)^2 this is a relative error of 2 sqrt(e) 1e-7 / alpha of the lobe: below 1e-4 for alpha >= .02 and e
// < 87. Rough plastic: 1e-3, because Mitsuba integrates its tables in float32 with fewer nodes. Smooth
// plastic: 2e-3, because Mitsuba's internal reflectance is a fit with an error of 1e-3 (ours is the
// integral), which is divided by 1 - r, about .4. principled_thin: 1e-3, because Mitsuba subtracts the
// squared cosine from 1, where alpha^2 = 1e-4 remains, with an error of 6e-8 / 1e-4.
TEST(MitsubaValues, EveryMaterialAgreesAtEveryDirection) {
  std::map<std::string, std::unique_ptr<Bench>> benches;
  for (auto& [name, scene] : materials()) benches[name] = bench(scene, oracle_heights());
  std::map<std::string, int> rows;
  std::map<std::string, double> worst;
  for (const OracleRow& row : kOracle) {
    const std::string name(row.material);
    ASSERT_TRUE(benches.contains(name)) << name;
    ++rows[name];
    const double tolerance = name.starts_with("smooth_plastic")                         ? 2e-3
                             : name.starts_with("plastic") || name == "principled_thin" ? 1e-3
                                                                                        : 1e-4;
    // Refraction is proportional to dot(wo, m), which has a rounding error of 6e-8 and is about as small for
    // facets seen edge on.
    const double least = name.starts_with("principled_glass") ? 1e-9 : 1e-20;

    const BsdfEval e = benches[name]->eval(vec(row.wo), vec(row.wi));

    for (int c = 0; c < 3; ++c) {
      const double error = std::abs(e.f_cos[c] - row.f_cos[c]);
      worst[name] = std::max(worst[name], row.f_cos[c] > 1e-20 ? error / row.f_cos[c] : 0.);
      EXPECT_LE(error, tolerance * row.f_cos[c] + least)
          << name << " channel " << c << ": " << e.f_cos[c] << " for " << row.f_cos[c] << " at wo.z "
          << row.wo[2] << ", wi.z " << row.wi[2];
    }
  }
  for (const auto& [name, bench] : benches) EXPECT_GE(rows[name], 15) << name;
  for (const auto& [name, w] : worst) RecordProperty(name, fmt::format("{:.2e}", w));
}

}  // namespace
}  // namespace ls::render::test

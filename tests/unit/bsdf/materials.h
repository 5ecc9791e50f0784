// Scenes with one material each, for the tests of this folder.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <memory>
#include <random>
#include <string>

#include "core/scene/schema/traits.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/material_builder.h"

namespace ls::render::test {

struct Bench {
  Scene scene;
  TextureTable textures;
  BsdfTable bsdfs;
  BsdfIndex bsdf;
  UvPoint at{{.4f, .55f}, {2, 0, 0}, {-.5f, 1.5f, 0}};  // the same as in make_oracle.py

  BsdfEval eval(const V3& wo, const V3& wi) const { return bsdfs.eval(bsdf, at, wo, wi); }
  std::optional<BsdfSample> sample(const V3& wo, float u_lobe, const V2& u) const {
    return bsdfs.sample(bsdf, at, wo, u_lobe, u);
  }
};

inline TextureIndex texture(Scene& s, const Rgb& value) {
  s.textures.push_back(ConstantTexture{value});
  return {static_cast<std::uint32_t>(s.textures.size() - 1)};
}
inline TextureIndex texture(Scene& s, double value) { return texture(s, Rgb{value, value, value}); }

inline BsdfIndex add(Scene& s, const Bsdf& b) {
  s.bsdfs.push_back(b);
  return {static_cast<std::uint32_t>(s.bsdfs.size() - 1)};
}

// The scene, ready to evaluate its last material. `image` is the content of all its image files.
inline std::unique_ptr<Bench> bench(Scene scene, const ImageData& image = {}) {
  auto b = std::make_unique<Bench>();
  b->scene = std::move(scene);
  auto textures = TextureTable::build(b->scene, [&](const Asset&) -> Result<ImageData> {
    if (image.channels == 0) return fail(Errc::not_found, "no file");
    return image;
  });
  EXPECT_TRUE(textures.has_value()) << textures.error().message;
  b->textures = std::move(*textures);
  auto bsdfs = BsdfTable::build(b->scene, b->textures);
  EXPECT_TRUE(bsdfs.has_value()) << bsdfs.error().message;
  b->bsdfs = std::move(*bsdfs);
  b->bsdf = {static_cast<std::uint32_t>(b->scene.bsdfs.size() - 1)};
  return b;
}

// The material with compensation for multiple scattering (Bsdf::multiple_scattering).
inline Scene with_compensation(Scene s) {
  std::visit(
      [](auto& b) {
        if constexpr (requires { b.multiple_scattering; }) b.multiple_scattering = true;
      },
      s.bsdfs.back());
  return s;
}

// More materials like that of `scene` than a scene may have tables (MaterialBuilder::kMostTables): they are
// accepted because equal materials share theirs, and refused if each had its own.
inline void expect_equal_ones_share_tables(Scene scene) {
  scene.bsdfs.resize(render::MaterialBuilder::kMostTables + 1, scene.bsdfs[0]);
  const auto textures = TextureTable::build(scene, {});
  ASSERT_TRUE(textures);
  const auto table = BsdfTable::build(scene, *textures);
  EXPECT_TRUE(table) << table.error().message;
}

// True if light may pass straight through, so that shadow rays must ask the material.
inline bool passes_light(const Bench& b) { return scene::bsdf_traits(b.scene)->at(b.bsdf.value).passes; }

inline const Rgb kGoldEta{.14, .37, 1.44}, kGoldK{3.98, 2.38, 1.60};

inline Scene rough_metal(Microfacet d, double au, double av, const Rgb& eta, const Rgb& k,
                         const Rgb& tint = {1, 1, 1}) {
  Scene s;
  add(s, RoughConductorBsdf{d, texture(s, au), texture(s, av), eta, k, texture(s, tint)});
  return s;
}
inline Scene rough_plastic(Microfacet d, double alpha, double int_ior, double ext_ior, bool nonlinear,
                           const Rgb& diffuse, const Rgb& tint = {1, 1, 1}) {
  Scene s;
  add(s, RoughPlasticBsdf{d, alpha, int_ior, ext_ior, nonlinear, texture(s, diffuse), texture(s, tint)});
  return s;
}
inline Scene diffuse(const Rgb& reflectance) {
  Scene s;
  add(s, DiffuseBsdf{texture(s, reflectance)});
  return s;
}
inline Scene glass(double int_ior, double ext_ior) {
  Scene s;
  const TextureIndex white = texture(s, 1);
  add(s, DielectricBsdf{int_ior, ext_ior, white, white});
  return s;
}

inline Scene plastic(double int_ior, double ext_ior, bool nonlinear, const Rgb& diffuse,
                     const Rgb& tint = {1, 1, 1}) {
  Scene s;
  add(s, PlasticBsdf{int_ior, ext_ior, nonlinear, texture(s, diffuse), texture(s, tint)});
  return s;
}
inline Scene rough_glass(Microfacet d, double au, double av, double int_ior, double ext_ior,
                         const Rgb& reflectance = {1, 1, 1}, const Rgb& transmittance = {1, 1, 1}) {
  Scene s;
  add(s, RoughDielectricBsdf{d, texture(s, au), texture(s, av), int_ior, ext_ior, texture(s, reflectance),
                             texture(s, transmittance)});
  return s;
}
inline Scene thin_glass(double ior, const Rgb& reflectance = {1, 1, 1},
                        const Rgb& transmittance = {1, 1, 1}) {
  Scene s;
  add(s, ThinDielectricBsdf{ior, 1, texture(s, reflectance), texture(s, transmittance)});
  return s;
}
inline Scene coated(double coat, double au, double av, const Rgb& eta, const Rgb& k, double ior = 1.5,
                    const Rgb& tint = {1, 1, 1}) {
  Scene s;
  add(s, CoatedConductorBsdf{ior, 1, coat, au, av, eta, k, texture(s, tint)});
  return s;
}
inline Scene leaf(const Rgb& reflectance, const Rgb& transmittance) {
  Scene s;
  add(s, DiffuseTransmissionBsdf{texture(s, reflectance), texture(s, transmittance)});
  return s;
}
inline Scene rough_sheet(Microfacet d, double au, double av, double ior, const Rgb& reflectance = {1, 1, 1},
                         const Rgb& transmittance = {1, 1, 1}) {
  Scene s;
  add(s, RoughThinDielectricBsdf{d, texture(s, au), texture(s, av), ior, 1, texture(s, reflectance),
                                 texture(s, transmittance)});
  return s;
}
// The parameters of the principled material.
struct PrincipledValues {
  double roughness = .5, anisotropic = 0, metallic = 0, spec_trans = 0, eta = 1.5, spec_tint = 0, sheen = 0,
         sheen_tint = 0, flatness = 0, clearcoat = 0, clearcoat_gloss = 0;
};
inline double eta_of_specular(double specular) { return 2 / (1 - std::sqrt(.08 * specular)) - 1; }
inline Scene principled(const PrincipledValues& v, const Rgb& base = {.8, .4, .1}) {
  Scene s;
  PrincipledBsdf b;
  b.base_color = texture(s, base);
  b.roughness = texture(s, v.roughness);
  b.anisotropic = texture(s, v.anisotropic);
  b.metallic = texture(s, v.metallic);
  if (v.spec_trans > 0) b.spec_trans = texture(s, v.spec_trans);
  b.eta = v.eta;
  b.spec_tint = texture(s, v.spec_tint);
  b.sheen = texture(s, v.sheen);
  b.sheen_tint = texture(s, v.sheen_tint);
  b.flatness = texture(s, v.flatness);
  b.clearcoat = texture(s, v.clearcoat);
  b.clearcoat_gloss = texture(s, v.clearcoat_gloss);
  add(s, b);
  return s;
}
inline PrincipledValues metal_values() {
  return {.roughness = .3, .anisotropic = .5, .metallic = .7, .eta = eta_of_specular(.8), .spec_tint = .4};
}
inline PrincipledValues cloth_values() {
  return {
      .roughness = .7, .sheen = .8, .sheen_tint = .5, .flatness = .6, .clearcoat = .7, .clearcoat_gloss = .3};
}
inline PrincipledValues glass_values() { return {.roughness = .5, .spec_trans = .9, .eta = 1.4}; }
inline PrincipledValues all_values() {
  return {.roughness = .45,
          .anisotropic = .8,
          .metallic = .3,
          .spec_trans = .4,
          .eta = eta_of_specular(.3),
          .spec_tint = .6,
          .sheen = .2,
          .sheen_tint = 1,
          .flatness = .3,
          .clearcoat = .5,
          .clearcoat_gloss = .1};
}
// Of the last material, and of the last texture.
inline BsdfIndex last(const Scene& s) { return {static_cast<std::uint32_t>(s.bsdfs.size() - 1)}; }
inline TextureIndex last_texture(const Scene& s) {
  return {static_cast<std::uint32_t>(s.textures.size() - 1)};
}
inline Scene masked(Scene s, double opacity) {
  add(s, MaskBsdf{texture(s, opacity), last(s)});
  return s;
}
inline Scene two_sided(Scene s) {
  add(s, TwoSidedBsdf{last(s), last(s)});
  return s;
}
// By a constant normal, without the additions of Mitsuba 3.7 (flipping, shadows).
inline Scene mapped(Scene s, const Rgb& normal, bool plain) {
  add(s, NormalMapBsdf{texture(s, normal), last(s), !plain, !plain});
  return s;
}
inline Scene turned(Scene s, const V3& n) {
  return mapped(std::move(s), Rgb{.5 + .5 * n.x, .5 + .5 * n.y, .5 + .5 * n.z}, true);
}
inline Scene bumped(Scene s, double scale, bool plain) {
  s.assets.push_back({"heights.exr", {}, 0});
  BitmapTexture t;
  t.raw = true;
  s.textures.emplace_back(t);
  add(s, BumpMapBsdf{{static_cast<std::uint32_t>(s.textures.size() - 1)}, scale, last(s), !plain, !plain});
  return s;
}
// Of make_oracle.py.
inline ImageData oracle_heights() {
  ImageData d;
  d.width = 4;
  d.height = 2;
  d.channels = 1;
  d.f32 = {.1f, .4f, .8f, .3f, .2f, .9f, .5f, .6f};
  return d;
}
// The materials of `b` go behind those of `a`; those that contain others are not moved along.
inline Scene blend(Scene a, const Scene& b, double weight) {
  const auto shift = static_cast<std::uint32_t>(a.textures.size());
  const BsdfIndex first = last(a);
  a.textures.insert(a.textures.end(), b.textures.begin(), b.textures.end());
  const auto move = [&](auto&... texture) { ((texture.value += shift), ...); };
  Bsdf second = b.bsdfs.at(0);
  if (auto* m = std::get_if<DiffuseBsdf>(&second)) move(m->reflectance);
  if (auto* m = std::get_if<ConductorBsdf>(&second)) move(m->specular_reflectance);
  if (auto* m = std::get_if<RoughConductorBsdf>(&second))
    move(m->alpha_u, m->alpha_v, m->specular_reflectance);
  if (auto* m = std::get_if<RoughDielectricBsdf>(&second))
    move(m->alpha_u, m->alpha_v, m->specular_reflectance, m->specular_transmittance);
  add(a, second);
  add(a, BlendBsdf{texture(a, weight), first, last(a)});
  return a;
}

inline V3 direction(double cos_theta, double phi) {
  const double sin = std::sqrt(std::max(0., 1 - cos_theta * cos_theta));
  return {static_cast<float>(sin * std::cos(phi)), static_cast<float>(sin * std::sin(phi)),
          static_cast<float>(cos_theta)};
}

// The share of the energy from wo that leaves, and its standard error, estimated by random samples.
struct SampledAlbedo {
  double mean, error;
};
inline SampledAlbedo sampled_albedo(const Bench& b, const V3& wo, int samples, unsigned seed = 3) {
  std::mt19937 rng(seed);
  const auto uniform = [&] { return static_cast<float>(rng() >> 8) * 0x1p-24f; };
  double sum = 0, square = 0;
  for (int i = 0; i < samples; ++i) {
    const float l = uniform(), u = uniform(), v = uniform();
    const auto s = b.sample(wo, l, {u, v});
    const double x = s ? double{s->weight.y} * sqr(double{s->eta}) : 0;
    sum += x;
    square += x * x;
  }
  const double mean = sum / samples;
  return {mean, std::sqrt(std::max(0., square / samples - mean * mean) / samples)};
}

// Expects finite samples and values for extreme directions and random numbers.
inline void expect_finite(const Bench& b, std::initializer_list<double> view_cosines) {
  for (const double mu : view_cosines)
    for (const float u : {0.f, 1e-9f, .5f, 0x1.fffffep-1f})
      for (const float v : {0.f, .25f, .6f, 0x1.fffffep-1f}) {
        const V3 wo = direction(mu, 1);
        const auto s = b.sample(wo, v, {u, v});
        if (!s) continue;
        EXPECT_TRUE(is_finite(s->weight) && is_finite(s->wi) && s->pdf > 0 && std::isfinite(s->pdf)) << mu;
        EXPECT_EQ(s->transmitted, s->wi.z * wo.z < 0) << mu;
        const BsdfEval e = b.eval(wo, s->wi);
        EXPECT_TRUE(is_finite(e.f_cos) && std::isfinite(e.pdf)) << mu;
      }
}

}  // namespace ls::render::test

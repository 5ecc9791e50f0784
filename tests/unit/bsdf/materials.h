// Scenes of one material each, for the tests of this folder.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "worker/render/bsdf/bsdf.h"

namespace ls::render::test {

struct Bench {
  Scene scene;
  TextureTable textures;
  BsdfTable bsdfs;
  BsdfIndex bsdf;

  BsdfEval eval(const V3& wo, const V3& wi) const { return bsdfs.eval(bsdf, {.5f, .5f}, wo, wi); }
  std::optional<BsdfSample> sample(const V3& wo, float u_lobe, const V2& u) const {
    return bsdfs.sample(bsdf, {.5f, .5f}, wo, u_lobe, u);
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

// Ready to evaluate its last material.
inline std::unique_ptr<Bench> bench(Scene scene) {
  auto b = std::make_unique<Bench>();
  b->scene = std::move(scene);
  auto textures =
      TextureTable::build(b->scene, [](const Asset&) { return fail(Errc::not_found, "no file"); });
  EXPECT_TRUE(textures.has_value()) << textures.error().message;
  b->textures = std::move(*textures);
  auto bsdfs = BsdfTable::build(b->scene, b->textures);
  EXPECT_TRUE(bsdfs.has_value()) << bsdfs.error().message;
  b->bsdfs = std::move(*bsdfs);
  b->bsdf = {static_cast<std::uint32_t>(b->scene.bsdfs.size() - 1)};
  return b;
}

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
// Of the last material.
inline BsdfIndex last(const Scene& s) { return {static_cast<std::uint32_t>(s.bsdfs.size() - 1)}; }
inline Scene masked(Scene s, double opacity) {
  add(s, MaskBsdf{texture(s, opacity), last(s)});
  return s;
}
inline Scene two_sided(Scene s) {
  add(s, TwoSidedBsdf{last(s), last(s)});
  return s;
}
// By a constant normal.
inline Scene turned(Scene s, const V3& n) {
  add(s, NormalMapBsdf{texture(s, Rgb{.5 + .5 * n.x, .5 + .5 * n.y, .5 + .5 * n.z}), last(s)});
  return s;
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

}  // namespace ls::render::test

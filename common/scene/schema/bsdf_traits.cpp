#include "common/scene/schema/bsdf_traits.h"

#include <algorithm>

#include "common/base/overloaded.h"
#include "common/scene/limits.h"

namespace ls::scene {

std::array<std::optional<BsdfIndex>, 2> nested_bsdfs(const Bsdf& bsdf) {
  using Nested = std::array<std::optional<BsdfIndex>, 2>;
  return std::visit(overloaded{[](const TwoSidedBsdf& b) {
                                 return Nested{b.front, b.back};
                               },
                               [](const MaskBsdf& b) {
                                 return Nested{b.bsdf, std::nullopt};
                               },
                               [](const NormalMapBsdf& b) {
                                 return Nested{b.bsdf, std::nullopt};
                               },
                               [](const BumpMapBsdf& b) {
                                 return Nested{b.bsdf, std::nullopt};
                               },
                               [](const BlendBsdf& b) {
                                 return Nested{b.first, b.second};
                               },
                               [](const auto&) { return Nested{}; }},
                    bsdf);
}

namespace {

// True if the roughness alpha, which is the mean of the texture's channels, may be kStraightAlpha or less at
// some point. The test is conservative: it is true for every texture that is not constant, and for a constant
// one if any channel is that small.
bool may_be_straight(TextureIndex t, const std::vector<Texture>& textures) {
  if (t.value >= textures.size()) return true;
  const auto* constant = std::get_if<ConstantTexture>(&textures[t.value]);
  return !constant || std::ranges::any_of(constant->value, [](double x) { return x <= kStraightAlpha; });
}

}  // namespace

BsdfTraits traits_of(const Bsdf& bsdf, const std::vector<BsdfTraits>& known,
                     const std::vector<Texture>& textures) {
  BsdfTraits t;
  for (const auto& inner : nested_bsdfs(bsdf)) {
    if (!inner || inner->value >= known.size()) continue;
    const BsdfTraits& i = known[inner->value];
    t.depth = std::max(t.depth, i.depth + 1);
    t.transmits = t.transmits || i.transmits;
    t.passes = t.passes || i.passes;
    t.black_behind = t.black_behind && i.black_behind;
  }
  t.two_sided = std::holds_alternative<TwoSidedBsdf>(bsdf);
  t.passes = t.passes || std::holds_alternative<NullBsdf>(bsdf) || std::holds_alternative<MaskBsdf>(bsdf) ||
             std::holds_alternative<ThinDielectricBsdf>(bsdf);
  const auto* sheet = std::get_if<RoughThinDielectricBsdf>(&bsdf);
  t.passes = t.passes || (sheet && may_be_straight(sheet->alpha_u, textures) &&
                          may_be_straight(sheet->alpha_v, textures));
  const auto* principled = std::get_if<PrincipledBsdf>(&bsdf);
  t.transmits = t.transmits || t.passes || sheet || (principled && principled->spec_trans) ||
                std::holds_alternative<DiffuseTransmissionBsdf>(bsdf) ||
                std::holds_alternative<DielectricBsdf>(bsdf) ||
                std::holds_alternative<RoughDielectricBsdf>(bsdf);
  t.black_behind = t.black_behind && !t.transmits && !t.two_sided;
  return t;
}

// Computes the traits by repeated passes over the list, which may be in any order, until none changes. A
// chain of n nested bsdfs takes n passes. In a cycle the depth grows until it exceeds the limit.
std::optional<std::vector<BsdfTraits>> bsdf_traits(const Scene& scene) {
  for (const Bsdf& b : scene.bsdfs)
    for (const auto& inner : nested_bsdfs(b))
      if (inner && inner->value >= scene.bsdfs.size()) return std::nullopt;
  std::vector<BsdfTraits> traits(scene.bsdfs.size());
  for (int round = 0; round <= kMaxBsdfNesting; ++round) {
    bool changed = false;
    for (std::size_t i = 0; i < traits.size(); ++i) {
      const BsdfTraits t = traits_of(scene.bsdfs[i], traits, scene.textures);
      if (t.depth > kMaxBsdfNesting) return std::nullopt;
      changed |= !(t == traits[i]);
      traits[i] = t;
    }
    if (!changed) return traits;
  }
  return std::nullopt;
}

}  // namespace ls::scene

#include "core/scene/schema/traits.h"

#include <algorithm>

#include "core/scene/limits.h"

namespace ls::scene {

std::array<std::optional<BsdfIndex>, 2> nested_bsdfs(const Bsdf& bsdf) {
  return std::visit(
      [](const auto& b) -> std::array<std::optional<BsdfIndex>, 2> {
        if constexpr (requires { b.front; }) return {b.front, b.back};
        if constexpr (requires { b.first; }) return {b.first, b.second};
        if constexpr (requires { b.bsdf; }) return {b.bsdf, std::nullopt};
        return {};
      },
      bsdf);
}

namespace {

// Returns whether the roughness alpha given by texture t, the mean of its channels, may be at most
// kStraightAlpha at some point. The test is conservative: it returns true for every texture that is not
// constant, and for a constant texture if any of its channels is at most kStraightAlpha.
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

// Computes the traits by passes over the list of bsdfs, which may be in any order, until a pass changes
// nothing. A chain of n nested bsdfs needs at most n passes and one that changes nothing. In a cycle the
// depth grows until it exceeds the limit.
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

namespace {

struct TraitsOfEmitter {
  const std::vector<Texture>& textures;

  bool black(TextureIndex t) const {
    const auto* c = std::get_if<ConstantTexture>(&textures[t.value]);
    return c && all_zero(c->value);
  }

  EmitterTraits operator()(const ConstantEmitter& e) const { return {.dark = all_zero(e.radiance)}; }
  EmitterTraits operator()(const DirectionalEmitter& e) const {
    return {.dark = all_zero(e.irradiance), .delta = !(e.angular_radius > 0)};
  }
  EmitterTraits operator()(const PointEmitter& e) const {
    return {.dark = all_zero(e.intensity), .delta = true, .position = e.position};
  }
  EmitterTraits operator()(const SpotEmitter& e) const {
    return {.dark = all_zero(e.intensity) || (e.texture && black(*e.texture)),
            .delta = true,
            .position = origin_of(e.to_world)};
  }
  EmitterTraits operator()(const EnvmapEmitter& e) const { return {.dark = e.scale == 0}; }
  EmitterTraits operator()(const ProjectorEmitter& e) const {
    return {.dark = e.scale == 0 || black(e.irradiance), .delta = true, .position = origin_of(e.to_world)};
  }
  EmitterTraits operator()(const GoniometricEmitter& e) const {
    return {
        .dark = all_zero(e.intensity) || black(e.texture), .delta = true, .position = origin_of(e.to_world)};
  }
};

}  // namespace

EmitterTraits traits_of(const Emitter& emitter, const std::vector<Texture>& textures) {
  return std::visit(TraitsOfEmitter{textures}, emitter);
}

namespace {

struct TraitsOfMedium {
  const std::vector<Volume>& volumes;

  const ConstVolume* constant(VolumeIndex v) const { return std::get_if<ConstVolume>(&volumes[v.value]); }
  const HeightFogVolume* height_fog(VolumeIndex v) const {
    return std::get_if<HeightFogVolume>(&volumes[v.value]);
  }
  bool zero(VolumeIndex v) const {
    if (const HeightFogVolume* fog = height_fog(v)) return fog->value == 0;
    return constant(v) && all_zero(constant(v)->value);
  }

  MediumTraits operator()(const HomogeneousMedium& m) const {
    Rgb sigma_t = m.sigma_t;
    for (double& x : sigma_t) x *= m.scale;
    MediumTraits t;
    t.extinguishes = !all_zero(sigma_t);
    t.scatters = t.extinguishes && !all_zero(m.albedo);
    t.emits = !all_zero(m.emission) || (t.extinguishes && !all_zero(m.source_radiance));
    t.chromatic = !is_grey(sigma_t);
    return t;
  }
  MediumTraits operator()(const HeterogeneousMedium& m) const {
    MediumTraits t;
    t.extinguishes = m.scale != 0 && !all_zero(m.tint) && !zero(m.sigma_t);
    t.scatters = t.extinguishes && !zero(m.albedo);
    t.emits =
        m.emission_scale != 0 &&
        ((m.emission && !zero(*m.emission)) ||
         (t.extinguishes && ((m.source_radiance && !zero(*m.source_radiance)) || m.temperature.has_value())));
    Rgb sigma_t = m.tint;
    if (const ConstVolume* c = constant(m.sigma_t))
      for (std::size_t i = 0; i < 3; ++i) sigma_t[i] *= c->value[i];
    t.chromatic = !is_grey(sigma_t);
    t.height = height_fog(m.sigma_t) != nullptr;
    t.grids = !t.height;
    t.density_file = std::holds_alternative<GridVolume>(volumes[m.sigma_t.value]);
    return t;
  }
};

}  // namespace

MediumTraits traits_of(const Medium& medium, const std::vector<Volume>& volumes) {
  return std::visit(TraitsOfMedium{volumes}, medium);
}

}  // namespace ls::scene

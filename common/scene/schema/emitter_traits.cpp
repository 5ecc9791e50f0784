#include "common/scene/schema/emitter_traits.h"

namespace ls::scene {
namespace {

Vec3 origin_of(const Transform& t) { return {t.m[3], t.m[7], t.m[11]}; }

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

}  // namespace ls::scene

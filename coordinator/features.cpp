#include "coordinator/features.h"

#include <algorithm>

namespace ls::coordinator {
namespace {

template <class T, class Variants>
bool any(const Variants& all) {
  return std::any_of(all.begin(), all.end(), [](const auto& v) { return std::holds_alternative<T>(v); });
}

bool grey(const Rgb& c) { return c[0] == c[1] && c[1] == c[2]; }

bool has_chromatic_media(const Scene& scene) {
  return std::any_of(scene.media.begin(), scene.media.end(), [](const Medium& medium) {
    const auto* m = std::get_if<HomogeneousMedium>(&medium);
    return m && !grey(m->sigma_t);
  });
}

bool has_glowing_media(const Scene& scene) {
  return std::any_of(scene.media.begin(), scene.media.end(), [](const Medium& medium) {
    if (const auto* m = std::get_if<HomogeneousMedium>(&medium))
      return m->emission != Rgb{} || m->source_radiance != Rgb{};
    const auto& m = std::get<HeterogeneousMedium>(medium);
    return m.emission || m.source_radiance || m.temperature;
  });
}

bool has_meshes(const Scene& scene) {
  return std::any_of(scene.shapes.begin(), scene.shapes.end(),
                     [](const Shape& s) { return std::holds_alternative<MeshShape>(s.geometry); });
}

bool has_area_lights(const Scene& scene) {
  return std::any_of(scene.shapes.begin(), scene.shapes.end(),
                     [](const Shape& s) { return s.emitter.has_value(); });
}

}  // namespace

SceneFeatures features_of(const Scene& scene) {
  SceneFeatures features;
  const auto say = [&](const char* name, bool used) {
    (used ? features.used : features.left_out).emplace_back(name);
  };
  say("surfaces", !scene.shapes.empty());
  say("meshes", has_meshes(scene));
  say("instances of groups", !scene.instances.empty());
  say("homogeneous media", any<HomogeneousMedium>(scene.media));
  say("heterogeneous media", any<HeterogeneousMedium>(scene.media));
  say("chromatic extinction", has_chromatic_media(scene));
  say("light given off by media", has_glowing_media(scene));
  say("volume grids", any<GridVolume>(scene.volumes));
  say("anisotropic phase functions", any<HgPhase>(scene.phases));
  say("camera inside a medium", scene.sensor.medium.has_value());
  say("thin lens", scene.sensor.aperture_radius > 0);
  say("crop of the frame", scene.film.has_crop());
  say("bitmap textures", any<BitmapTexture>(scene.textures));
  say("dielectrics", any<DielectricBsdf>(scene.bsdfs) || any<RoughDielectricBsdf>(scene.bsdfs));
  say("rough surfaces", any<RoughConductorBsdf>(scene.bsdfs) || any<RoughPlasticBsdf>(scene.bsdfs) ||
                            any<RoughDielectricBsdf>(scene.bsdfs));
  say("surfaces that let light pass straight on",
      any<MaskBsdf>(scene.bsdfs) || any<ThinDielectricBsdf>(scene.bsdfs));
  say("normal maps", any<NormalMapBsdf>(scene.bsdfs));
  say("area lights", has_area_lights(scene));
  say("point and spot lights", any<PointEmitter>(scene.emitters) || any<SpotEmitter>(scene.emitters));
  say("directional lights", any<DirectionalEmitter>(scene.emitters));
  say("environment light", any<ConstantEmitter>(scene.emitters) || any<EnvmapEmitter>(scene.emitters));
  return features;
}

}  // namespace ls::coordinator

#include "core/scene/analysis/light_groups.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <string_view>
#include <variant>

#include "core/base/light/light_group.h"

namespace ls::scene {

bool gives_off_light(const Medium& medium) {
  constexpr Rgb kBlack{0, 0, 0};
  if (const auto* m = std::get_if<HomogeneousMedium>(&medium))
    return m->emission != kBlack || m->source_radiance != kBlack;
  const auto& m = std::get<HeterogeneousMedium>(medium);
  return m.emission || m.source_radiance || m.temperature;
}

std::vector<std::string> light_groups_of(const Scene& scene) {
  std::set<std::string_view> names;
  const auto add = [&](const std::string& group) {
    names.insert(group.empty() ? kOtherLightGroup : std::string_view(group));
  };
  for (const Shape& s : scene.shapes)
    if (s.emitter) add(s.emitter->light_group);
  for (const Emitter& e : scene.emitters) std::visit([&](const auto& light) { add(light.light_group); }, e);
  for (const Medium& m : scene.media)
    if (gives_off_light(m)) std::visit([&](const auto& medium) { add(medium.light_group); }, m);
  if (names.empty()) names.insert(kOtherLightGroup);
  return {names.begin(), names.end()};
}

namespace {

Rgb times(const Rgb& a, const Rgb& b) { return {a[0] * b[0], a[1] * b[1], a[2] * b[2]}; }

// Multiplies the light of one light after the other. `wrong` says what cannot be multiplied; empty: nothing.
class Multiplier {
 public:
  Multiplier(const LightMix& mix, Scene& scene) : mix_(mix), scene_(scene) {}

  std::string run() {
    for (Shape& s : scene_.shapes)
      if (s.emitter) multiply(*s.emitter);
    for (Emitter& e : scene_.emitters) std::visit([&](auto& light) { multiply(light); }, e);
    for (Medium& m : scene_.media)
      if (gives_off_light(m)) std::visit([&](auto& medium) { multiply(medium); }, m);
    return std::move(wrong_);
  }

 private:
  // Returns the factor of the group of this name; nullptr if the mix has none.
  const Rgb* factor(const std::string& group) {
    const auto at = mix_.groups.find(group.empty() ? std::string(kOtherLightGroup) : group);
    if (at == mix_.groups.end()) return nullptr;
    if (at->second.surface != at->second.volume)
      wrong_ = fmt::format(
          "the light group \"{}\" has other factors for media than for surfaces: only a finished image can "
          "be "
          "mixed so",
          at->first);
    return &at->second.surface;
  }
  void scale(double& value, const Rgb& f, const std::string& group, std::string_view what) {
    if (f[0] != f[1] || f[1] != f[2])
      wrong_ =
          fmt::format("the light group \"{}\" has {}, which takes one factor, not a colour", group, what);
    value *= f[0];
  }
  void multiply(AreaEmitter& light) {
    const Rgb* f = factor(light.light_group);
    if (!f) return;
    const auto add = [&](const Texture& texture) {
      scene_.textures.push_back(texture);
      return TextureIndex{static_cast<std::uint32_t>(scene_.textures.size() - 1)};
    };
    // The texture may be used elsewhere, too, so it stays as it is
    if (const auto* constant = std::get_if<ConstantTexture>(&scene_.textures[light.radiance.value]))
      light.radiance = add(ConstantTexture{times(constant->value, *f)});
    else
      light.radiance = add(ProductTexture{light.radiance, add(ConstantTexture{*f})});
  }
  void multiply(ConstantEmitter& light) { multiply(light.light_group, light.radiance); }
  void multiply(DirectionalEmitter& light) { multiply(light.light_group, light.irradiance); }
  void multiply(PointEmitter& light) { multiply(light.light_group, light.intensity); }
  void multiply(SpotEmitter& light) { multiply(light.light_group, light.intensity); }
  void multiply(GoniometricEmitter& light) { multiply(light.light_group, light.intensity); }
  void multiply(EnvmapEmitter& light) {
    if (const Rgb* f = factor(light.light_group))
      scale(light.scale, *f, light.light_group, "an environment map");
  }
  void multiply(ProjectorEmitter& light) {
    if (const Rgb* f = factor(light.light_group)) scale(light.scale, *f, light.light_group, "a projector");
  }
  void multiply(HomogeneousMedium& medium) {
    multiply(medium.light_group, medium.emission);
    multiply(medium.light_group, medium.source_radiance);
  }
  void multiply(HeterogeneousMedium& medium) {
    if (const Rgb* f = factor(medium.light_group))
      scale(medium.emission_scale, *f, medium.light_group, "a medium whose emission varies");
  }
  void multiply(const std::string& group, Rgb& value) {
    if (const Rgb* f = factor(group)) value = times(value, *f);
  }

  const LightMix& mix_;
  Scene& scene_;
  std::string wrong_;
};

}  // namespace

Result<void> multiply_light(const LightMix& mix, Scene& scene) {
  const std::vector<std::string> known = light_groups_of(scene);
  for (const auto& [group, factors] : mix.groups)
    if (!std::ranges::binary_search(known, group))
      return bad_argument(
          fmt::format("mix: the scene has no light group \"{}\"; it has {}", group, fmt::join(known, ", ")));
  if (const std::string wrong = Multiplier(mix, scene).run(); !wrong.empty())
    return bad_argument("mix: " + wrong);
  return {};
}

}  // namespace ls::scene

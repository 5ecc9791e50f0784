#include "core/scene/schema/texture_uses.h"

#include <type_traits>

#include "core/scene/schema/describe_fields.h"

namespace ls::scene {
namespace {

using UseFlag = bool TextureUse::*;

class UseWalk {
 public:
  explicit UseWalk(const Scene& scene) : scene_(scene), uses_(scene.textures.size()) {}

  template <class T>
  void look_at(const T& object) {
    is_bump_map_ = std::is_same_v<T, BumpMapBsdf>;
    describe(*this, object);
  }
  template <class T>
  void field(const Field& f, const T& value) {
    if (!in_texture_)
      as_ = is_bump_map_            ? &TextureUse::heights
            : f.name == "normalmap" ? &TextureUse::normals
            : f.number              ? &TextureUse::number
                                    : &TextureUse::colour;
    go(value);
  }
  void go(const std::optional<TextureIndex>& t) {
    if (t) go(*t);
  }
  void go(TextureIndex t) {
    if (t.value >= uses_.size() || uses_[t.value].*as_) return;
    uses_[t.value].*as_ = true;
    const bool before = std::exchange(in_texture_, true);
    std::visit([&](const auto& x) { describe(*this, x); }, scene_.textures[t.value]);
    in_texture_ = before;
  }
  template <class T>
  void go(const T&) {}

  void note(TextureIndex t, UseFlag as) {
    as_ = as;
    go(t);
  }
  std::vector<TextureUse> take() { return std::move(uses_); }

 private:
  const Scene& scene_;
  std::vector<TextureUse> uses_;
  UseFlag as_ = &TextureUse::colour;
  bool in_texture_ = false, is_bump_map_ = false;
};

}  // namespace

std::vector<TextureUse> texture_uses(const Scene& scene) {
  UseWalk walk(scene);
  const auto each = [&](const auto& variants) {
    for (const auto& v : variants) std::visit([&](const auto& x) { walk.look_at(x); }, v);
  };
  each(scene.bsdfs);
  each(scene.emitters);
  for (const Shape& s : scene.shapes)
    if (s.emitter) walk.note(s.emitter->radiance, &TextureUse::colour);
  if (scene.sensor.aperture_scale) walk.note(*scene.sensor.aperture_scale, &TextureUse::number);
  return walk.take();
}

}  // namespace ls::scene

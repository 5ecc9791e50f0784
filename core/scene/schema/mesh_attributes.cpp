#include "core/scene/schema/mesh_attributes.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "core/scene/schema/describe_fields.h"

namespace ls::scene {
namespace {

using As = AttributeUse::As;

class Walk {
 public:
  explicit Walk(const Scene& scene) : scene_(scene) {}

  template <class T>
  void field(const Field& f, const T& value) {
    const As before = as_;
    // A nested texture is read as the same type (scalar, colour or either) as the texture that contains it.
    if (in_texture_ == 0) as_ = f.number ? As::number : f.name == "normalmap" ? As::colour : As::any;
    go(value);
    as_ = before;
  }
  void go(const std::optional<TextureIndex>& t) {
    if (t) go(*t);
  }
  void go(TextureIndex t) {
    if (t.value >= scene_.textures.size() || !seen_.emplace(t, as_, in_light_).second) return;
    const Texture& texture = scene_.textures[t.value];
    if (std::holds_alternative<MeshAttributeTexture>(texture)) found_.insert({as_, t, in_light_});
    ++in_texture_;
    std::visit([&](const auto& x) { describe(*this, x); }, texture);
    --in_texture_;
  }
  void go(BsdfIndex b) {
    if (b.value >= scene_.bsdfs.size() || !bsdfs_.insert(b).second) return;
    std::visit([&](const auto& x) { describe(*this, x); }, scene_.bsdfs[b.value]);
  }
  void go(const AreaEmitter& light) {
    in_light_ = true;
    describe(*this, light);
    in_light_ = false;
  }
  template <class T>
  void go(const T&) {}

  std::vector<AttributeUse> take() const { return {found_.begin(), found_.end()}; }

 private:
  const Scene& scene_;
  std::set<std::tuple<TextureIndex, As, bool>> seen_;
  std::set<BsdfIndex> bsdfs_;
  std::set<AttributeUse> found_;
  As as_ = As::any;
  bool in_light_ = false;
  int in_texture_ = 0;
};

}  // namespace

bool any_attribute(const Scene& scene) {
  return std::any_of(scene.textures.begin(), scene.textures.end(),
                     [](const Texture& t) { return std::holds_alternative<MeshAttributeTexture>(t); });
}

std::vector<AttributeUse> attribute_uses(const Scene& scene, const Shape& shape) {
  Walk walk(scene);
  walk.go(shape.bsdf);
  if (shape.emitter) walk.go(*shape.emitter);
  return walk.take();
}

std::vector<AttributeUse> attribute_uses(const Scene& scene, TextureIndex texture) {
  Walk walk(scene);
  walk.go(texture);
  return walk.take();
}

bool is_attribute_name(std::string_view name) {
  for (const std::string_view start : {"vertex_", "face_"})
    if (name.starts_with(start) && name.size() > start.size()) return true;
  return false;
}

}  // namespace ls::scene

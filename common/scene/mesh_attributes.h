// Which attributes of its mesh a shape's surface and light read, through textures of any depth.
#pragma once

#include <string_view>
#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

struct AttributeUse {
  // number: of one component. colour: of three (a normal map). any: of either, one being a grey.
  enum class As { any, number, colour } as = As::any;
  TextureIndex texture;   // a MeshAttributeTexture
  bool in_light = false;  // of the shape's emitter: numbers above 1 make sense
  auto operator<=>(const AttributeUse&) const = default;
};

// Whether any texture reads one: looks at them all. Where none does, no shape need be asked.
bool any_attribute(const Scene& scene);
// Sorted, none twice. Ends for any scene, circular ones as well; indices out of range are passed over.
std::vector<AttributeUse> attribute_uses(const Scene& scene, const Shape& shape);
std::vector<AttributeUse> attribute_uses(const Scene& scene, TextureIndex texture);

// "vertex_..." or "face_...", with something behind.
bool is_attribute_name(std::string_view name);

}  // namespace ls::scene

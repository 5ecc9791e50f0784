// Finds the mesh attributes that a shape's surface and light read, through textures nested to any depth.
#pragma once

#include <string_view>
#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

struct AttributeUse {
  // number: one component. colour: three (a normal map). any: either, one component being grey.
  enum class As { any, number, colour } as = As::any;
  TextureIndex texture;   // a MeshAttributeTexture
  bool in_light = false;  // read by the shape's emitter: numbers above 1 make sense
  auto operator<=>(const AttributeUse&) const = default;
};

// True if any texture of the scene reads an attribute; if not, the shapes need not be examined.
bool any_attribute(const Scene& scene);
// Sorted, without duplicates. Terminates for any scene, including circular ones; ignores indices out of
// range.
std::vector<AttributeUse> attribute_uses(const Scene& scene, const Shape& shape);
std::vector<AttributeUse> attribute_uses(const Scene& scene, TextureIndex texture);

// "vertex_..." or "face_...", with a non-empty rest.
bool is_attribute_name(std::string_view name);

}  // namespace ls::scene

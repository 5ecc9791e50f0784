// Finds the mesh attributes that a shape's surface and light read, through textures nested to any depth.
#pragma once

#include <string_view>
#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

struct AttributeUse {
  // How many numbers the attribute must have. number: one. colour: three (a normal map). any: one or three; a
  // single number is grey.
  enum class As { any, number, colour } as = As::any;
  TextureIndex texture;  // index of a MeshAttributeTexture
  // True if the shape's emitter reads it, so that numbers above 1 are allowed.
  bool in_light = false;
  auto operator<=>(const AttributeUse&) const = default;
};

// True if any texture of the scene reads an attribute; if not, the shapes need not be examined.
bool any_attribute(const Scene& scene);
// Each returns the attributes that a shape or a texture reads, sorted, without duplicates. Scenes may have
// cycles of textures and indices out of range, which are ignored.
std::vector<AttributeUse> attribute_uses(const Scene& scene, const Shape& shape);
std::vector<AttributeUse> attribute_uses(const Scene& scene, TextureIndex texture);

// True for "vertex_..." and "face_..." with a non-empty rest.
bool is_attribute_name(std::string_view name);

}  // namespace ls::scene

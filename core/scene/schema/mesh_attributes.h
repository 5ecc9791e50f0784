// Finds the mesh attributes that a shape's surface and light read, through textures nested to any depth.
#pragma once

#include <string_view>
#include <vector>

#include "core/scene/scene.h"

namespace ls::scene {

struct AttributeUse {
  // How many numbers the attribute must have. number: one. colour: three (for a normal map). any: one or
  // three, where one number means grey.
  enum class As { any, number, colour } as = As::any;
  TextureIndex texture;  // index of a MeshAttributeTexture
  // True if the shape's emitter reads the attribute as radiance, which may exceed 1. False: a BSDF reads it,
  // and values that the file stores as bytes must not exceed 1 after scaling.
  bool in_light = false;
  auto operator<=>(const AttributeUse&) const = default;
};

// True if any texture of the scene reads an attribute; if not, the shapes need not be examined.
bool any_attribute(const Scene& scene);
// Both return the attributes that the shape or the texture reads, sorted, without duplicates. The scene need
// not be consistent: cycles of textures and indices out of range are ignored.
std::vector<AttributeUse> attribute_uses(const Scene& scene, const Shape& shape);
std::vector<AttributeUse> attribute_uses(const Scene& scene, TextureIndex texture);

// True for "vertex_..." and "face_..." with a non-empty rest.
bool is_attribute_name(std::string_view name);

}  // namespace ls::scene

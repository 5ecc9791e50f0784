// Finds what the scene's textures are read as: colours, or numbers of other kinds, which no conversion of
// colours may change.
#pragma once

#include <vector>

#include "core/scene/scene.h"

namespace ls::scene {

struct TextureUse {
  bool colour = false;   // a reflectance, a radiance or the like
  bool number = false;   // a roughness, an opacity, a weight or the like
  bool normals = false;  // the normals of a normal map
  bool heights = false;  // the heights of a bump map
};

// Returns the uses of each texture of the scene, by its index. A texture within another one is read as that
// one is. The scene need not be consistent: cycles of textures and indices out of range are ignored.
std::vector<TextureUse> texture_uses(const Scene& scene);

}  // namespace ls::scene

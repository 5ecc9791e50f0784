// Converts the scene's colours to the renderer's type.
#pragma once

#include "common/scene/scene.h"
#include "worker/render/math/math.h"

namespace ls::render {

inline C3 color(const Rgb& c) {
  return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
}

}  // namespace ls::render

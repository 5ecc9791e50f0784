// The components into which the radiance of a sample is split, by the scatterings on the light's path. The
// light AOVs (auxiliary images) are sums of components.
#pragma once

#include <array>
#include <cstdint>

#include "worker/render/math/math.h"

namespace ls::render {

// A component is defined by the first scattering of the path, counted from the camera, and by whether more
// scatterings follow.
enum class LightPart : std::uint8_t {
  unscattered,    // directly visible: lights, environment, medium emission
  surface_once,   // one scattering, at a surface
  surface_again,  // several scatterings, the first at a surface
  volume_once,    // one scattering, in a medium
  volume_again,   // several scatterings, the first in a medium
};
inline constexpr std::size_t kLightParts = 5;

using LightSplit = std::array<C3, kLightParts>;

constexpr LightPart part_of(int scatterings, bool first_in_medium) {
  if (scatterings == 0) return LightPart::unscattered;
  if (first_in_medium) return scatterings == 1 ? LightPart::volume_once : LightPart::volume_again;
  return scatterings == 1 ? LightPart::surface_once : LightPart::surface_again;
}

}  // namespace ls::render

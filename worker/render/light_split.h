// The radiance of one sample by the way the light came: what the AOVs of kind `light` are made of.
#pragma once

#include <array>
#include <cstdint>

#include "worker/render/math.h"

namespace ls::render {

// By the path's first scattering as seen from the camera, and whether it is the only one.
enum class LightPart : std::uint8_t {
  unscattered,    // seen straight: lights, the environment, glow
  surface_once,   // one scattering, at a surface
  surface_again,  // the first of several at a surface
  volume_once,    // one scattering, in a medium
  volume_again,   // the first of several in a medium
};
inline constexpr std::size_t kLightParts = 5;

using LightSplit = std::array<C3, kLightParts>;

constexpr LightPart part_of(int scatterings, bool first_in_medium) {
  if (scatterings == 0) return LightPart::unscattered;
  if (first_in_medium) return scatterings == 1 ? LightPart::volume_once : LightPart::volume_again;
  return scatterings == 1 ? LightPart::surface_once : LightPart::surface_again;
}

}  // namespace ls::render

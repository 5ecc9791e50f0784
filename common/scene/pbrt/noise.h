// Perlin's improved noise (K. Perlin, Improving Noise, SIGGRAPH 2002) as pbrt-v4 has it.
#pragma once

#include "common/scene/scene.h"

namespace ls::scene::pbrt {

// Returns a smooth function of the point that is 0 wherever all coordinates are whole numbers. It repeats
// after 256 along each axis.
double noise(const Vec3& p);

// Returns the gradient of noise() as pbrt approximates it: by differences over 0.01.
Vec3 noise_slope(const Vec3& p);

}  // namespace ls::scene::pbrt

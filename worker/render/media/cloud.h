// The density of pbrt's medium "cloud": noise that is thinned out with height and limited to [0, 1]
// (CloudMedium::Density in pbrt-v4's src/pbrt/media.h).
#pragma once

#include "core/scene/scene.h"
#include "worker/render/math/math.h"
#include "worker/render/media/noise.h"

namespace ls::render {

// Perlin's improved noise (K. Perlin, Improving Noise, SIGGRAPH 2002) as pbrt-v4 has it: a smooth function of
// the point that is 0 wherever all coordinates are whole numbers. It repeats after 256 along each axis.
double cloud_noise(const V3d& p);

// Returns the gradient of cloud_noise() as pbrt approximates it: by forward differences with a step of 0.01.
V3d cloud_noise_slope(const V3d& p);

class Cloud {
 public:
  explicit Cloud(const CloudVolume& v)
      : density_(v.density), wispiness_(v.wispiness), frequency_(v.frequency) {}

  // Returns the density, 0 to 1, at a point in the cloud's own coordinates. Its box has no effect on it.
  float value(const V3d& p) const;
  // Bounds the density in the box [lo, hi].
  ValueBounds bounds(const V3d& lo, const V3d& hi) const;
  double finest() const;  // size of a cell of the last octave, in the cloud's own coordinates

 private:
  double noise_at(double height, double sum) const;
  static double ground_at(double height);

  double density_, wispiness_, frequency_;
};

}  // namespace ls::render

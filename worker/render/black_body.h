// The light of a black body as linear sRGB: Planck's law seen by the CIE 1931 standard observer.
#pragma once

#include "worker/render/math.h"

namespace ls::render {

// Radiance of a black body of this temperature, in the scene's units for spectra of light: a body whose
// spectral radiance is 1 W/(m^2 sr nm) at all wavelengths would have the luminance 1. Parts that are
// negative, because the colour is outside of sRGB (blue, below 1900 K), are 0. Interpolated from a table,
// within 1e-4 of it; below 200 K, and for NaN, 0; above 1e6 K in proportion to the temperature (Rayleigh and
// Jeans).
C3 black_body_radiance(float kelvin);

// Below this, black_body_radiance is 0.
inline constexpr float kColdest = 200;

}  // namespace ls::render

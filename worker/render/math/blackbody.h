// Black-body radiation as linear sRGB: Planck's law seen by the CIE 1931 standard observer.
#pragma once

#include "worker/render/math/math.h"

namespace ls::render {

// Returns the radiance of a black body of the temperature `kelvin`, in the scene's units for spectra of
// light: a body whose spectral radiance is 1 W/(m^2 sr nm) at all wavelengths has luminance 1. Negative
// components (colours outside sRGB: blue below 1900 K) are clamped to 0. The radiance is interpolated from a
// table, with an error below 1e-4. It is 0 below 200 K and for NaN, and proportional to the temperature above
// 1e6 K (Rayleigh-Jeans).
C3 black_body_radiance(float kelvin);

// Returns black_body_radiance() divided by the largest spectral radiance of that body over all wavelengths,
// so that its spectrum has the peak 1.
C3 black_body_of_peak_one(float kelvin);

// The temperature [K] below which black_body_radiance() is 0.
inline constexpr float kColdest = 200;

}  // namespace ls::render

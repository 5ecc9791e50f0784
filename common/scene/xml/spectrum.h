// Converts spectral curves to linear sRGB: the colours that the CIE 1931 2-degree standard observer sees,
// with the primaries and the white (D65) of ITU-R BT.709.
#pragma once

#include <array>
#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

// A curve over the wavelength: linear between its points, and 0 beyond the ends. It has at least two points,
// with increasing wavelengths `nm`.
struct SpectralCurve {
  std::vector<double> nm, value;
  bool operator==(const SpectralCurve&) const = default;
};

// The illuminant by which a curve is multiplied: d65 for a reflectance. Spectra of light, and all curves of
// Mitsuba 0.x, use equal_energy, which has the same power at all wavelengths.
enum class Illuminant { equal_energy, d65 };

// Returns integral(curve * illuminant * observer) / integral(illuminant * y), from 360 to 830 nm, as linear
// sRGB, where `y` is the observer's y. Components are negative for colours outside sRGB.
Rgb linear_srgb(const SpectralCurve& curve, Illuminant illuminant);

// Converts CIE 1931 X, Y, Z to linear sRGB.
Rgb linear_srgb(const std::array<double, 3>& xyz);

// Returns X, Y, Z of a black body at `kelvin` > 0 by Planck's law [W/(m^2 sr nm)], in the units of
// linear_srgb(): a radiance of 1 at all wavelengths gives X = Y = Z = 1.
std::array<double, 3> black_body_xyz(double kelvin);

// Returns the largest spectral radiance of a black body over all wavelengths [W/(m^2 sr nm)].
double black_body_peak(double kelvin);

// Returns the linear sRGB of light with the same power at all wavelengths and luminance 1: X = Y = Z = 1,
// which is not white.
Rgb equal_energy_srgb();

}  // namespace ls::scene

// Converts spectral curves to linear sRGB: the colours that the CIE 1931 2-degree standard observer sees,
// with the primaries and the white (D65) of ITU-R BT.709.
#pragma once

#include <array>
#include <vector>

#include "core/scene/scene.h"

namespace ls::scene {

// A curve over the wavelength: linear between its points, and 0 beyond the ends. It has at least two points,
// with increasing wavelengths `nm`.
struct SpectralCurve {
  std::vector<double> nm, value;
  bool operator==(const SpectralCurve&) const = default;
};

// The spectrum of the light by which a curve is multiplied: d65 for reflectances. equal_energy has the same
// power at all wavelengths; it is used for spectra of light, and for all curves in files of Mitsuba 0.x.
enum class Illuminant { equal_energy, d65 };

// Returns X, Y, Z = integral(curve * illuminant * observer) / integral(illuminant * y), converted to linear
// sRGB. The integrals are from 360 to 830 nm; `observer` is the colour matching functions x, y and z. For a
// colour outside sRGB some components are negative.
Rgb linear_srgb(const SpectralCurve& curve, Illuminant illuminant);

// Converts CIE 1931 X, Y, Z to linear sRGB.
Rgb linear_srgb(const std::array<double, 3>& xyz);

// Returns the spectral radiance [W/(m^2 sr nm)] of a black body at `kelvin` > 0 by Planck's law, at each nm
// from 360 to 830.
SpectralCurve black_body_curve(double kelvin);

// Returns X, Y, Z of the light of that black body. X, Y, Z are normalised as in linear_srgb(): a spectral
// radiance of 1 at all wavelengths would give X = Y = Z = 1.
std::array<double, 3> black_body_xyz(double kelvin);

// Returns the largest value, over all wavelengths, of a black body's spectral radiance [W/(m^2 sr nm)].
double black_body_peak(double kelvin);

// Returns the linear sRGB of light with the same power at all wavelengths and luminance 1: X = Y = Z = 1,
// which is not white.
Rgb equal_energy_srgb();

}  // namespace ls::scene

#include "core/scene/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/scene/cie.h"

namespace ls::scene {
namespace {

using Xyz = std::array<double, 3>;

// The two constants of Planck's law for wavelengths in nm (CODATA 2018, exact): 2 h c^2 in W nm^4 / (m^2 sr),
// and h c / k in nm K.
constexpr double kFirst = 1.191042972397188e-16 * 1e36, kSecond = 1.438776877503933e7;

// Converts XYZ to linear sRGB. The matrix follows from BT.709's primaries (x, y) = (.64, .33), (.30, .60),
// (.15, .06) and its white (.3127, .3290); its numbers are rounded to six decimals, as is usual.
Rgb srgb_of(const Xyz& c) {
  return {3.240479 * c[0] - 1.537150 * c[1] - .498535 * c[2],
          -.969256 * c[0] + 1.875991 * c[1] + .041556 * c[2],
          .055648 * c[0] - .204043 * c[1] + 1.057311 * c[2]};
}

// The values of observer and illuminant at one wavelength, interpolated between the rows of the CIE table
// (cie.h).
struct Seen {
  Xyz observer;
  double light;
};
Seen seen_at(double nm, std::size_t interval, Illuminant illuminant) {
  const CieRow &a = kCieRows[interval], &b = kCieRows[interval + 1];
  const double t = (nm - kCieFirst) / kCieStep - static_cast<double>(interval);
  Seen s;
  for (std::size_t i = 0; i < 3; ++i) s.observer[i] = a.observer[i] + t * (b.observer[i] - a.observer[i]);
  s.light = illuminant == Illuminant::d65 ? a.d65 + t * (b.d65 - a.d65) : 1;
  return s;
}

double on_line(const SpectralCurve& c, std::size_t segment, double nm) {
  const double x0 = c.nm[segment], x1 = c.nm[segment + 1];
  const double t = (nm - x0) / (x1 - x0);
  return c.value[segment] * (1 - t) + c.value[segment + 1] * t;
}

// Returns the integral of curve * illuminant * observer over the wavelength in nm. Between neighbouring
// samples of the curve or of the table, each of the three factors is linear, so that the product is a cubic
// polynomial, for which Simpson's rule is exact.
Xyz integral(const SpectralCurve& c, Illuminant illuminant) {
  Xyz sum{0, 0, 0};
  const double end = std::min(c.nm.back(), kCieLast);
  double from = std::max(c.nm.front(), kCieFirst);
  std::size_t segment = 0;
  while (from < end) {
    while (c.nm[segment + 1] <= from) ++segment;
    const auto interval =
        std::min(static_cast<std::size_t>((from - kCieFirst) / kCieStep), kCieRows.size() - 2);
    const double grid = kCieFirst + kCieStep * static_cast<double>(interval + 1);
    const double to = std::min({end, c.nm[segment + 1], grid > from ? grid : end});
    const double nm[3] = {from, (from + to) / 2, to}, weight[3] = {1, 4, 1};
    for (std::size_t k = 0; k < 3; ++k) {
      const Seen s = seen_at(nm[k], interval, illuminant);
      const double w = weight[k] * (to - from) / 6 * s.light * on_line(c, segment, nm[k]);
      for (std::size_t i = 0; i < 3; ++i) sum[i] += w * s.observer[i];
    }
    from = to;
  }
  return sum;
}

double white_luminance(Illuminant illuminant) {
  return integral({{kCieFirst, kCieLast}, {1, 1}}, illuminant)[1];
}

}  // namespace

Rgb linear_srgb(const SpectralCurve& curve, Illuminant illuminant) {
  static const double luminance[] = {white_luminance(Illuminant::equal_energy),
                                     white_luminance(Illuminant::d65)};
  Xyz c = integral(curve, illuminant);
  for (double& x : c) x /= luminance[static_cast<std::size_t>(illuminant)];
  return srgb_of(c);
}

Rgb linear_srgb(const std::array<double, 3>& xyz) { return srgb_of(xyz); }

// At the temperature T, Planck's law has its peak at the wavelength lambda where x = h c / (lambda k T) is
// 4.965..., the root of x = 5 (1 - e^-x) (Wien's displacement law). Its value there is
// 2 h c^2 (x k T / (h c))^5 / (e^x - 1).
double black_body_peak(double kelvin) {
  constexpr double kAtPeak = 4.965114231744276;
  return kFirst * std::pow(kAtPeak * kelvin / kSecond, 5) / std::expm1(kAtPeak);
}

SpectralCurve black_body_curve(double kelvin) {
  SpectralCurve curve;
  for (double nm = kCieFirst; nm <= kCieLast; nm += 1) {
    curve.nm.push_back(nm);
    curve.value.push_back(kFirst / (nm * nm * nm * nm * nm) / std::expm1(kSecond / (nm * kelvin)));
  }
  return curve;
}

std::array<double, 3> black_body_xyz(double kelvin) {
  Xyz c = integral(black_body_curve(kelvin), Illuminant::equal_energy);
  static const double luminance = white_luminance(Illuminant::equal_energy);
  for (double& x : c) x /= luminance;
  return c;
}

Rgb equal_energy_srgb() { return srgb_of({1, 1, 1}); }

}  // namespace ls::scene

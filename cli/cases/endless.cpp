#include "cli/cases/endless.h"

#include <cmath>

#include "cli/cases/stages.h"

namespace ls::cases {
namespace {

// The rate of the slowest decay: c atanh(k) / k = 1, the left side growing from c to infinity.
double diffusion_rate(double albedo) {
  double below = 0, above = 1;
  for (int i = 0; i < 100; ++i) {
    const double k = (below + above) / 2;
    (albedo * std::atanh(k) < k ? below : above) = k;
  }
  return below;
}

// The mean of e^(-k s) / s over a ball, as a share of it at the middle: x = k times the radius.
double of_ball(double x) {
  return x < 1e-3 ? 1 + x * x / 10 : 3 * (x * std::cosh(x) - std::sinh(x)) / (x * x * x);
}

}  // namespace

double endless_fluence(double albedo, double distance, double radius) {
  const double k = diffusion_rate(albedo);
  const double pole = 2 * k * k * (1 - k * k) / (albedo * (albedo - 1 + k * k)) * std::exp(-k * distance) *
                      of_ball(k * radius);
  // Over k > 1 along the cut, k = 1 + e^u: the integrand falls like e^u below and like e^(-k (r - a)) above.
  constexpr double kLeast = -40, kMostExponent = 60;
  const auto cut = [&](double u) {
    const double above = std::exp(u), rate = 1 + above;
    const double real = 1 - albedo * (std::log(2 + above) - u) / (2 * rate),
                 imaginary = albedo * kPi / (2 * rate);
    return above * std::exp(-rate * distance) * of_ball(rate * radius) /
           (real * real + imaginary * imaginary);
  };
  const double rest = integrate(cut, kLeast, std::log(kMostExponent / (distance - radius)), 4000);
  return (pole + rest) / (4 * kPi * distance);
}

}  // namespace ls::cases

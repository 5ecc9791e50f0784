// Measures by finite differences how much a map from the unit square stretches areas. This is one over the
// density of the mapped uniform numbers.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <string>

#include "worker/render/math/math.h"
#include "worker/render/math/random.h"

namespace ls::test {

// The image of a point, and the density that the map claims there; nullopt where the map fails.
struct Mapped {
  render::V3d to;  // a unit direction or a point, with coordinates accurate to `rounding`
  double pdf = 0;  // density per area, or per steradian
};
using SquareMap = std::function<std::optional<Mapped>(const render::V2&)>;

// Densities are float32 results of some tens of operations, at positions with as many rounding errors.
inline constexpr double kFloats = 2e-4;

struct Stretch2 {
  double area = 0, error = 0;  // error: relative, of the differences and of rounding
};
inline std::optional<Stretch2> optical_depth_of(const SquareMap& map, const render::V2& u, double rounding) {
  const auto area = [&](float h, double& noise) -> std::optional<double> {
    const auto a = map({u.x + h, u.y}), b = map({u.x - h, u.y}), c = map({u.x, u.y + h}),
               d = map({u.x, u.y - h});
    if (!a || !b || !c || !d) return std::nullopt;
    const render::V3d du = (a->to - b->to) / (2. * h), dv = (c->to - d->to) / (2. * h);
    const double cross = du.cross(dv).length();
    // Each difference has two rounding errors. The error of the product is relative to the area that it
    // spans.
    noise = cross > 0 ? 2 * rounding / h * (du.length() + dv.length()) / cross : 1;
    return cross;
  };
  double coarse_noise = 0, noise = 0;
  const auto coarse = area(0x1p-6f, coarse_noise), fine = area(0x1p-7f, noise);
  if (!coarse || !fine || !(*fine > 0)) return std::nullopt;
  // The error of central differences is c h^2. Extrapolation removes the three quarters of it by which
  // halving the step changed the result, and the remaining third of that change. The whole change is allowed
  // as error, for the next order.
  return Stretch2{(4 * *fine - *coarse) / 3, std::abs(*fine - *coarse) / *fine + 2 * noise};
}

// Tests random points of the square. A point where halving the step changes much (a kink, an edge) is
// skipped; up to a fifth of all points may be.
inline void expect_jacobian(const std::string& name, const SquareMap& map, double rounding = 0x1p-23,
                            int places = 400) {
  render::RandomStream r(23);
  int told = 0, met = 0;
  for (int i = 0; i < places; ++i) {
    const render::V2 u(.02f + .96f * r.uniform(), .02f + .96f * r.uniform());
    const auto here = map(u);
    if (!here) continue;
    ++met;
    const auto s = optical_depth_of(map, u, rounding);
    if (!s || s->error > .1) continue;
    ++told;
    ASSERT_NEAR(s->area * here->pdf, 1, 1.5 * s->error + kFloats) << name << " at " << u.x << " " << u.y;
  }
  EXPECT_GE(told, met * 4 / 5) << name;
  EXPECT_GT(met, places / 20) << name;
}

// The same along a line: x(u) increases with the density 1 / (dx / du).
inline void expect_slope(const std::string& name, const std::function<double(double)>& x,
                         const std::function<double(double)>& pdf, double rounding) {
  render::RandomStream r(29);
  int told = 0;
  constexpr int kPlaces = 400;
  for (int i = 0; i < kPlaces; ++i) {
    const double u = .02 + .96 * r.uniform();
    const auto slope = [&](double h) { return (x(u + h) - x(u - h)) / (2 * h); };
    const double coarse = slope(0x1p-6), fine = slope(0x1p-7);
    const double error = std::abs(fine - coarse) / std::abs(fine) + 2 * rounding / (std::abs(fine) * 0x1p-7);
    if (!(error < .1)) continue;
    ++told;
    ASSERT_NEAR((4 * fine - coarse) / 3 * pdf(x(u)), 1, 1.5 * error + kFloats) << name << " at " << u;
  }
  EXPECT_GE(told, kPlaces * 4 / 5) << name;
}

}  // namespace ls::test

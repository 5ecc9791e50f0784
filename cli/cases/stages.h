// Scenes that several subjects ask their questions in, and the quadrature of answers.
#pragma once

#include "cli/cases/case.h"
#include "cli/cases/ways.h"

namespace ls::cases {

// Paths of two segments, the light's included: one scattering.
inline constexpr int kOnce = 2;

// The unit cube of a medium in the dark, seen along x through its middle: a unit of it.
SceneKit unit_cube(const Way& way, const Rgb& sigma_t, const Rgb& albedo = rgb(0), double g = 0);

// That cube, of albedo 1, and light along the view itself or against it, by parallel rays: scattered by 0
// degrees, p(0) sigma d e^(-sigma d) arrives of light from behind; by 180, p(180) (1 - e^(-2 sigma d)) / 2.
SceneKit head_on(const Way& way, double g, double sigma, bool backlit);
// Of a light from behind where g > 0, from the eye where g < 0: 4 pi p = (1 + |g|) / (1 - |g|)^2.
double head_on_answer(double g, double sigma);

// The cube [-1, 1]^3 of a medium lit once, straight down its y axis with irradiance 1, seen along z at height
// y: L = a / (4 pi) e^(-sigma (1 - y)) (1 - e^(-2 sigma)) (STABILITY 7.6f).
SceneKit lit_cube(const Way& way, const Rgb& sigma_t, const Rgb& albedo, double y = 0,
                  const Vec3& at = {0, 0, 0}, double size = 1);
double lit_cube_answer(double sigma_t, double albedo, double y = 0);

// A ray of length 6 along z, its middle the origin, through a medium that goes on beyond; a black plate ends
// it, and light is scattered once.
SceneKit passing(const Way& way, const Rgb& sigma_t, const Rgb& albedo);
// Of a point of intensity 1 / (4 pi) (1 W) at distance h from the middle.
double passing_answer(double h, double sigma, double albedo = 1);

// A floor (2 x 2, reflectance 1/2, at z = 0) under the box [-1, 1]^2 x [1, 2] of a medium that only absorbs,
// lit straight down through it with irradiance 1, and seen from the side below: e^-tau / (2 pi), by shadow
// rays.
SceneKit lit_floor();

struct Slab {  // [0, tau] in z, extinction 1; endless by a column of mirrors around it
  double albedo = 1, g = 0, tau = 1;
  double ior = 1;      // of the slab; 1: matched boundaries
  bool split = false;  // by a boundary that changes nothing
  // Of the column, from its middle, below 39: changes nothing but how often paths meet it.
  double wall = 24;
  double reach() const { return wall + .1; }  // past the walls
};
// Seen straight down from above, in a sky of radiance 1 above (reflected) or below (transmitted).
SceneKit column(const Way& way, const Slab& slab, bool transmitted);

// A cube of `depth` mean free paths to a side before a black plate, in a sky, seen at an angle of this cosine
// from the normal of its upper face: all but endless.
SceneKit half_space(const Way& way, double albedo, double depth, double cosine);

// A file of these bytes that the scene names so.
AssetIndex text_file(SceneKit& kit, const std::string& name, const std::string& bytes);

// Composite Simpson; n even.
template <class F>
double integrate(F f, double a, double b, int n) {
  const double h = (b - a) / n;
  double sum = f(a) + f(b);
  for (int i = 1; i < n; ++i) sum += (i % 2 ? 4 : 2) * f(a + i * h);
  return sum * h / 3;
}

}  // namespace ls::cases

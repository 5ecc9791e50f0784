// The phase functions other than Henyey-Greenstein's (phase.h): Rayleigh, Draine, water droplets,
// Fournier-Forand, tables, and blends of any of these. They are rarer and slower than Henyey-Greenstein's;
// only the code with Features::phases uses them.
//
// All are symmetric about the direction of travel. They are written in x = 1 - cos and y = 1 + cos of the
// scattering angle, in double: each is exact where it is small, so that narrow peaks forwards and backwards
// keep their shape. The density of x is 2 pi times the phase function.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "worker/render/math/math.h"

namespace ls::render {

class Grid;

struct ScatteringAngle {
  double x = 0, y = 2;  // 1 - cos and 1 + cos

  static ScatteringAngle between(const V3& w, const V3& w1) {
    const V3d a(w), b(w1), apart = a - b, sum = a + b;
    return {.5 * apart.dot(apart), .5 * sum.dot(sum)};
  }
  double cosine() const { return x < y ? 1 - x : y - 1; }
};

// Each phase function has
//   density(angle)   the phase function [1/sr]; its integral over all directions is 1
//   sample(u)        the angle for a random number u in [0, 1): an exact inversion of the distribution
// A table has density() and sample() by the mean of its colours, and also value(), the colours.

// Henyey and Greenstein 1941, as in phase.h but in double.
struct HenyeyGreensteinLobe {
  double g = 0;
  double density(const ScatteringAngle& angle) const;
  ScatteringAngle sample(double u) const;
};

// 3 / (16 pi) (1 + cos^2): scattering by what is much smaller than the wavelength.
struct RayleighLobe {
  double density(const ScatteringAngle& angle) const;
  ScatteringAngle sample(double u) const;
};

// Draine 2003, "Scattering by interstellar dust grains. I", equation 4: Henyey-Greenstein's function times
// (1 + alpha cos^2), normalised. alpha = 0 is Henyey-Greenstein; g = 0 and alpha = 1 is Rayleigh.
struct DraineLobe {
  double g = 0, alpha = 0;
  double density(const ScatteringAngle& angle) const;
  ScatteringAngle sample(double u) const;
};

// Jendersie and d'Eon 2023, "An Approximate Mie Scattering Function for Fog and Cloud Rendering": the share
// 1 - draine_share of Henyey-Greenstein and the share draine_share of Draine, fitted to Mie's solution for
// water droplets of a lognormal distribution of sizes.
struct DropletLobe {
  HenyeyGreensteinLobe peak;
  DraineLobe rest;
  double draine_share = 0;

  // `diameter` of the droplets in micrometres, 0 < diameter <= 50: equations 7 to 10 of the paper for 5 and
  // more, and 11 to 22 of its supplement below.
  static DropletLobe of_diameter(double diameter);
  double density(const ScatteringAngle& angle) const;
  ScatteringAngle sample(double u) const;
};

// Fournier and Forand 1994, in the form of Fournier and Jonasz 1999, "Computer-based underwater imaging
// analysis": particles in water whose sizes follow a power law. The function is infinite straight on. Here
// the light scattered by less than 5.4e-6 rad, where x is below kLeast, is spread evenly over these angles.
class FournierForandLobe {
 public:
  static constexpr double kLeast = 0x1p-36;

  // backscatter: the share of the light that is scattered by more than 90 degrees, in (0, 0.5]. ior: the
  // index of refraction of the particles relative to the water, above 1.
  FournierForandLobe(double backscatter, double ior);
  double density(const ScatteringAngle& angle) const;
  ScatteringAngle sample(double u) const;

 private:
  // The share of light scattered by less than the angle of x, and its derivative.
  struct Share {
    double below, slope;
  };
  Share share(double x) const;

  double delta_of_x_;   // delta in the papers is this times x
  double power_;        // -nu in the papers, in (0, 1]
  double at_back_ = 0;  // (delta^power - 1) / (delta - 1) straight back
  double peak_ = 0;     // the share of light below kLeast
};

// Values at some angles, linear in the cosine between them, for one colour or for each.
class TabulatedLobe {
 public:
  // cosines: ascending from -1 to 1, at least two. values: the same number for each of one or three colours;
  // not negative, and not all zero in a colour. The values are scaled so that each colour's integral is 1.
  TabulatedLobe(std::span<const double> cosines, std::span<const std::vector<double>> values);

  C3 value(const ScatteringAngle& angle) const;
  double density(const ScatteringAngle& angle) const;
  ScatteringAngle sample(double u) const;

 private:
  struct Colour {
    std::vector<double> value, below;  // at each x: the phase function, and the share of light below x
  };
  std::size_t cell_of(double x) const;
  double at(const Colour& colour, std::size_t cell, double x) const;

  std::vector<double> x_;
  std::vector<Colour> colours_;
};

// The mixture (1 - weight) first + weight second, of phase functions of the same list. The weight is
// constant, or that of a grid at the place of scattering.
struct BlendedLobes {
  float weight = .5f;
  const Grid* grid = nullptr;
  std::uint32_t first = 0, second = 0;
};

// The phase functions of a scene; they refer to each other by their places in the list.
class PhaseFunctions {
 public:
  using Kind = std::variant<HenyeyGreensteinLobe, RayleighLobe, DraineLobe, DropletLobe, FournierForandLobe,
                            TabulatedLobe, BlendedLobes>;
  struct Value {
    C3 value{0, 0, 0};  // the phase function, by colour [1/sr]
    float pdf = 0;      // the density with which sample() finds the direction [1/sr]: the mean of the colours
  };
  struct Sample {
    V3 w;
    Value of;
  };

  void add(Kind kind) { kinds_.push_back(std::move(kind)); }
  // To be called once all are added.
  void find_mean_cosines();
  // p: the place of scattering. w, w1: the directions of travel before and after.
  Value value(std::uint32_t which, const V3& p, const V3& w, const V3& w1) const;
  Sample sample(std::uint32_t which, const V3& p, const V3& w, V2 u) const;
  // The mean cosine of the scattering angle, to about 1e-3; where a grid blends, that of equal parts.
  double mean_cosine(std::uint32_t which) const { return *mean_cosines_[which]; }

 private:
  double find_mean_cosine(std::uint32_t which);
  void add_value(std::uint32_t which, const V3& p, const ScatteringAngle& angle, float share,
                 Value& sum) const;
  ScatteringAngle sample_angle(std::uint32_t which, const V3& p, double u) const;

  std::vector<Kind> kinds_;
  std::vector<std::optional<double>> mean_cosines_;
};

}  // namespace ls::render

// A scalar field that is computed wherever it is looked up: noise, clouds, fog by height, and products and
// maps of these and of grids. Its parts are a closed set of kinds. Each kind can also bound its values in a
// box, and bounds of the whole follow from those of its parts by interval arithmetic. A Grid (grid.h) with a
// field in place of stored values has these bounds in its macro cells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <variant>
#include <vector>

#include "worker/render/math/math.h"
#include "worker/render/math/transform.h"
#include "worker/render/media/cloud.h"
#include "worker/render/media/grid.h"
#include "worker/render/media/height_fog.h"
#include "worker/render/media/noise.h"

namespace ls::render {

// A piecewise linear curve through at least two points; constant beyond the first and the last.
class Curve {
 public:
  Curve(std::vector<double> x, std::vector<double> y) : x_(std::move(x)), y_(std::move(y)) {}
  double at(double x) const;
  // Bounds the values between a and b, where a <= b.
  void bound(double a, double b, double& least, double& most) const;

 private:
  std::vector<double> x_, y_;
};

class Field {
 public:
  // The kinds of parts. The affine maps lead from the field's coordinates to the part's own.
  struct Constant {
    float value;
  };
  struct Stored {  // 0 outside of the grid's domain
    Affine to_own;
    Grid grid;
  };
  struct Falling {
    float value;            // at the ground
    HeightProfile profile;  // in the field's coordinates
  };
  struct Noisy {  // max(0, middle + span * noise)
    Affine to_own;
    FractalNoise noise;
    float middle, span;
  };
  struct Cloudy {
    Affine to_own;
    Cloud cloud;
  };
  struct Product {
    std::size_t first, second;  // numbers of earlier parts; so too below
  };
  struct Mapped {
    std::size_t of;
    double in_low, in_high, gamma;
    std::vector<Curve> curve;  // none or one
    double out_low, out_high;
  };
  using Part = std::variant<Constant, Stored, Falling, Noisy, Cloudy, Product, Mapped>;

  // The last of the parts is the field.
  explicit Field(std::vector<Part> parts);

  // Returns the value, at least 0, at coordinates of the field.
  float value(const V3& p) const { return value_of(parts_.back(), V3d(p)); }
  // Bounds the values in the box [lo, hi].
  ValueBounds bounds(const V3d& lo, const V3d& hi) const { return bounds_of(parts_.back(), lo, hi); }
  std::uint64_t bytes() const;
  // The size of the finest cell of noise or voxel of a grid in any part; infinite if there are none.
  double finest() const { return finest_; }

 private:
  float value_of(const Part& part, const V3d& p) const;
  ValueBounds bounds_of(const Part& part, const V3d& lo, const V3d& hi) const;

  std::vector<Part> parts_;
  double finest_;
};

}  // namespace ls::render

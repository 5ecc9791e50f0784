// Cells of directions, or of a square; the integral of a density over each cell, and the samples that fall
// into it.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "worker/render/math/math.h"

namespace ls::test {

// Cells about an axis: `rows` of equal solid angle, by 1 - cos of the angle to the axis, from 0 to `reach`
// (2: all directions); `columns` in azimuth. Directions outside of these count in an additional last cell, as
// do samples that fail.
class SphereCells {
 public:
  SphereCells(const render::V3& axis, double reach, int rows, int columns)
      : s_(1, 0, 0), n_(render::V3d(axis).normalized()), reach_(reach), rows_(rows), columns_(columns) {
    const render::V3d other = std::abs(n_.x) < .7 ? render::V3d(1, 0, 0) : render::V3d(0, 1, 0);
    s_ = n_.cross(other).normalized();
    t_ = n_.cross(s_);
  }
  std::size_t size() const { return static_cast<std::size_t>(rows_) * columns_ + 1; }

  // Uses the chord to the axis, |w - n|^2 = 2 (1 - cos), which is accurate for narrow cones, too.
  std::size_t of(const render::V3& w) const {
    const render::V3d v(w), chord = v - n_;
    const double x = .5 * chord.dot(chord) / reach_;
    if (!(x < 1)) return reach_ >= 2 && x < 1.001 ? cell(rows_ - 1, azimuth(v)) : size() - 1;
    return cell(std::min(rows_ - 1, static_cast<int>(x * rows_)), azimuth(v));
  }
  // Returns the probability of each cell and, as the last element, that of all other directions. The density
  // is summed up over `grid` x `grid` points in each cell. From one column of points to the next they are
  // shifted by the golden ratio times a step, so that an edge of the density along a row does not hit or miss
  // a whole row of points.
  std::vector<double> masses(const std::function<double(const render::V3&)>& pdf, int grid) const {
    std::vector<double> p(size(), 0);
    const double steps = double{1} * rows_ * grid, turns = double{1} * columns_ * grid;
    const double piece = 2 * M_PI * reach_ / steps / turns;
    double all = 0;
    for (int i = 0; i < rows_ * grid; ++i)
      for (int j = 0; j < columns_ * grid; ++j) {
        const double golden = .6180339887498949 * (j + .5),
                     x = (i + golden - std::floor(golden)) / steps * reach_;
        const double sine = std::sqrt(std::max(0., x * (2 - x))), phi = (j + .5) / turns * 2 * M_PI;
        const render::V3d w = s_ * (sine * std::cos(phi)) + t_ * (sine * std::sin(phi)) + n_ * (1 - x);
        const double mass = pdf(render::V3(w)) * piece;
        p[static_cast<std::size_t>(i / grid) * columns_ + j / grid] += mass;
        all += mass;
      }
    p.back() = std::max(0., 1 - all);
    total_ = all;
    return p;
  }
  // Integral of the density over the cells, from the most recent call of masses().
  double total() const { return total_; }

 private:
  double azimuth(const render::V3d& v) const {
    const double a = std::atan2(v.dot(t_), v.dot(s_)) / (2 * M_PI);
    return a < 0 ? a + 1 : a;
  }
  std::size_t cell(int row, double turn) const {
    return static_cast<std::size_t>(row) * columns_ +
           std::min(columns_ - 1, static_cast<int>(turn * columns_));
  }

  render::V3d s_, t_, n_;
  double reach_;
  int rows_, columns_;
  mutable double total_ = 0;
};

inline std::vector<double> counts(const std::vector<double>& probabilities, double samples) {
  std::vector<double> n = probabilities;
  for (double& x : n) x *= samples;
  return n;
}

}  // namespace ls::test

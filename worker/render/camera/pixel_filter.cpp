#include "worker/render/camera/pixel_filter.h"

#include <algorithm>
#include <cmath>

#include "common/base/overloaded.h"

namespace ls::render {

PixelFilter::PixelFilter(const ReconstructionFilter& filter) {
  std::visit(
      overloaded{[&](const BoxFilter& f) { radius_ = f.radius; },
                 [&](const TentFilter& f) {
                   kind_ = Kind::tent;
                   radius_ = f.radius;
                 },
                 [&](const GaussianFilter& f) {
                   kind_ = Kind::table;
                   radius_ = 4 * f.stddev;
                   // With steps of radius / 512 the error of linear interpolation in the CDF is below 4e-6.
                   constexpr int kSteps = 1024;
                   const double a = -1 / (2 * f.stddev * f.stddev), edge = std::exp(a * radius_ * radius_);
                   const auto value = [&](double x) { return std::max(0., std::exp(a * x * x) - edge); };
                   cdf_.assign(kSteps + 1, 0);
                   for (int i = 0; i < kSteps; ++i) {
                     const double x0 = radius_ * (2. * i / kSteps - 1), h = 2 * radius_ / kSteps;
                     cdf_[i + 1] = cdf_[i] + h / 6 * (value(x0) + 4 * value(x0 + h / 2) + value(x0 + h));
                   }
                   for (double& c : cdf_) c /= cdf_.back();
                 }},
      filter);
}

double PixelFilter::offset(float u) const {
  switch (kind_) {
    case Kind::box:
      return radius_ * (2. * u - 1);
    case Kind::tent: {
      const double v = 2. * u;
      return radius_ * (v < 1 ? std::sqrt(v) - 1 : 1 - std::sqrt(2 - v));
    }
    case Kind::table:
      break;
  }
  const auto it = std::upper_bound(cdf_.begin() + 1, cdf_.end() - 1, static_cast<double>(u));
  const auto i = static_cast<double>(it - cdf_.begin() - 1);
  const double width = *it - *(it - 1);
  const double f = width > 0 ? (u - *(it - 1)) / width : .5;
  return radius_ * (2 * (i + f) / static_cast<double>(cdf_.size() - 1) - 1);
}

}  // namespace ls::render

#include "common/image/reference/flip_filters.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ls::flip {
namespace {

using Plane = std::vector<float>;
using Kernel = std::vector<float>;  // of odd length; the middle element is the weight of the pixel itself

constexpr double kPi = std::numbers::pi;

// Computes out[x] = sum over i of kernel[i] in[x + i - radius] along rows; values at the ends are repeated.
Plane along_rows(const Plane& in, FrameSize size, const Kernel& kernel) {
  const auto width = static_cast<std::size_t>(size.width), radius = kernel.size() / 2;
  Plane out(in.size()), padded(width + 2 * radius);
  for (std::size_t y = 0; y < static_cast<std::size_t>(size.height); ++y) {
    const float* row = &in[y * width];
    std::fill_n(padded.begin(), radius, row[0]);
    std::copy_n(row, width, padded.begin() + static_cast<std::ptrdiff_t>(radius));
    std::fill_n(padded.end() - static_cast<std::ptrdiff_t>(radius), radius, row[width - 1]);
    float* to = &out[y * width];
    for (std::size_t i = 0; i < kernel.size(); ++i)
      for (std::size_t x = 0; x < width; ++x) to[x] += kernel[i] * padded[x + i];
  }
  return out;
}

Plane along_columns(const Plane& in, FrameSize size, const Kernel& kernel) {
  const auto width = static_cast<std::size_t>(size.width);
  const int radius = static_cast<int>(kernel.size() / 2);
  Plane out(in.size());
  for (int y = 0; y < size.height; ++y) {
    float* to = &out[static_cast<std::size_t>(y) * width];
    for (int i = -radius; i <= radius; ++i) {
      const float* row = &in[static_cast<std::size_t>(std::clamp(y + i, 0, size.height - 1)) * width];
      const float weight = kernel[static_cast<std::size_t>(i + radius)];
      for (std::size_t x = 0; x < width; ++x) to[x] += weight * row[x];
    }
  }
  return out;
}

// A term of the contrast sensitivity filter, a sqrt(pi / b) exp(-pi^2 x^2 / b) with x in degrees; it is
// applied along both axes.
struct Sensitivity {
  double a, b;
};
constexpr std::array<std::array<Sensitivity, 2>, 3> kSensitivity = {
    {{{{1, .0047}, {0, 1e-5}}}, {{{1, .0053}, {0, 1e-5}}}, {{{34.1, .04}, {13.5, .025}}}}};

int contrast_radius(double ppd) {
  constexpr double kWidest = .04;
  return static_cast<int>(std::ceil(3 * std::sqrt(kWidest / (2 * kPi * kPi)) * ppd));
}

Kernel gaussian(double b, int radius, double ppd) {
  Kernel out;
  for (int x = -radius; x <= radius; ++x)
    out.push_back(static_cast<float>(std::exp(-kPi * kPi * (x / ppd) * (x / ppd) / b)));
  return out;
}

Plane filtered(const Plane& in, FrameSize size, const std::array<Sensitivity, 2>& of, double ppd) {
  const int radius = contrast_radius(ppd);
  Plane sum(in.size());
  double whole = 0;
  std::array<double, 2> level{};
  std::array<Kernel, 2> kernels;
  for (std::size_t k = 0; k < 2; ++k) {
    level[k] = of[k].a * std::sqrt(kPi / of[k].b);
    kernels[k] = gaussian(of[k].b, radius, ppd);
    double line = 0;
    for (const float v : kernels[k]) line += v;
    whole += level[k] * line * line;
  }
  for (std::size_t k = 0; k < 2; ++k) {
    if (level[k] == 0) continue;
    const Plane part = along_columns(along_rows(in, size, kernels[k]), size, kernels[k]);
    const auto weight = static_cast<float>(level[k] / whole);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += weight * part[i];
  }
  return sum;
}

// Filters for features: a Gaussian of a feature's width, and its derivatives ([LDR] section 4.2). The
// derivatives are normalised over the window, so that positive weights sum to 1 and negative ones to -1.
struct FeatureKernels {
  Kernel across;       // the Gaussian, for the axis across the derivative; sums to 1
  Kernel edge, point;  // first and second derivative
};

void balance(Kernel& kernel) {
  double positive = 0, negative = 0;
  for (const float v : kernel) (v > 0 ? positive : negative) += v;
  for (float& v : kernel) v = static_cast<float>(v > 0 ? v / positive : -v / negative);
}

FeatureKernels feature_kernels(double ppd) {
  constexpr double kWidth = .082;  // width of a feature in degrees
  const double sigma = .5 * kWidth * ppd;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  FeatureKernels out;
  double sum = 0;
  for (int x = -radius; x <= radius; ++x) sum += std::exp(-x * x / (2 * sigma * sigma));
  for (int x = -radius; x <= radius; ++x) {
    const double g = std::exp(-x * x / (2 * sigma * sigma));
    out.across.push_back(static_cast<float>(g / sum));
    out.edge.push_back(static_cast<float>(-x * g));
    out.point.push_back(static_cast<float>((x * x / (sigma * sigma) - 1) * g));
  }
  balance(out.edge);
  balance(out.point);
  return out;
}

Plane strength(const Plane& grey, FrameSize size, const Kernel& along, const Kernel& across) {
  const Plane x = along_columns(along_rows(grey, size, along), size, across),
              y = along_columns(along_rows(grey, size, across), size, along);
  Plane out(grey.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = std::sqrt(x[i] * x[i] + y[i] * y[i]);
  return out;
}

}  // namespace

Planes contrast_filtered(const Planes& image, float pixels_per_degree) {
  Planes out(image.size());
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = filtered(image[c], image.size(), kSensitivity[c], pixels_per_degree);
  return out;
}

std::vector<float> feature_difference(const Planes& reference, const Planes& image, float pixels_per_degree) {
  const FeatureKernels kernels = feature_kernels(pixels_per_degree);
  const auto grey = [](const Planes& planes) {
    Plane out = planes[0];
    for (float& v : out) v = (v + 16) / 116;
    return out;
  };
  const Plane r = grey(reference), t = grey(image);
  Plane out(r.size());
  for (const Kernel* along : {&kernels.edge, &kernels.point}) {
    const Plane a = strength(r, reference.size(), *along, kernels.across),
                b = strength(t, image.size(), *along, kernels.across);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = std::max(out[i], std::abs(a[i] - b[i]));
  }
  return out;
}

}  // namespace ls::flip

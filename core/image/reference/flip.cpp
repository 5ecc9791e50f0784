#include "core/image/reference/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/check.h"

namespace ls {
namespace {

// [LDR] and [HDR] below are the papers listed in flip.h.

// ---- spatial filters: each is a sum of separable filters ----

class Planes {  // three planes: Y, Cx, Cz
 public:
  explicit Planes(FrameSize size) : size_(size) {
    for (auto& plane : planes_) plane.resize(pixels());
  }
  FrameSize size() const { return size_; }
  std::size_t pixels() const { return size_.pixels(); }
  std::vector<float>& operator[](std::size_t i) { return planes_[i]; }
  const std::vector<float>& operator[](std::size_t i) const { return planes_[i]; }

 private:
  FrameSize size_;
  std::array<std::vector<float>, 3> planes_;
};

using Plane = std::vector<float>;
// The weights of a filter. Their number is odd; the middle one is the weight of the pixel itself.
using Kernel = std::vector<float>;

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

// A term of the contrast sensitivity filter, a sqrt(pi / b) exp(-pi^2 x^2 / b), where x is the distance in
// degrees. The Gaussian is applied along both axes of the image.
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

// Filters that detect features, namely edges and points ([LDR] section 4.2): a Gaussian of the width of a
// feature, and its derivatives. The weights of the derivatives are normalised, so that the positive ones sum
// to 1 and the negative ones to -1.
struct FeatureKernels {
  // The Gaussian, applied along the axis at right angles to a derivative. Its weights sum to 1.
  Kernel across;
  Kernel edge, point;  // the first and the second derivative of the Gaussian
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

// Returns the image with every plane filtered by the contrast sensitivity function ([LDR] equations (3), (4),
// table 1).
Planes contrast_filtered(const Planes& image, float pixels_per_degree) {
  Planes out(image.size());
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = filtered(image[c], image.size(), kSensitivity[c], pixels_per_degree);
  return out;
}

// Returns the difference in features for each pixel, max(|edge_r - edge_t|, |point_r - point_t|): the
// strengths of edges and points in the reference (r) and in the image (t), found in the first plane (Y) of
// each ([LDR] equations (10) to (12)).
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

// ---- colours ----

// Matrices between linear RGB (Rec. 709 primaries, D65 white) and CIE XYZ, and the white point D65 in XYZ.
constexpr float kToXyz[3][3] = {{10135552.F / 24577794.F, 8788810.F / 24577794.F, 4435075.F / 24577794.F},
                                {2613072.F / 12288897.F, 8788810.F / 12288897.F, 887015.F / 12288897.F},
                                {1425312.F / 73733382.F, 8788810.F / 73733382.F, 70074185.F / 73733382.F}};
constexpr float kToRgb[3][3] = {{3.241003275F, -1.537398934F, -0.498615861F},
                                {-0.969224334F, 1.875930071F, 0.041554224F},
                                {0.055639423F, -0.204011202F, 1.057148933F}};
constexpr float kWhite[3] = {0.950428545F, 1.F, 1.088900371F};

// Constants of [LDR]: the exponents q_c of colour differences and q_f of feature differences, and the knee of
// the mapping in redistributed(): the fraction kPc of the largest difference becomes the error kPt.
constexpr float kQc = .7F, kPc = .4F, kPt = .95F, kQf = .5F;

using Triple = std::array<float, 3>;

Triple times(const float (&m)[3][3], const Triple& v) {
  Triple out{};
  for (std::size_t i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return out;
}

float shown(float v) { return v > 0 ? std::min(v, 1.F) : 0.F; }  // clamps to [0, 1]; NaN becomes 0

// Returns the colour in linearised CIELAB, the space in which contrast sensitivity is defined ([LDR] equation
// (2)).
Triple opponent(const Triple& rgb) {
  Triple n = times(kToXyz, rgb);
  for (std::size_t i = 0; i < 3; ++i) n[i] /= kWhite[i];
  return {116 * n[1] - 16, 500 * (n[0] - n[1]), 200 * (n[1] - n[2])};
}

Triple rgb_of(const Triple& yc) {
  const float y = (yc[0] + 16) / 116, x = yc[1] / 500 + y, z = y - yc[2] / 200;
  return times(kToRgb, {x * kWhite[0], y * kWhite[1], z * kWhite[2]});
}

Triple lab(const Triple& rgb) {
  constexpr float kDelta = 6.F / 29;
  Triple f = times(kToXyz, rgb);
  for (std::size_t i = 0; i < 3; ++i) {
    const float t = f[i] / kWhite[i];
    f[i] = t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.F / 29;
  }
  return {116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
}

// Adjusts a CIELAB colour for the Hunt effect (Hunt 1952): differences in hue are less visible in dark
// colours, so a and b are scaled in proportion to the lightness ([LDR] equation (6)).
Triple hunt(Triple v) {
  v[1] *= .01F * v[0];
  v[2] *= .01F * v[0];
  return v;
}

// Returns the HyAB distance of two CIELAB colours: the difference in lightness plus the Euclidean distance in
// a and b (Abasi, Tehran and Fairchild 2020; [LDR] equation (7)).
float hyab(const Triple& a, const Triple& b) {
  return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

// Maps a colour difference to an error in [0, 1]. Large differences are compressed into the range above kPt
// ([LDR] equations (8), (9)). `largest` is the largest possible value of difference^kQc.
float redistributed(float difference, float largest) {
  const float e = std::pow(difference, kQc), bend = kPc * largest;
  return e < bend ? kPt / bend * e : kPt + (e - bend) / (largest - bend) * (1 - kPt);
}

Planes opponents(const FlipImage& image) {
  Planes out(image.size);
  for (std::size_t i = 0; i < out.pixels(); ++i) {
    const float* p = &image.rgb[3 * i];
    const Triple yc = opponent({shown(p[0]), shown(p[1]), shown(p[2])});
    for (std::size_t c = 0; c < 3; ++c) out[c][i] = yc[c];
  }
  return out;
}

// Returns the colour of pixel number `i` as it appears at the viewing distance: in CIELAB, adjusted by
// hunt(). `filtered` is the result of contrast_filtered().
Triple seen(const Planes& filtered, std::size_t i) {
  Triple rgb = rgb_of({filtered[0][i], filtered[1][i], filtered[2][i]});
  for (float& v : rgb) v = shown(v);
  return hunt(lab(rgb));
}

// Coefficients k of the tone curve (k0 v^2 + k1 v + k2) / (k3 v^2 + k4 v + k5) of [HDR] section 3. It is the
// fit of Narkowicz 2015 to the ACES curve, with its factor of 0.6 on v included.
constexpr float kTone[6] = {.6F * .6F * 2.51F, .6F * .03F, 0, .6F * .6F * 2.43F, .6F * .59F, .14F};

float tone_mapped(float v) {
  if (!(v > 0)) return 0;
  if (!std::isfinite(v)) return 1;
  // Limits v, since the squares of larger values would overflow. This does not change the result: for all
  // such v the curve is above 1, and shown() makes it 1.
  v = std::min(v, 1e15F);
  return shown((kTone[0] * v * v + kTone[1] * v + kTone[2]) / (kTone[3] * v * v + kTone[4] * v + kTone[5]));
}

float luminance(const float* rgb) {
  const auto clean = [](float v) { return v > 0 && std::isfinite(v) ? v : 0.F; };
  return kToXyz[1][0] * clean(rgb[0]) + kToXyz[1][1] * clean(rgb[1]) + kToXyz[1][2] * clean(rgb[2]);
}

std::vector<float> exposed(std::span<const float> rgb, float stops) {
  const float scale = std::exp2(stops);
  std::vector<float> out(rgb.size());
  for (std::size_t i = 0; i < rgb.size(); ++i)
    out[i] = std::isfinite(rgb[i]) ? tone_mapped(rgb[i] * scale) : 0.F;
  return out;
}

}  // namespace

std::vector<float> ldr_flip(const FlipImage& reference, const FlipImage& image, float pixels_per_degree) {
  const auto pixels = reference.size.pixels();
  CHECK(reference.size == image.size && reference.rgb.size() == 3 * pixels && image.rgb.size() == 3 * pixels,
        "{} and {} values for {} pixels", reference.rgb.size(), image.rgb.size(), pixels);
  const Planes r = opponents(reference), t = opponents(image);
  const std::vector<float> features = feature_difference(r, t, pixels_per_degree);
  const Planes rf = contrast_filtered(r, pixels_per_degree), tf = contrast_filtered(t, pixels_per_degree);
  const float largest = std::pow(hyab(hunt(lab({0, 1, 0})), hunt(lab({0, 0, 1}))), kQc);
  std::vector<float> out(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const float colour = redistributed(hyab(seen(rf, i), seen(tf, i)), largest);
    // The colour and feature errors are combined by [LDR] equations (12) to (14).
    const float feature = std::pow(features[i] * static_cast<float>(1 / std::numbers::sqrt2), kQf);
    out[i] = std::pow(colour, 1 - feature);
  }
  return out;
}

FlipExposures flip_exposures(std::span<const float> rgb) {
  std::vector<float> light;
  for (std::size_t i = 0; i + 2 < rgb.size(); i += 3)
    if (const float y = luminance(&rgb[i]); y > 0) light.push_back(y);
  if (light.empty()) return {};
  const auto middle = light.begin() + static_cast<std::ptrdiff_t>(light.size() / 2);
  std::nth_element(light.begin(), middle, light.end());
  const float median = *middle, most = *std::max_element(light.begin(), light.end());
  // Computes x, the luminance that the tone curve maps to kLevel, the level used in [HDR]. It is the larger
  // solution of the equation a x^2 + b x + c = 0.
  constexpr float kLevel = .85F;
  const float a = kTone[0] - kLevel * kTone[3], b = kTone[1] - kLevel * kTone[4],
              c = kTone[2] - kLevel * kTone[5];
  const float x = (-b + std::sqrt(b * b - 4 * a * c)) / (2 * a);
  FlipExposures out{std::log2(x / most), std::log2(x / median), 2};
  // Largest number of exposures, about one per stop: more than the range of any sensible image.
  constexpr int kMost = 64;
  out.count = std::clamp(static_cast<int>(std::ceil(out.last - out.first)), 2, kMost);
  return out;
}

std::vector<float> hdr_flip(const FlipImage& reference, const FlipImage& image, float pixels_per_degree) {
  const FlipExposures exposures = flip_exposures(reference.rgb);
  std::vector<float> out;
  for (int i = 0; i < exposures.count; ++i) {
    const std::vector<float> r = exposed(reference.rgb, exposures.at(i)),
                             t = exposed(image.rgb, exposures.at(i));
    const std::vector<float> error = ldr_flip({reference.size, r}, {image.size, t}, pixels_per_degree);
    if (i == 0) out = error;
    for (std::size_t p = 0; p < out.size(); ++p) out[p] = std::max(out[p], error[p]);
  }
  return out;
}

double mean_of(std::span<const float> values) {
  double sum = 0;
  for (const float v : values) sum += v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

}  // namespace ls

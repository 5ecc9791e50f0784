#include "core/image/exr/deep_samples.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "core/image/aov/deep_planes.h"
#include "core/image/exr/final_image.h"

namespace ls {
namespace {

// The half below 1. An alpha that is not 1 is not rounded to 1 if there is light behind it.
constexpr float kHalfBelowOne = 1 - 0x1p-11f;

// Transmittances are float32 sums, so two of them that are equal can differ by this much. A slice without
// light that takes no more is empty.
constexpr float kNoAlpha = 0x1p-22f;

bool is_black(const std::array<double, 3>& c) { return c[0] == 0 && c[1] == 0 && c[2] == 0; }

// Builds the samples of a pixel from the front to the back.
class SamplesBuilder {
 public:
  explicit SamplesBuilder(bool halves)
      : halves_(halves), most_(halves ? double{kLargestHalf} : double{std::numeric_limits<float>::max()}) {}

  // Adds a slice with this light. The light that gets through everything up to its end has the share
  // `through`. `more_behind` is true if there is light behind it.
  void add(double z, double z_back, bool surface, const std::array<double, 3>& light, double through,
           bool more_behind) {
    const float alpha = alpha_towards(through, left_, more_behind);
    if (is_black(light) && alpha < kNoAlpha) return;
    if (!samples_.empty() && !fits(light, left_)) return join(z_back, light, through, more_behind);
    DeepSample sample{as_float(z), as_float(surface ? z : z_back), alpha, {}};
    if (!samples_.empty()) sample.z = std::max(sample.z, samples_.back().z_back);
    sample.z_back = std::max(sample.z, sample.z_back);
    // The least thickness. Where OpenImageIO 2.4 cuts fog at the depth of a surface, it puts a surface
    // without thickness behind the piece of fog that begins there.
    if (surface) sample.z_back = std::nextafter(sample.z, std::numeric_limits<float>::max());
    before_ = left_;
    light_ = light;
    is_surface_ = surface;
    left_ *= 1 - double{alpha};
    set_colour(sample);
    samples_.push_back(sample);
  }

  std::vector<DeepSample> take() { return std::move(samples_); }

 private:
  static float as_float(double x) {
    constexpr double kMost = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(x, 0.0, kMost));
  }
  float stored(double x) const {
    const auto value = static_cast<float>(std::clamp(x, -most_, most_));
    return (halves_ ? as_half(value) : value) + 0.f;  // adding 0 turns -0 into +0
  }
  // Returns the alpha of a sample, rounded as in the file, behind which the share `through` of the light
  // gets on, of the share `left` that gets to it.
  float alpha_towards(double through, double left, bool more_behind) const {
    if (!(left > 0)) return 0;
    const double exact = std::clamp(1 - through / left, 0.0, 1.0);
    float alpha = std::min(1.f, stored(exact));
    if (alpha == 1 && exact < 1 && more_behind) alpha = halves_ ? kHalfBelowOne : 1 - 0x1p-24f;
    return alpha;
  }
  // True if this light, divided by the share of it that gets to the camera, can be stored.
  bool fits(const std::array<double, 3>& light, double share) const {
    return std::ranges::all_of(light, [&](double c) { return c == 0 || std::abs(c) <= most_ * share; });
  }
  void set_colour(DeepSample& sample) const {
    for (std::size_t c = 0; c < 3; ++c) sample.rgb[c] = light_[c] == 0 ? 0.f : stored(light_[c] / before_);
  }
  void join(double z_back, const std::array<double, 3>& light, double through, bool more_behind) {
    DeepSample& last = samples_.back();
    for (std::size_t c = 0; c < 3; ++c) light_[c] += light[c];
    last.alpha = alpha_towards(through, before_, more_behind);
    if (!is_surface_) last.z_back = std::max(last.z_back, as_float(z_back));
    left_ = before_ * (1 - double{last.alpha});
    set_colour(last);
  }

  bool halves_;
  double most_;
  std::vector<DeepSample> samples_;
  // The share of the light from behind the last sample that gets to the camera, and of the light from itself
  double left_ = 1, before_ = 1;
  std::array<double, 3> light_{0, 0, 0};  // of the last sample
  bool is_surface_ = false;               // of the last sample
};

}  // namespace

std::vector<DeepSample> deep_samples(const DeepPixel& pixel, bool halves) {
  const std::size_t records = pixel.edges.size();
  if (records == 0) return {};
  constexpr std::array<double, 3> kBlack{0, 0, 0};
  // In grids a transmittance has noise and can grow on the way. The largest that follows takes its place, so
  // that the last one, which is that of the AOV alpha, stays as it is.
  std::vector<double> through(records);
  double largest = 0;
  for (std::size_t i = records; i-- > 0;)
    through[i] = largest = std::clamp(std::max(largest, pixel.transmittance[i]), 0.0, 1.0);
  std::vector<bool> light_behind(records, false);
  for (std::size_t i = records - 1; i-- > 0 && !pixel.light.empty();)
    light_behind[i] = light_behind[i + 1] || !is_black(pixel.light[i + 1]);
  SamplesBuilder builder(halves);
  double from = 0;
  for (std::size_t i = 0; i < records; ++i) {
    const bool far = i + 1 == records;
    from = std::max(from, std::abs(pixel.edges[i]));
    const double begin = far ? std::max(from, kDeepFar) : from;
    const double end = far ? begin : std::max(from, std::abs(pixel.edges[i + 1]));
    builder.add(begin, end, !far && pixel.edges[i] < 0, pixel.light.empty() ? kBlack : pixel.light[i],
                through[i], light_behind[i]);
  }
  return builder.take();
}

}  // namespace ls

#include "core/image/reference/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/image/error/error_estimate.h"

namespace ls {
namespace {

tl::unexpected<Error> refuse(const std::string& name, std::string why) {
  return bad_argument(fmt::format("{}: {}", name, why));
}

// Returns the mean of s^2 (the squared standard error of the reference) over the up to eight neighbouring
// pixels of value number i, in the same channel.
double noise_around(const Reference& r, std::size_t i) {
  const auto width = static_cast<std::size_t>(r.size.width), height = static_cast<std::size_t>(r.size.height);
  const std::size_t channel = i % 3, x = i / 3 % width, y = i / 3 / width;
  double sum = 0;
  int count = 0;
  for (std::size_t v = y - (y > 0); v <= std::min(height - 1, y + 1); ++v)
    for (std::size_t u = x - (x > 0); u <= std::min(width - 1, x + 1); ++u) {
      if (u == x && v == y) continue;
      const double s = r.error[3 * (v * width + u) + channel];
      sum += s * s;
      ++count;
    }
  return count > 0 ? sum / count : 0;
}

// Returns the weight h (reference.h) of value number i.
double weight(const Reference& r, std::size_t i) {
  const double value = r.rgb[i];
  if (r.error.empty()) return relative_weight(value, 0);
  const double s = r.error[i], of_half = 2 * noise_around(r, i);
  return (relative_weight(value + s, of_half) + relative_weight(value - s, of_half)) / 2;
}

}  // namespace

Result<Reference> read_reference(std::span<const std::byte> exr, const std::string& name, FrameSize size,
                                 const ExrLimits& limits) {
  auto read = read_exr_with_error(exr, name, limits);
  if (!read) return tl::unexpected(read.error());
  const RgbImage& image = read->image;
  if (image.size != size)
    return refuse(name, fmt::format("it is {} x {}, the image {} x {}: they must have one size",
                                    image.size.width, image.size.height, size.width, size.height));
  const auto bad =
      std::count_if(image.rgb.begin(), image.rgb.end(), [](float v) { return !std::isfinite(v); });
  if (bad > 0) return refuse(name, fmt::format("{} of its values are NaN or infinite", bad));
  if (std::any_of(read->error.begin(), read->error.end(), [](float v) { return !(v >= 0) || std::isinf(v); }))
    return refuse(name, "its layers stderr.R, stderr.G, stderr.B hold values that are no standard errors");
  return Reference{image.size,
                   std::move(read->image.rgb),
                   std::move(read->error),
                   {read->strings["lightshaft:scene"], read->strings["lightshaft:seed"]}};
}

bool same_noise(const ReferenceOrigin& origin, const Digest& scene, std::uint64_t seed) {
  return origin.scene == scene.hex() && origin.seed == std::to_string(seed);
}

ReferenceNoise noise_of(const Reference& reference) {
  ReferenceNoise out;
  for (std::size_t i = 0; i < reference.error.size(); ++i) {
    const double square = double{reference.error[i]} * reference.error[i];
    out.mse += square;
    out.relmse += square * weight(reference, i);
  }
  const auto values = static_cast<double>(std::max<std::size_t>(1, reference.rgb.size()));
  return {out.mse / values, out.relmse / values};
}

TrueError true_error(const Reference& reference, std::span<const float> rgb) {
  CHECK(rgb.size() == reference.rgb.size(), "an image of {} values, a reference of {}", rgb.size(),
        reference.rgb.size());
  const bool known = !reference.error.empty();
  double squares = 0, relative = 0, squares_variance = 0, relative_variance = 0;
  for (std::size_t pixel = 0; pixel < rgb.size(); pixel += 3) {
    // Sums over the channels of |x - ref| s and of h |x - ref| s (reference.h).
    double product = 0, weighted = 0;
    for (std::size_t i = pixel; i < pixel + 3; ++i) {
      const double d = double{rgb[i]} - reference.rgb[i], s = known ? reference.error[i] : 0;
      const double h = weight(reference, i);
      squares += d * d - s * s;
      relative += h * (d * d - s * s);
      product += std::abs(d) * s;
      weighted += h * std::abs(d) * s;
    }
    squares_variance += 4 * product * product;
    relative_variance += 4 * weighted * weighted;
  }
  const auto values = static_cast<double>(std::max<std::size_t>(1, rgb.size()));
  TrueError out{std::sqrt(std::max(0.0, squares / values)), std::max(0.0, relative / values)};
  if (known)
    out.mse_stderr = std::sqrt(squares_variance) / values,
    out.relmse_stderr = std::sqrt(relative_variance) / values;
  return out;
}

bool below_noise(double figure, const std::optional<double>& standard_error) {
  constexpr double kDetection = 3;
  return standard_error && !(figure > kDetection * *standard_error);
}

}  // namespace ls

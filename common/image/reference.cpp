#include "common/image/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace ls {
namespace {

constexpr double kDark = 0.01;  // of relMSE's denominator

tl::unexpected<Error> refuse(const std::string& name, std::string why) {
  return fail(Errc::invalid_argument, fmt::format("{}: {}", name, why));
}

double weight(float reference) { return 1 / (double{reference} * reference + kDark); }

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
  return Reference{image.size, std::move(read->image.rgb), std::move(read->error)};
}

ReferenceNoise noise_of(const Reference& reference) {
  ReferenceNoise out;
  for (std::size_t i = 0; i < reference.error.size(); ++i) {
    const double square = double{reference.error[i]} * reference.error[i];
    out.mse += square;
    out.relmse += square * weight(reference.rgb[i]);
  }
  const auto values = static_cast<double>(std::max<std::size_t>(1, reference.rgb.size()));
  return {out.mse / values, out.relmse / values};
}

TrueError true_error(const Reference& reference, std::span<const float> rgb) {
  CHECK(rgb.size() == reference.rgb.size(), "an image of {} values, a reference of {}", rgb.size(),
        reference.rgb.size());
  double squares = 0, relative = 0;
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    const double d = double{rgb[i]} - reference.rgb[i];
    squares += d * d;
    relative += d * d * weight(reference.rgb[i]);
  }
  const auto values = static_cast<double>(std::max<std::size_t>(1, rgb.size()));
  const ReferenceNoise noise = noise_of(reference);
  return {std::sqrt(std::max(0.0, squares / values - noise.mse)),
          std::max(0.0, relative / values - noise.relmse)};
}

}  // namespace ls

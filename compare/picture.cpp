#include "compare/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/image/exr/exr_file.h"

namespace ls::race {
namespace {

constexpr double kRelativeFloor = .01;

std::size_t values_of(FrameSize size) {
  return 3 * static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
}

}  // namespace

Result<void> keep(const std::filesystem::path& file, std::span<const float> pixels) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(pixels.data()), static_cast<std::streamsize>(pixels.size_bytes()));
  out.close();
  if (!out)
    return fail(Errc::resource_exhausted, fmt::format("cannot write {}: is the disk full?", file.string()));
  return {};
}

Result<Pixels> kept(const std::filesystem::path& file, FrameSize size) {
  Pixels pixels(values_of(size));
  std::ifstream in(file, std::ios::binary);
  in.read(reinterpret_cast<char*>(pixels.data()),
          static_cast<std::streamsize>(pixels.size() * sizeof(float)));
  if (!in) return fail(Errc::internal, fmt::format("cannot read {}", file.string()));
  return pixels;
}

Result<Pixels> read_picture(const std::filesystem::path& exr, FrameSize size) {
  const ExrLimits limits{.max_pixels = static_cast<std::uint64_t>(size.width) *
                                       static_cast<std::uint64_t>(size.height)};
  auto image = read_exr_rgb(exr, limits);
  if (!image) return tl::unexpected(image.error());
  if (image->size != size)
    return bad_argument(fmt::format("{} is {} x {} pixels, and the race is one of {} x {}", exr.string(),
                                    image->size.width, image->size.height, size.width, size.height));
  const auto bad =
      std::find_if(image->rgb.begin(), image->rgb.end(), [](float v) { return !std::isfinite(v); });
  if (bad != image->rgb.end()) {
    const auto count = std::count_if(bad, image->rgb.end(), [](float v) { return !std::isfinite(v); });
    const auto pixel = (bad - image->rgb.begin()) / 3;
    return bad_argument(fmt::format("{} has {} values that are NaN or infinite, the first in pixel {},{}",
                                    exr.string(), count, pixel % size.width, pixel / size.width));
  }
  return std::move(image->rgb);
}

Wrong wrong(std::span<const float> pixels, const Reference& reference) {
  const Pixels& second = reference.second.empty() ? reference.first : reference.second;
  Wrong sum;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const double x = pixels[i], a = reference.first[i], b = second[i], r = (a + b) / 2;
    const double square = (x - a) * (x - b);
    sum.mse += square;
    sum.relmse += square / (r * r + kRelativeFloor);
  }
  const auto n = static_cast<double>(pixels.size());
  return {sum.mse / n, sum.relmse / n};
}

double noise_of(const Reference& reference) {
  double sum = 0;
  for (std::size_t i = 0; i < reference.second.size(); ++i) {
    const double a = reference.first[i], b = reference.second[i], r = (a + b) / 2;
    sum += (a - b) * (a - b) / 4 / (r * r + kRelativeFloor);
  }
  return reference.second.empty() ? 0 : sum / static_cast<double>(reference.second.size());
}

Result<ReferenceFile> read_reference(const std::filesystem::path& exr, FrameSize size) {
  if (const auto sound = read_picture(exr, size); !sound) return tl::unexpected(sound.error());
  const auto bytes = read_exr_bytes(exr);
  if (!bytes) return tl::unexpected(bytes.error());
  auto picture = ls::read_reference(*bytes, exr.string(), size);
  if (!picture) return tl::unexpected(picture.error());
  return ReferenceFile{exr.filename().string(), std::move(*picture)};
}

Reference combine(const std::vector<ReferenceFile>& files) {
  Reference out{files[0].picture.rgb, {}};
  if (files.size() > 1) {
    out.second = files[1].picture.rgb;
    return out;
  }
  const std::vector<float>& error = files[0].picture.error;
  out.second.resize(error.size());
  for (std::size_t i = 0; i < error.size(); ++i) {
    out.second[i] = out.first[i] - error[i];
    out.first[i] += error[i];
  }
  return out;
}

std::string describe(const std::vector<ReferenceFile>& files) {
  if (files.size() > 1)
    return fmt::format("{} and {}, two independent references", files[0].name, files[1].name);
  if (files[0].picture.error.empty())
    return fmt::format("{}, whose own noise counts as everybody's error", files[0].name);
  return fmt::format("{}, less its own noise by its layers of errors", files[0].name);
}

}  // namespace ls::race

#include "common/image/exr/final_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "common/image/exr/exr_file.h"

namespace ls {
namespace {

// The addition turns -0 into +0 and changes no other value (in the rounding mode to nearest).
float pixel_value(double mean) { return static_cast<float>(mean) + 0.0f; }

struct Gathered {
  std::size_t width;
  std::vector<float> rgb[3], standard_error[3];
  std::vector<std::uint32_t> spp;
};

Gathered gather(const Film& film) {
  const FrameSize frame = film.grid().frame;
  const auto pixels = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  Gathered out{static_cast<std::size_t>(frame.width), {}, {}, std::vector<std::uint32_t>(pixels)};
  for (int c = 0; c < 3; ++c) out.rgb[c].resize(pixels), out.standard_error[c].resize(pixels);
  for (TileIndex t = 0; t < film.grid().count(); ++t) {
    if (film.spp(t) == 0) continue;
    const TilePixels tile = film.pixels(t);
    // A UINT layer cannot exceed 2^32 - 1; job limits are below that.
    const auto spp = static_cast<std::uint32_t>(
        std::min<std::uint64_t>(tile.spp, std::numeric_limits<std::uint32_t>::max()));
    std::size_t from = 0;
    for (int y = tile.rect.y0; y < tile.rect.y1; ++y) {
      for (int x = tile.rect.x0; x < tile.rect.x1; ++x, from += 3) {
        const std::size_t to = static_cast<std::size_t>(y) * out.width + static_cast<std::size_t>(x);
        for (std::size_t c = 0; c < 3; ++c) {
          out.rgb[c][to] = pixel_value(tile.mean[from + c]);
          out.standard_error[c][to] = static_cast<float>(tile.standard_error[from + c]);
        }
        out.spp[to] = spp;
      }
    }
  }
  return out;
}

std::string tile_digests(const Film& film) {
  std::string out;
  out.reserve(std::size_t{65} * film.grid().count());
  for (TileIndex t = 0; t < film.grid().count(); ++t) {
    if (t) out += ' ';
    out += film.tile_digest(t).hex();
  }
  return out;
}

}  // namespace

Digest pixels_sha256(const Film& film) {
  static_assert(std::endian::native == std::endian::little);
  const TileGrid& grid = film.grid();
  const auto width = static_cast<std::size_t>(grid.frame.width);
  Sha256 hash;
  std::vector<float> band;
  for (int row = 0; row < grid.rows(); ++row) {
    const auto first = static_cast<TileIndex>(row) * static_cast<TileIndex>(grid.columns());
    const PixelRect band_rect = grid.rect(first);
    band.assign(width * static_cast<std::size_t>(band_rect.height()) * 3, 0.0f);
    for (TileIndex t = first; t < first + static_cast<TileIndex>(grid.columns()); ++t) {
      const TilePixels tile = film.pixels(t);
      std::size_t from = 0;
      for (int y = 0; y < tile.rect.height(); ++y) {
        float* to = &band[(static_cast<std::size_t>(y) * width + static_cast<std::size_t>(tile.rect.x0)) * 3];
        for (int i = 0; i < 3 * tile.rect.width(); ++i) *to++ = pixel_value(tile.mean[from++]);
      }
    }
    hash.update(std::as_bytes(std::span(band)));
  }
  return hash.finish();
}

std::uint64_t values_above_half(const Film& film) {
  std::uint64_t above = 0;
  for (TileIndex t = 0; t < film.grid().count(); ++t) {
    if (film.spp(t) == 0) continue;
    for (const double mean : film.pixels(t).mean) above += !(std::abs(pixel_value(mean)) <= kLargestHalf);
  }
  return above;
}

ExrPicture final_layers(const Film& film, const CryptomatteManifests& manifests, bool float_output,
                        std::uint64_t* clamped) {
  Gathered planes = gather(film);
  ExrPicture picture{film.grid().frame, {}, {}};
  constexpr const char* kRgb[3] = {"R", "G", "B"};
  std::uint64_t above = 0;
  for (int c = 0; c < 3; ++c) {
    const std::string layer = fmt::format("stderr.{}", kRgb[c]);
    if (!float_output) above += clamp_to_half(planes.rgb[c]);
    if (float_output) picture.channels[kRgb[c]] = ExrFloat{std::move(planes.rgb[c])};
    if (!float_output) picture.channels[kRgb[c]] = ExrHalf{std::move(planes.rgb[c])};
    picture.channels[layer] = ExrFloat{std::move(planes.standard_error[c])};
  }
  picture.channels["spp"] = ExrUint{std::move(planes.spp)};
  above += add_aov_layers(film, manifests, float_output, picture);
  if (clamped) *clamped += above;
  return picture;
}

namespace {

std::string pair_text(double lo, double hi) { return fmt::format("{:.9g} {:.9g}", lo, hi); }

}  // namespace

std::map<std::string, std::string> error_strings(const TileError& sums,
                                                 std::uint64_t pixels_without_samples) {
  std::map<std::string, std::string> strings;
  if (pixels_without_samples > 0)
    strings["lightshaft:pixels_without_samples"] = fmt::format("{}", pixels_without_samples);
  if (sums.samples == 0) return strings;
  const ImageError error = image_error(sums);
  strings["lightshaft:relmse"] = fmt::format("{:.9g}", error.relmse);
  strings["lightshaft:relmse_ci95"] = pair_text(error.relmse_lo, error.relmse_hi);
  strings["lightshaft:rmse"] = fmt::format("{:.9g}", error.rmse);
  strings["lightshaft:rmse_ci95"] = pair_text(error.rmse_lo, error.rmse_hi);
  strings["lightshaft:verdict"] = error.trusted ? "trusted" : error.verdict;
  strings["lightshaft:few_hits"] = fmt::format("{}", error.few_hits);
  return strings;
}

namespace {

std::map<std::string, std::string> strings_of(const Film& film, const Provenance& from) {
  std::map<std::string, std::string> strings = {{"lightshaft:scene", from.scene.hex()},
                                                {"lightshaft:job", from.settings_json},
                                                {"lightshaft:build", from.build},
                                                {"lightshaft:class", from.numeric_class.hex()},
                                                {"lightshaft:tiles", tile_digests(film)}};
  strings.merge(error_strings(film.error(), film.pixels_without_samples()));
  // The convergence of the error over time may show problems that the film alone does not show.
  if (auto verdict = strings.find("lightshaft:verdict");
      verdict != strings.end() && verdict->second == "trusted" && from.convergence_status &&
      !from.convergence_status->trusted)
    verdict->second = from.convergence_status->words;
  if (from.seed) strings["lightshaft:seed"] = fmt::format("{}", *from.seed);
  if (from.seconds) strings["lightshaft:seconds"] = fmt::format("{:.3f}", *from.seconds);
  if (!from.health.empty()) strings["lightshaft:health"] = from.health;
  if (from.core_seconds > 0) strings["lightshaft:core_seconds"] = fmt::format("{:.3f}", from.core_seconds);
  if (!from.stopped.empty()) strings["lightshaft:stopped"] = from.stopped;
  for (const auto& [name, value] : from.figures) strings["lightshaft:" + name] = fmt::format("{:.9g}", value);
  for (const auto& [name, words] : from.notes) strings["lightshaft:" + name] = words;
  return strings;
}

// Adds the layers of the denoised image in one row of tiles. Returns the number of clamped values.
std::uint64_t add_denoised(std::span<const float> denoised, const TileGrid& grid, int row, bool float_output,
                           ExrPicture& band) {
  const auto width = static_cast<std::size_t>(grid.frame.width);
  const auto first = static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.tile) * width;
  const std::size_t pixels = static_cast<std::size_t>(band.size.height) * width;
  std::uint64_t clamped = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<float> plane(pixels);
    for (std::size_t i = 0; i < pixels; ++i) plane[i] = pixel_value(double{denoised[3 * (first + i) + c]});
    const std::string name = fmt::format("denoised.{}", "RGB"[c]);
    if (!float_output) clamped += clamp_to_half(plane);
    if (float_output)
      band.channels[name] = ExrFloat{std::move(plane)};
    else
      band.channels[name] = ExrHalf{std::move(plane)};
  }
  return clamped;
}

class MemorySink final : public ByteSink {
 public:
  Result<void> write(std::uint64_t at, std::span<const std::byte> bytes) override {
    if (at + bytes.size() > this->bytes.size())
      this->bytes.resize(static_cast<std::size_t>(at) + bytes.size());
    std::copy(bytes.begin(), bytes.end(), this->bytes.begin() + static_cast<std::ptrdiff_t>(at));
    return {};
  }
  std::vector<std::byte> bytes;
};

}  // namespace

Result<std::uint64_t> write_final_exr(const Film& film, const Provenance& from, bool float_output,
                                      ByteSink& sink, std::span<const float> denoised) {
  std::uint64_t clamped = 0;
  const ExrBands bands{film.grid().frame, strings_of(film, from), [&](int row) {
                         // The bands are requested twice, but clamped values are counted once
                         if (row == 0) clamped = 0;
                         ExrPicture band =
                             final_layers(film.row(row), from.manifests, float_output, &clamped);
                         if (!denoised.empty())
                           clamped += add_denoised(denoised, film.grid(), row, float_output, band);
                         return band;
                       }};
  if (auto written = write_sealed_exr(bands, sink); !written) return tl::unexpected(written.error());
  return clamped;
}

Result<FinalImage> final_exr(const Film& film, const Provenance& from, bool float_output,
                             std::span<const float> denoised) {
  MemorySink sink;
  const auto clamped = write_final_exr(film, from, float_output, sink, denoised);
  if (!clamped) return tl::unexpected(clamped.error());
  return FinalImage{std::move(sink.bytes), *clamped};
}

}  // namespace ls

#include "common/job/sealed_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "common/image/exr_file.h"
#include "common/image/render_limits.h"

namespace ls {
namespace {

tl::unexpected<Error> bad(const std::string& name, const std::string& what) {
  return fail(Errc::invalid_argument, fmt::format("{}: {}", name, what));
}

Result<std::string> text_of(const FinalPicture& from, const char* key, const std::string& name) {
  const auto found = from.strings.find(key);
  if (found != from.strings.end()) return found->second;
  return bad(
      name,
      fmt::format("it has no header \"{}\"; only images that Lightshaft has finished can be verified", key));
}

Result<Digest> digest_of_header(const FinalPicture& from, const char* key, const std::string& name) {
  const auto text = text_of(from, key, name);
  if (!text) return tl::unexpected(text.error());
  const auto digest = Digest::parse(*text);
  if (!digest) return bad(name, fmt::format("its header \"{}\" is no SHA-256", key));
  return *digest;
}

Result<void> read_settings(const FinalPicture& from, const std::string& name, SealedImage& image) {
  const auto text = text_of(from, "lightshaft:job", name);
  if (!text) return tl::unexpected(text.error());
  auto settings = parse_render_settings(*text);
  if (!settings)
    return bad(
        name,
        fmt::format("its header \"lightshaft:job\" has no settings to render with ({}); an image that was "
                    "merged from partials names them by their digest only",
                    settings.error().message));
  image.settings = std::move(*settings);
  if (image.settings.size != image.size)
    return bad(name, fmt::format("it has {} x {} pixels, its settings say {} x {}", image.size.width,
                                 image.size.height, image.settings.size.width, image.settings.size.height));
  return check_job_size(image.settings, 2);
}

Result<void> read_tiles(const FinalPicture& from, const std::string& name, SealedImage& image) {
  const auto text = text_of(from, "lightshaft:tiles", name);
  if (!text) return tl::unexpected(text.error());
  const std::size_t count = image.grid().count();
  constexpr std::size_t kStep = 65;  // 64 digits and a space
  if (text->size() + 1 != kStep * count)
    return bad(name, fmt::format("its header \"lightshaft:tiles\" does not name {} tiles", count));
  for (std::size_t i = 0; i < count; ++i) {
    const auto digest = Digest::parse(std::string_view(*text).substr(kStep * i, kStep - 1));
    if (!digest) return bad(name, fmt::format("tile {} of its header \"lightshaft:tiles\" is no SHA-256", i));
    image.tiles.push_back(*digest);
  }
  return {};
}

// What final_exr() stores of a mean.
float stored(double mean, bool halves) {
  const float value = static_cast<float>(mean) + 0.f;  // -0 becomes 0
  if (!halves) return value;
  return as_half(std::abs(value) <= kLargestHalf ? value : std::copysign(kLargestHalf, value));
}

}  // namespace

Result<SealedImage> read_sealed_image(std::span<const std::byte> exr, const std::string& name) {
  auto picture = read_final_exr(exr, name);
  if (!picture) return tl::unexpected(picture.error());
  SealedImage image;
  image.size = picture->size;
  image.half = picture->half;
  const auto scene = digest_of_header(*picture, "lightshaft:scene", name);
  if (!scene) return tl::unexpected(scene.error());
  const auto numeric_class = digest_of_header(*picture, "lightshaft:class", name);
  if (!numeric_class) return tl::unexpected(numeric_class.error());
  auto build = text_of(*picture, "lightshaft:build", name);
  if (!build) return tl::unexpected(build.error());
  image.scene = *scene;
  image.numeric_class = *numeric_class;
  image.build = std::move(*build);
  if (const auto ok = read_settings(*picture, name, image); !ok) return tl::unexpected(ok.error());
  if (const auto ok = read_tiles(*picture, name, image); !ok) return tl::unexpected(ok.error());
  image.rgb = std::move(picture->rgb);
  image.error = std::move(picture->error);
  image.spp = std::move(picture->spp);
  return image;
}

Result<std::uint64_t> tile_samples(const SealedImage& image, TileIndex tile) {
  const PixelRect r = image.grid().rect(tile);
  const auto at = [&](int x, int y) {
    return image.spp[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.size.width) +
                     static_cast<std::size_t>(x)];
  };
  const std::uint32_t first = at(r.x0, r.y0);
  for (int y = r.y0; y < r.y1; ++y)
    for (int x = r.x0; x < r.x1; ++x)
      if (at(x, y) != first)
        return fail(
            Errc::invalid_argument,
            fmt::format("tile {}: pixel {},{} says {} samples, pixel {},{} says {}; a tile has one count",
                        tile, r.x0, r.y0, first, x, y, at(x, y)));
  if (first > kMaxSpp || first % 2 != 0)
    return fail(Errc::invalid_argument,
                fmt::format("tile {}: no image of ours has {} samples a pixel", tile, first));
  return first;
}

std::optional<PixelDifference> first_difference(const SealedImage& image, const TilePixels& tile) {
  std::size_t from = 0;
  for (int y = tile.rect.y0; y < tile.rect.y1; ++y) {
    for (int x = tile.rect.x0; x < tile.rect.x1; ++x, from += 3) {
      const std::size_t at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.size.width) +
                                  static_cast<std::size_t>(x));
      for (std::size_t c = 0; c < 3; ++c) {
        if (!(image.rgb[at + c] == stored(tile.mean[from + c], image.half)))
          return PixelDifference{x, y, "colour"};
        if (!(image.error[at + c] == static_cast<float>(tile.standard_error[from + c])))
          return PixelDifference{x, y, "standard error"};
      }
    }
  }
  return std::nullopt;
}

}  // namespace ls

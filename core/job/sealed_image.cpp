#include "core/job/sealed_image.h"

#include <fmt/format.h>

#include <bit>
#include <string_view>

#include "core/base/overloaded.h"
#include "core/image/exr/exr_file.h"
#include "core/image/frame/render_limits.h"

namespace ls {
namespace {

tl::unexpected<Error> bad(const std::string& name, const std::string& what) {
  return bad_argument(fmt::format("{}: {}", name, what));
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

Result<void> read_settings(SealedImage& image, const std::string& name) {
  const auto text = text_of(image.picture, "lightshaft:job", name);
  if (!text) return tl::unexpected(text.error());
  auto settings = parse_render_settings(*text);
  if (!settings)
    return bad(
        name,
        fmt::format("its header \"lightshaft:job\" has no settings to render with ({}); an image that was "
                    "merged from partials names them by their digest only",
                    settings.error().message));
  image.settings = std::move(*settings);
  if (image.settings.size != image.picture.size)
    return bad(name,
               fmt::format("it has {} x {} pixels, its settings say {} x {}", image.picture.size.width,
                           image.picture.size.height, image.settings.size.width, image.settings.size.height));
  return check_job_size(image.settings, 2);
}

Result<void> read_form(SealedImage& image, const std::string& name) {
  image.form.float_output = !image.picture.half;
  const auto text = image.picture.strings.find(kColourSpaceName);
  if (text == image.picture.strings.end()) return {};
  for (const ColourSpace space : colour_spaces())
    if (to_string(space) == text->second) {
      image.form.colour_space = space;
      return {};
    }
  return bad(name,
             fmt::format("its header \"{}\" names no colour space that is known here", kColourSpaceName));
}

Result<void> read_tiles(SealedImage& image, const std::string& name) {
  const auto text = text_of(image.picture, "lightshaft:tiles", name);
  if (!text) return tl::unexpected(text.error());
  const std::size_t count = image.grid().count();
  constexpr std::size_t kStep = 65;  // length of a digest (64 hexadecimal digits) and a space
  if (text->size() + 1 != kStep * count)
    return bad(name, fmt::format("its header \"lightshaft:tiles\" does not name {} tiles", count));
  for (std::size_t i = 0; i < count; ++i) {
    const auto digest = Digest::parse(std::string_view(*text).substr(kStep * i, kStep - 1));
    if (!digest) return bad(name, fmt::format("tile {} of its header \"lightshaft:tiles\" is no SHA-256", i));
    image.tiles.push_back(*digest);
  }
  return {};
}

std::size_t index_of(FrameSize size, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width) + static_cast<std::size_t>(x);
}

// Returns the bits of value number `at`. Values of half layers are converted to float, which keeps them
// distinct.
std::uint32_t stored(const std::variant<ExrHalf, ExrFloat, ExrUint>& channel, std::size_t at) {
  return std::visit(
      overloaded{[&](const ExrHalf& c) { return std::bit_cast<std::uint32_t>(as_half(c.values[at])); },
                 [&](const ExrFloat& c) { return std::bit_cast<std::uint32_t>(c.values[at]); },
                 [&](const ExrUint& c) { return c.values[at]; }},
      channel);
}

}  // namespace

Result<SealedImage> read_sealed_image(FinalPicture picture, const std::string& name) {
  if (picture.lossy)
    return bad(
        name,
        "it is packed with a lossy compression, which changes the colours, so that they can't be verified: "
        "render it with the exr_compression zip or piz");
  SealedImage image;
  image.picture = std::move(picture);
  const auto scene = digest_of_header(image.picture, "lightshaft:scene", name);
  if (!scene) return tl::unexpected(scene.error());
  const auto numeric_class = digest_of_header(image.picture, "lightshaft:class", name);
  if (!numeric_class) return tl::unexpected(numeric_class.error());
  auto build = text_of(image.picture, "lightshaft:build", name);
  if (!build) return tl::unexpected(build.error());
  image.scene = *scene;
  image.numeric_class = *numeric_class;
  image.build = std::move(*build);
  if (const auto ok = read_form(image, name); !ok) return tl::unexpected(ok.error());
  if (const auto ok = read_settings(image, name); !ok) return tl::unexpected(ok.error());
  if (image.picture.strings.contains("lightshaft:mix"))
    return bad(name, "it is a mix of light groups; only the image that it was mixed from can be verified");
  if (const auto ok = read_tiles(image, name); !ok) return tl::unexpected(ok.error());
  return image;
}

Result<std::uint64_t> tile_samples(const SealedImage& image, TileIndex tile) {
  const PixelRect r = image.grid().rect(tile);
  const auto& spp = std::get<ExrUint>(image.picture.channels.at("spp")).values;
  const auto at = [&](int x, int y) { return spp[index_of(image.picture.size, x, y)]; };
  const std::uint32_t first = at(r.x0, r.y0);
  for (int y = r.y0; y < r.y1; ++y)
    for (int x = r.x0; x < r.x1; ++x)
      if (at(x, y) != first)
        return bad_argument(
            fmt::format("tile {}: pixel {},{} says {} samples, pixel {},{} says {}; a tile has one count",
                        tile, r.x0, r.y0, first, x, y, at(x, y)));
  if (first > kMaxSpp || first % 2 != 0)
    return bad_argument(fmt::format("tile {}: no image of ours has {} samples a pixel", tile, first));
  return first;
}

std::optional<PixelDifference> first_difference(const SealedImage& image, const Film& film, TileIndex tile) {
  const int row = static_cast<int>(tile) / film.grid().columns();
  const PixelRect rect = film.grid().rect(tile);
  const LayerNames names{.light_groups = image.settings.light_groups};
  for (const auto& [name, ours] : final_layers(film.row(row), names, image.form).channels) {
    const auto theirs = image.picture.channels.find(name);
    if (theirs == image.picture.channels.end() || theirs->second.index() != ours.index())
      return PixelDifference{rect.x0, rect.y0, name};
    for (int y = rect.y0; y < rect.y1; ++y)
      for (int x = rect.x0; x < rect.x1; ++x)
        if (stored(ours, index_of(image.picture.size, x, y - row * film.grid().tile)) !=
            stored(theirs->second, index_of(image.picture.size, x, y)))
          return PixelDifference{x, y, name};
  }
  return std::nullopt;
}

}  // namespace ls

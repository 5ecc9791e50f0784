#include "core/assets/image.h"

#include <fmt/format.h>
#include <strings.h>

#include "core/base/bytes.h"
#include "core/base/file_form.h"
#include "core/image/exr/exr_file.h"

namespace ls {
namespace {

bool ends_in(std::string_view name, const char (&ending)[5]) {
  name = without_gz(name);
  return name.size() >= 4 && ::strncasecmp(name.data() + name.size() - 4, ending, 4) == 0;
}

}  // namespace

Result<ImageData> decode_image(std::string_view name, std::span<const std::byte> file,
                               std::uint64_t max_pixels) {
  const std::string_view head = as_text(file.subspan(0, std::min<std::size_t>(file.size(), 12)));
  if (head.starts_with("\x89PNG")) return decode_png(name, file, max_pixels);
  if (head.starts_with("\xff\xd8\xff")) return decode_jpeg(name, file, max_pixels);
  if (head.starts_with("BM")) return decode_bmp(name, file, max_pixels);
  if (head.starts_with("\x76\x2f\x31\x01")) return decode_exr(name, file, max_pixels);
  if (head.starts_with("#?")) return decode_hdr(name, file, max_pixels);
  if (head.starts_with("qoif")) return decode_qoi(name, file, max_pixels);
  for (const std::string_view pfm : {"PF ", "PF\n", "PF\r", "Pf ", "Pf\n", "Pf\r"})
    if (head.starts_with(pfm)) return decode_pfm(name, file, max_pixels);
  if (head.starts_with("IESNA") || head.starts_with("IES:") || ends_in(name, ".ies"))
    return decode_ies(name, file, max_pixels);
  if (ends_in(name, ".tga")) return decode_tga(name, file, max_pixels);
  return bad_argument(
      fmt::format("'{}': by its first bytes this is not a PNG, JPEG, BMP, QOI, OpenEXR, Radiance HDR or "
                  "PFM image, and its name does not end in .tga or .ies",
                  name));
}

Result<ImageData> load_image(const std::filesystem::path& path, std::string_view name,
                             std::uint64_t max_pixels) {
  const auto bytes = read_asset(path, name);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_image(name, *bytes, max_pixels);
}

tl::unexpected<Error> BrokenImage::operator()(std::string_view problem) const {
  return bad_argument(fmt::format("'{}': broken {}: {}", name, format, problem));
}

tl::unexpected<Error> too_many_pixels(std::string_view name, std::uint64_t width, std::uint64_t height,
                                      std::uint64_t max_pixels) {
  return fail(Errc::resource_exhausted, fmt::format("'{}': {} x {} pixels; at most {} may be read here", name,
                                                    width, height, max_pixels));
}

Result<ImageData> decode_exr(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  auto image = read_exr_image(
      file, std::string(name),
      ExrLimits{.max_bytes = kMaxAssetBytes, .max_pixels = max_pixels, .max_side = kMaxImageSide});
  if (!image) return tl::unexpected(image.error());
  ImageData out;
  out.width = static_cast<std::uint32_t>(image->size.width);
  out.height = static_cast<std::uint32_t>(image->size.height);
  out.channels = image->channels;
  out.f32 = std::move(image->values);
  out.to_srgb = image->to_srgb;
  return out;
}

}  // namespace ls

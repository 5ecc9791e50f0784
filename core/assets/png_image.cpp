#include <fmt/format.h>
#include <png.h>

#include <csetjmp>
#include <cstring>

#include "core/assets/image.h"

namespace ls {

namespace {

// The state of the callbacks of libpng: the bytes still to be read, and the message of an error. Callbacks
// must not throw. Errors return by longjmp, which calls no destructors, so only plain data may be on the
// stack.
struct Source {
  const std::byte* data;
  std::size_t left;
  char message[200];
  png_infop info;
};

void read_bytes(png_structp png, png_bytep out, png_size_t n) {
  auto* s = static_cast<Source*>(png_get_io_ptr(png));
  if (n > s->left) png_error(png, "the file ends too early");
  std::memcpy(out, s->data, n);
  s->data += n;
  s->left -= n;
}
void on_error(png_structp png, png_const_charp text) {
  auto* s = static_cast<Source*>(png_get_error_ptr(png));
  std::snprintf(s->message, sizeof s->message, "%s", text);
  std::longjmp(png_jmpbuf(png), 1);
}
// libpng leaves out a damaged chunk that an image can do without, with a warning that begins with its name.
// The opacities of a palette or of a colour are such a chunk to it, but not to us. Nothing is lost if the
// image has an alpha channel, or if the chunk was read before.
void on_warning(png_structp png, png_const_charp text) {
  if (!std::strstr(text, "tRNS")) return;
  const png_infop info = static_cast<Source*>(png_get_error_ptr(png))->info;
  if ((png_get_color_type(png, info) & PNG_COLOR_MASK_ALPHA) || png_get_valid(png, info, PNG_INFO_tRNS))
    return;
  on_error(png, std::strstr(text, "out of place")
                    ? "its opacities (tRNS) do not stand between its palette and its pixels, where programs "
                      "look for them: save it again"
                    : text);
}

struct Png {
  png_structp png = nullptr;
  png_infop info = nullptr;
  ~Png() { png_destroy_read_struct(&png, &info, nullptr); }
};

struct PngShape {
  png_uint_32 width = 0, height = 0, channels = 0, bits = 0;
  std::size_t row_bytes = 0;
};

// read_header() and read_rows() must not have objects with destructors, because longjmp would skip them.
bool read_header(Png& p, PngShape& shape) {
  if (setjmp(png_jmpbuf(p.png))) return false;
  png_set_user_limits(p.png, kMaxImageSide, kMaxImageSide);
  png_read_info(p.png, p.info);
  if (png_get_color_type(p.png, p.info) == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(p.png);
  if (png_get_bit_depth(p.png, p.info) < 8) png_set_expand_gray_1_2_4_to_8(p.png);
  if (png_get_valid(p.png, p.info, PNG_INFO_tRNS)) png_set_tRNS_to_alpha(p.png);
  if (png_get_bit_depth(p.png, p.info) == 16) png_set_swap(p.png);
  png_set_interlace_handling(p.png);
  png_read_update_info(p.png, p.info);
  shape = {png_get_image_width(p.png, p.info), png_get_image_height(p.png, p.info),
           png_get_channels(p.png, p.info), png_get_bit_depth(p.png, p.info),
           png_get_rowbytes(p.png, p.info)};
  return true;
}
bool read_rows(Png& p, png_bytepp rows) {
  if (setjmp(png_jmpbuf(p.png))) return false;
  png_read_image(p.png, rows);
  png_read_end(p.png, nullptr);
  return true;
}

}  // namespace

Result<ImageData> decode_png(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  Source source{file.data(), file.size(), {}, nullptr};
  Png p;
  const BrokenImage broken{name, "PNG"};
  p.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &source, on_error, on_warning);
  if (p.png) p.info = png_create_info_struct(p.png);
  source.info = p.info;
  if (!p.info) return fail(Errc::resource_exhausted, fmt::format("'{}': no memory to read a PNG", name));
  png_set_read_fn(p.png, &source, read_bytes);
  PngShape shape;
  if (!read_header(p, shape)) return broken(source.message);
  const std::uint64_t pixels = std::uint64_t{shape.width} * shape.height;
  // A header that claims more pixels than the file can contain is rejected. Deflate packs at most 1032 bytes
  // into one, and one bit of a palette image is at most expanded to four bytes, which is a factor of 32.
  if (pixels == 0 || pixels > kMaxImagePixels ||
      shape.row_bytes * std::uint64_t{shape.height} / 1032 / 32 > file.size())
    return broken("its size is not believable");
  if (pixels > max_pixels) return too_many_pixels(name, shape.width, shape.height, max_pixels);
  std::vector<std::uint8_t> bytes(shape.row_bytes * shape.height);
  std::vector<png_bytep> rows(shape.height);
  for (std::size_t y = 0; y < rows.size(); ++y) rows[y] = bytes.data() + y * shape.row_bytes;
  if (!read_rows(p, rows.data())) return broken(source.message);
  ImageData image{shape.width, shape.height, shape.channels, {}, {}, true};
  if (shape.bits == 8) {
    image.u8 = std::move(bytes);
    return image;
  }
  image.f32.resize(bytes.size() / 2);
  for (std::size_t i = 0; i < image.f32.size(); ++i) {
    std::uint16_t v;
    std::memcpy(&v, &bytes[2 * i], 2);
    image.f32[i] = static_cast<float>(v / 65535.);
  }
  return image;
}

}  // namespace ls

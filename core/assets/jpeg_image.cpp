#include <csetjmp>
#include <cstdio>  // jpeglib.h requires it

#include <fmt/format.h>
#include <jerror.h>
#include <jpeglib.h>

#include "core/assets/image.h"

namespace ls {

namespace {

struct Failure {
  jpeg_error_mgr base;  // first member, so the library's pointer to it also points to the whole Failure
  std::jmp_buf escape;
  bool no_end;  // true if the file ended before the end mark
  char message[JMSG_LENGTH_MAX];
};

void on_error(j_common_ptr info) {
  auto* f = reinterpret_cast<Failure*>(info->err);
  f->base.format_message(info, f->message);
  std::longjmp(f->escape, 1);
}
// Decides which of the library's warnings mean that data are missing or damaged: the library itself would go
// on and fill in grey. These are treated as errors. The others lose no pixel.
void on_message(j_common_ptr info, int level) {
  if (level >= 0) return;  // not a warning
  auto* f = reinterpret_cast<Failure*>(info->err);
  switch (f->base.msg_code) {
    case JWRN_JPEG_EOF:  // no end mark: decode_jpeg() decides, when it knows what was there
      f->no_end = true;
      return;
    case JWRN_EXTRANEOUS_DATA:  // bytes between the parts of the file
    case JWRN_JFIF_MAJOR:       // a newer revision of JFIF, as cameras write it
    case JWRN_ADOBE_XFORM:      // a transform of colours by an unknown number, which is taken as usual
    case JWRN_BOGUS_ICC:        // the colour profile, which is not used
      return;
    default:
      on_error(info);
  }
}

struct Decoder {
  jpeg_decompress_struct info{};
  Failure failure{};
  bool missing_scans = false;  // true if parts of the image may have been in scans that were not read
  Decoder() {
    info.err = jpeg_std_error(&failure.base);
    failure.base.error_exit = on_error;
    failure.base.emit_message = on_message;
  }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  ~Decoder() { jpeg_destroy_decompress(&info); }
};

// True if the coefficients of all colours were read to their last bit. Only an image of several scans needs
// to be asked; one that is not progressive has no such account.
bool has_all_scans(const jpeg_decompress_struct& info) {
  if (!info.coef_bits) return false;
  for (int c = 0; c < info.num_components; ++c)
    for (int k = 0; k < DCTSIZE2; ++k)
      if (info.coef_bits[c][k] != 0) return false;
  return true;
}

// read_header() and read_rows() must not have objects with destructors, because longjmp would skip them.
bool read_header(Decoder& d, const unsigned char* data, unsigned long size) {
  if (setjmp(d.failure.escape)) return false;
  jpeg_create_decompress(&d.info);
  jpeg_mem_src(&d.info, data, size);
  jpeg_read_header(&d.info, TRUE);
  d.info.out_color_space = d.info.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
  d.info.dct_method = JDCT_ISLOW;
  return true;
}
bool read_rows(Decoder& d, unsigned char* out, std::size_t row_bytes) {
  if (setjmp(d.failure.escape)) return false;
  jpeg_start_decompress(&d.info);
  while (d.info.output_scanline < d.info.output_height) {
    unsigned char* row = out + d.info.output_scanline * row_bytes;
    jpeg_read_scanlines(&d.info, &row, 1);
  }
  d.missing_scans = jpeg_has_multiple_scans(&d.info) && !has_all_scans(d.info);
  jpeg_finish_decompress(&d.info);
  return true;
}

}  // namespace

Result<ImageData> decode_jpeg(std::string_view name, std::span<const std::byte> file,
                              std::uint64_t max_pixels) {
  Decoder d;
  const BrokenImage broken{name, "JPEG"};
  if (!read_header(d, reinterpret_cast<const unsigned char*>(file.data()), file.size()))
    return broken(d.failure.message);
  if (d.info.num_components == 4)
    return bad_argument(fmt::format(
        "'{}': a JPEG of four colours (CMYK), which are those of a printer: save it as RGB", name));
  if (d.info.num_components != 1 && d.info.num_components != 3)
    return broken(fmt::format("{} colours; 1 and 3 are understood", d.info.num_components));
  ImageData image;
  image.width = d.info.image_width;
  image.height = d.info.image_height;
  image.channels = d.info.num_components == 1 ? 1 : 3;
  image.srgb = true;
  const std::uint64_t pixels = std::uint64_t{image.width} * image.height;
  if (pixels == 0 || image.width > kMaxImageSide || image.height > kMaxImageSide || pixels > kMaxImagePixels)
    return broken("its size is not believable");
  if (pixels > max_pixels) return too_many_pixels(name, image.width, image.height, max_pixels);
  // Rejects a header that claims more pixels than the file can hold. A block of 8 x 8 values takes at least
  // two bits, and a colour channel may have up to 4 x 4 times fewer values than the image has pixels. So the
  // lenient limit is one bit per 32 * 16 = 512 pixels.
  if (pixels / 64 / 64 > file.size()) return broken("it is too short for its size");
  image.u8.resize(pixels * image.channels);
  if (!read_rows(d, image.u8.data(), std::size_t{image.width} * image.channels))
    return broken(d.failure.message);
  // Without an end mark, an image in one scan is whole: the library would have missed the data of a pixel.
  // Of several scans those at the end may be missing.
  if (d.failure.no_end && d.missing_scans) return broken("the file ends too early");
  return image;
}

}  // namespace ls

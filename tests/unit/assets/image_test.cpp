#include "core/assets/image.h"

#include <gmock/gmock.h>
#include <jpeglib.h>
#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "core/image/exr/exr_file.h"
#include "tests/unit/assets/hostile.h"

namespace ls {
namespace {

using test::append;
using test::bytes_of;
using testing::Each;
using testing::ElementsAre;
using testing::FloatEq;
using testing::HasSubstr;

// The decoders with their default argument. A pointer to the function itself would lose it.
constexpr auto kPng = [](std::string_view name, std::span<const std::byte> file) {
  return decode_png(name, file);
};
constexpr auto kJpeg = [](std::string_view name, std::span<const std::byte> file) {
  return decode_jpeg(name, file);
};
constexpr auto kHdr = [](std::string_view name, std::span<const std::byte> file) {
  return decode_hdr(name, file);
};

// Encodes a PNG by libpng's simple interface. `format` is one of its PNG_FORMAT_... constants; `pixels` are
// in this format.
std::string png(std::uint32_t width, std::uint32_t height, std::uint32_t format, const void* pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = width;
  image.height = height;
  image.format = format;
  png_alloc_size_t size = 0;
  EXPECT_TRUE(png_image_write_to_memory(&image, nullptr, &size, 0, pixels, 0, nullptr));
  std::string out(size, '\0');
  EXPECT_TRUE(png_image_write_to_memory(&image, out.data(), &size, 0, pixels, 0, nullptr));
  return out;
}
const std::uint8_t kRgb[] = {255, 0, 0, 0, 255, 0, 0, 0, 255, 10, 20, 30};
const std::uint8_t kRgba[] = {255, 0, 0, 128, 0, 255, 0, 255};

std::string jpeg(int width, int height, int channels, std::uint8_t value) {
  jpeg_compress_struct c{};
  jpeg_error_mgr errors;
  c.err = jpeg_std_error(&errors);
  jpeg_create_compress(&c);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&c, &bytes, &size);
  c.image_width = static_cast<JDIMENSION>(width);
  c.image_height = static_cast<JDIMENSION>(height);
  c.input_components = channels;
  c.in_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&c);
  jpeg_start_compress(&c, TRUE);
  std::vector<std::uint8_t> row(static_cast<std::size_t>(width * channels), value);
  for (int y = 0; y < height; ++y) {
    unsigned char* p = row.data();
    jpeg_write_scanlines(&c, &p, 1);
  }
  jpeg_finish_compress(&c);
  std::string out(reinterpret_cast<char*>(bytes), size);
  jpeg_destroy_compress(&c);
  std::free(bytes);
  return out;
}

// Returns an image of 8 x 2 pixels. The first row is run-length coded, the second plain.
std::string hdr() {
  std::string s = "#?RADIANCE\n# made by hand\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n";
  s += std::string("\x02\x02\x00\x08", 4);
  s += std::string("\x88\x80", 2);                              // red: a run of 8 x 128
  s += std::string("\x08\x00\x20\x40\x60\x80\xa0\xc0\xe0", 9);  // green: 8 plain values
  // Blue: two runs; exponent: 129, which is a factor of 2 / 256.
  s += std::string("\x84\x10\x84\x20", 4) + std::string("\x88\x81", 2);
  for (int x = 0; x < 8; ++x) s += std::string("\x80\x40\x20\x80", 4);
  return s;
}

void expect_sound(const ImageData& i) {
  const std::size_t n = std::size_t{i.width} * i.height * i.channels;
  EXPECT_GT(n, 0u);
  EXPECT_TRUE((i.u8.size() == n && i.f32.empty()) || (i.f32.size() == n && i.u8.empty()));
}

TEST(Png, ReadsColourGreyAndAlpha) {
  const auto rgb = decode_image("a.png", bytes_of(png(2, 2, PNG_FORMAT_RGB, kRgb)));
  ASSERT_TRUE(rgb) << rgb.error().message;
  EXPECT_EQ(rgb->channels, 3u);
  EXPECT_TRUE(rgb->srgb);
  EXPECT_EQ(rgb->u8, std::vector<std::uint8_t>(std::begin(kRgb), std::end(kRgb)));

  const auto rgba = decode_png("a.png", bytes_of(png(2, 1, PNG_FORMAT_RGBA, kRgba)));
  ASSERT_TRUE(rgba) << rgba.error().message;
  EXPECT_EQ(rgba->channels, 4u);
  EXPECT_EQ(rgba->u8, std::vector<std::uint8_t>(std::begin(kRgba), std::end(kRgba)));

  const auto grey = decode_png("a.png", bytes_of(png(3, 1, PNG_FORMAT_GRAY, "\x00\x80\xff")));
  ASSERT_TRUE(grey) << grey.error().message;
  EXPECT_EQ(grey->channels, 1u);
  EXPECT_THAT(grey->u8, ElementsAre(0, 128, 255));
}

// Returns a chunk of a PNG.
std::string chunk(const std::string& name, const std::string& data) {
  const auto word = [](std::size_t x) {
    std::string out;
    for (const int shift : {24, 16, 8, 0}) out += static_cast<char>(x >> shift);
    return out;
  };
  const std::string whole = name + data;
  const auto sum = ::crc32(0, reinterpret_cast<const Bytef*>(whole.data()), static_cast<uInt>(whole.size()));
  return word(data.size()) + whole + word(sum);
}

TEST(Png, OpacityBeforeThePaletteIsReported) {
  const std::string start =
                        "\x89PNG\r\n\x1a\n" + chunk("IHDR", std::string("\0\0\0\1\0\0\0\1\10\3\0\0\0", 13)),
                    palette = chunk("PLTE", "abc"), opacities = chunk("tRNS", "\x7f"),
                    pixel = chunk("IDAT", std::string("\x78\x01\x01\2\0\xfd\xff\0\0\0\2\0\1", 13)),
                    end = chunk("IEND", "");

  const auto right = decode_png("a.png", bytes_of(start + palette + opacities + pixel + end));
  const auto wrong = decode_png("a.png", bytes_of(start + opacities + palette + pixel + end));

  ASSERT_TRUE(right) << right.error().message;
  EXPECT_THAT(right->u8, ElementsAre('a', 'b', 'c', 0x7f));
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message,
              HasSubstr("'a.png': broken PNG: its opacities (tRNS) do not stand between its palette and its "
                        "pixels"));
}

// Returns a PNG with 16 bits per channel. It is written with libpng's full interface, since the simple one
// would convert the values.
std::string png16(const std::vector<std::uint16_t>& grey) {
  std::string out;
  png_structp p = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(p);
  png_set_write_fn(
      p, &out,
      [](png_structp w, png_bytep data, png_size_t n) {
        static_cast<std::string*>(png_get_io_ptr(w))->append(reinterpret_cast<char*>(data), n);
      },
      [](png_structp) {});
  png_set_IHDR(p, info, static_cast<png_uint_32>(grey.size()), 1, 16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(p, info);
  png_set_swap(p);
  png_write_row(p, reinterpret_cast<png_const_bytep>(grey.data()));
  png_write_end(p, nullptr);
  png_destroy_write_struct(&p, &info);
  return out;
}

TEST(Png, KeepsAllSixteenBits) {
  const auto i = decode_png("a.png", bytes_of(png16({0, 1, 32768, 65535})));
  ASSERT_TRUE(i) << i.error().message;
  EXPECT_THAT(i->f32, ElementsAre(0, FloatEq(1 / 65535.f), FloatEq(32768 / 65535.f), 1));
  EXPECT_TRUE(i->srgb);
}

TEST(Png, NeverAcceptsATruncatedFileAndSurvivesMutations) {
  for (const std::string& file : {png(2, 2, PNG_FORMAT_RGB, kRgb), png16({0, 1, 2})}) {
    EXPECT_EQ(test::accepted_truncations(file, kPng), 0);
    test::survive_mutations(file, kPng, expect_sound);
  }
}

TEST(Jpeg, ReadsColourAndGrey) {
  const auto rgb = decode_image("a.jpg", bytes_of(jpeg(16, 8, 3, 200)));
  ASSERT_TRUE(rgb) << rgb.error().message;
  EXPECT_EQ(rgb->channels, 3u);
  EXPECT_THAT(rgb->u8, Each(200));  // a flat image survives the cosine transform of JPEG unchanged
  const auto grey = decode_jpeg("a.jpg", bytes_of(jpeg(9, 9, 1, 100)));
  ASSERT_TRUE(grey) << grey.error().message;
  EXPECT_EQ(grey->channels, 1u);
  EXPECT_EQ(grey->u8.size(), 81u);
}

TEST(Jpeg, RefusesTruncatedFilesAndSurvivesRandomMutations) {
  const std::string file = jpeg(32, 32, 3, 77);
  // If only the end marker is cut off, all pixels are there.
  EXPECT_LE(test::accepted_truncations(file, kJpeg), 2);
  test::survive_mutations(file, kJpeg, expect_sound);
}

std::string with_segment(const std::string& file, std::size_t at, const std::string& bytes) {
  return file.substr(0, at) + bytes + file.substr(at);
}

TEST(Jpeg, FilesWithLibraryWarningsAreReadIfNoPixelIsLost) {
  const std::string file = jpeg(32, 32, 3, 77);
  const auto whole = decode_jpeg("a.jpg", bytes_of(file));
  ASSERT_TRUE(whole);
  std::string newer = file;
  newer[newer.find("JFIF") + 5] = 2;  // the major number of its revision
  const std::size_t scan = file.find("\xff\xda");
  for (const std::string& odd :
       {newer, with_segment(file, scan, "abc"), with_segment(file, file.size() - 2, "abc"), file + "rest",
        file.substr(0, file.size() - 2)}) {
    const auto read = decode_jpeg("a.jpg", bytes_of(odd));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(*read == *whole);
  }
}

TEST(Jpeg, RefusesCmykByName) {
  jpeg_compress_struct c{};
  jpeg_error_mgr errors;
  c.err = jpeg_std_error(&errors);
  jpeg_create_compress(&c);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&c, &bytes, &size);
  c.image_width = c.image_height = 1;
  c.input_components = 4;
  c.in_color_space = JCS_CMYK;
  jpeg_set_defaults(&c);
  jpeg_start_compress(&c, TRUE);
  std::uint8_t pixel[4] = {1, 2, 3, 4}, *row = pixel;
  jpeg_write_scanlines(&c, &row, 1);
  jpeg_finish_compress(&c);
  const std::string file(reinterpret_cast<char*>(bytes), size);
  jpeg_destroy_compress(&c);
  std::free(bytes);

  const auto read = decode_jpeg("a.jpg", bytes_of(file));

  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("CMYK"));
}

TEST(Exr, KeepsItsAlphaChannel) {
  ExrPicture picture{{2, 1}, {}, {}};
  for (const char* c : {"R", "G", "B"}) picture.channels[c] = ExrFloat{{.25f, .5f}};
  picture.channels["A"] = ExrFloat{{0, 1}};
  const auto file = write_exr(picture);
  ASSERT_TRUE(file);

  const auto i = decode_image("a.exr", *file);

  ASSERT_TRUE(i) << i.error().message;
  EXPECT_EQ(i->channels, 4u);
  EXPECT_THAT(i->f32, ElementsAre(.25f, .25f, .25f, 0, .5f, .5f, .5f, 1));
  EXPECT_FALSE(i->to_srgb);
}

TEST(Exr, XyzIsConverted) {
  ExrPicture picture{{1, 1}, {}, {}};
  picture.channels["X"] = ExrFloat{{.3127f / .3290f}};
  picture.channels["Y"] = ExrFloat{{1}};
  picture.channels["Z"] = ExrFloat{{(1 - .3127f - .3290f) / .3290f}};
  const auto file = write_exr(picture);
  ASSERT_TRUE(file);

  const auto i = decode_image("a.exr", *file);

  ASSERT_TRUE(i && i->to_srgb);
  // It is the white of Rec. 709, which is 1, 1, 1 there. The entries of the matrix are rounded to 1e-7 of 3.
  for (std::size_t row = 0; row < 3; ++row) {
    float sum = 0;
    for (std::size_t k = 0; k < 3; ++k) sum += (*i->to_srgb)[3 * row + k] * i->f32[k];
    EXPECT_NEAR(sum, 1, 2e-6);
  }
}

TEST(Exr, ReadsColourAsLinearFloats) {
  ExrPicture picture;
  picture.size = {2, 1};
  picture.channels["R"] = ExrFloat{{1, 2}};
  picture.channels["G"] = ExrFloat{{3, 4}};
  picture.channels["B"] = ExrFloat{{5, 1e6f}};
  const auto file = write_exr(picture);
  ASSERT_TRUE(file) << file.error().message;

  const auto i = decode_image("a.exr", *file);

  ASSERT_TRUE(i) << i.error().message;
  EXPECT_THAT(i->f32, ElementsAre(1, 3, 5, 2, 4, 1e6f));
  EXPECT_FALSE(i->srgb);
  EXPECT_FALSE(decode_image("a.exr", std::span(*file).first(file->size() / 2)));
}

TEST(Hdr, ReadsRunsAndPlainRows) {
  const auto i = decode_image("a.hdr", bytes_of(hdr()));

  ASSERT_TRUE(i) << i.error().message;
  EXPECT_EQ(i->width, 8u);
  EXPECT_EQ(i->height, 2u);
  EXPECT_FALSE(i->srgb);
  EXPECT_EQ(i->f32[0], 1);         // 128 x 2^(129 - 136)
  EXPECT_EQ(i->f32[3 + 1], .25f);  // 32 / 128
  EXPECT_EQ(i->f32[2], .125f);
  EXPECT_EQ(i->f32[24], .5f);  // the second row
  EXPECT_EQ(i->f32[26], .125f);
}

TEST(Hdr, HeadersOfOtherProgramsAreRead) {
  const std::string pixels(std::size_t{4} * 4, '\x80');
  for (const std::string& header : {"#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 2 +X 2\n",
                                    "#?RADIANCE\nFORMAT=32-bit_rle_rgbe \n\n-Y 2 +X 2\n",
                                    "#?AUTOPANO\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n"}) {
    const auto i = decode_image("a.hdr", bytes_of(header + pixels));
    ASSERT_TRUE(i) << i.error().message;
    EXPECT_THAT(i->f32, Each(.5f));  // 128 x 2^(128 - 136)
    EXPECT_FALSE(i->to_srgb);
  }
  const auto xyze =
      decode_image("a.hdr", bytes_of("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 2 +X 2\n" + pixels));
  ASSERT_TRUE(xyze) << xyze.error().message;
  EXPECT_TRUE(xyze->to_srgb);
}

// Two rows of 4 pixels: a pixel and its repetition by three, by the exponent of a pixel of three ones; and
// four pixels as they are.
TEST(Hdr, TheOlderRunsAreRead) {
  const std::string file = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" +
                           std::string("\x80\x40\x20\x80\1\1\1\3", 8) + std::string(16, '\x80');

  const auto i = decode_image("a.hdr", bytes_of(file));

  ASSERT_TRUE(i) << i.error().message;
  for (std::size_t x = 0; x < 4; ++x) EXPECT_EQ(i->f32[3 * x + 1], .25f) << x;
  EXPECT_EQ(i->f32[12], .5f);
}

TEST(Hdr, NeverAcceptsATruncatedFileAndSurvivesMutations) {
  EXPECT_EQ(test::accepted_truncations(hdr(), kHdr), 0);
  test::survive_mutations(hdr(), kHdr, expect_sound);
}

TEST(Hdr, RefusesSizesThatTheFileCannotHold) {
  std::string s = hdr();
  s.replace(s.find("-Y 2 +X 8"), 9, "-Y 30000 +X 8");
  const auto i = decode_hdr("a.hdr", bytes_of(s));
  ASSERT_FALSE(i);
  EXPECT_THAT(i.error().message, HasSubstr("too short for its size"));
}

TEST(Image, NamesAFileOfUnknownFormat) {
  const auto i = decode_image("a.gif", bytes_of("GIF89a"));
  ASSERT_FALSE(i);
  EXPECT_THAT(i.error().message, HasSubstr("'a.gif'"));
  EXPECT_FALSE(load_image("/nonexistent/a.png", "a.png"));
}

TEST(Image, ImageLargerThanTheCallersLimitIsRefused) {
  ExrPicture picture{{2, 2}, {}, {}};
  for (const char* c : {"R", "G", "B"}) picture.channels[c] = ExrFloat{{1, 2, 3, 4}};
  const auto exr = write_exr(picture);
  ASSERT_TRUE(exr);
  const std::string png_file = png(2, 2, PNG_FORMAT_RGB, kRgb), jpeg_file = jpeg(2, 2, 3, 9);
  const auto hdr_file =
      std::string("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n") + std::string(16, 'a');
  for (const std::span<const std::byte> file :
       {std::span<const std::byte>(*exr), std::span<const std::byte>(bytes_of(png_file)),
        std::span<const std::byte>(bytes_of(jpeg_file)), std::span<const std::byte>(bytes_of(hdr_file))}) {
    EXPECT_TRUE(decode_image("a", file, 4));
    const auto refused = decode_image("a", file, 3);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, Errc::resource_exhausted);
    EXPECT_THAT(refused.error().message, HasSubstr("2 x 2 pixels"));
  }
}

std::string pfm(const std::string& header, std::initializer_list<float> values, bool big_endian = false) {
  std::string s = header;
  for (const float v : values) {
    append(s, v);
    if (big_endian) std::reverse(s.end() - 4, s.end());
  }
  return s;
}
Result<ImageData> decode_pfm_file(const std::string& file) { return decode_image("a.pfm", bytes_of(file)); }
std::string pfm_error(const std::string& file) {
  const auto r = decode_pfm_file(file);
  return r ? "accepted" : r.error().message;
}

TEST(Pfm, RowsRunFromTheBottom) {
  const auto i = decode_pfm_file(pfm("PF\n1 2\n-1.0\n", {1, 2, 3, 4, -5, 6e10f}));
  ASSERT_TRUE(i) << i.error().message;
  EXPECT_EQ(i->width, 1u);
  EXPECT_EQ(i->height, 2u);
  EXPECT_EQ(i->channels, 3u);
  EXPECT_FALSE(i->srgb);
  EXPECT_THAT(i->f32, ElementsAre(4, -5, 6e10f, 1, 2, 3));
}

TEST(Pfm, SignOfTheScaleIsTheByteOrder) {
  EXPECT_THAT(decode_pfm_file(pfm("Pf\n2 1\n1\n", {1.5f, -2}, true))->f32, ElementsAre(1.5f, -2));
  EXPECT_THAT(decode_pfm_file(pfm("Pf 2 1 -1\n", {1.5f, -2}))->f32, ElementsAre(1.5f, -2));
}

TEST(Pfm, ScaleIsAFactor) {
  EXPECT_THAT(decode_pfm_file(pfm("Pf\n1 2\n-0.5\n", {3, 4}))->f32, ElementsAre(2, 1.5f));
}

// The byte after this blank belongs to the first value, even if it looks like another blank.
TEST(Pfm, SingleBlankEndsTheHeader) {
  const auto i = decode_pfm_file(std::string("Pf\n1 1\n-1\n\x20\x0a\x80\x3f", 14));
  ASSERT_TRUE(i) << i.error().message;
  EXPECT_EQ(i->f32.at(0), 0x1.001440p+0f);  // 0x3f800a20
}

TEST(Pfm, ReportsErrors) {
  EXPECT_THAT(pfm_error("PF\n0 1\n-1\n"),
              HasSubstr("'a.pfm': broken PFM image: its header has no believable"));
  EXPECT_THAT(pfm_error("PF\n-1 1\n-1\n"), HasSubstr("no believable width and height"));
  EXPECT_THAT(pfm_error("PF\n40000 1\n-1\n"), HasSubstr("no believable width and height"));
  EXPECT_THAT(pfm_error("PF\n1 1 1\n\n"), HasSubstr("too short"));
  EXPECT_THAT(pfm_error("PF\n1 1\nx\n"), HasSubstr("no scale"));
  EXPECT_THAT(pfm_error("PF\n1 1\n0\n"), HasSubstr("no scale"));
  EXPECT_THAT(pfm_error("PF\n1 1\nnan\n"), HasSubstr("no scale"));
  EXPECT_THAT(pfm_error("PF\n16384 16384\n-1\n"), HasSubstr("too short"));
  EXPECT_EQ(decode_pfm("a.pfm", bytes_of("PF\n2 2\n-1\n"), 3).error().code, Errc::resource_exhausted);
}

TEST(Pfm, SurvivesRandomDamage) {
  const auto plain = [](std::string_view name, std::span<const std::byte> file) {
    return decode_pfm(name, file, 1 << 16);
  };
  const std::string file = pfm("PF\n1 2\n-1.0\n", {1, 2, 3, 4, 5, 6});
  EXPECT_EQ(test::accepted_truncations(file, plain), 0);
  test::survive_mutations(file, plain, [](const ImageData& image) {
    EXPECT_EQ(image.f32.size(), std::size_t{image.width} * image.height * image.channels);
  });
}

}  // namespace
}  // namespace ls

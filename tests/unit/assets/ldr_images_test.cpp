// BMP, QOI and TGA images.
#include <gmock/gmock.h>

#include <initializer_list>

#include "core/assets/image.h"
#include "tests/unit/assets/hostile.h"

namespace ls {
namespace {

using test::append;
using test::bytes_of;
using testing::ElementsAre;
using testing::HasSubstr;

std::string refusal(const Result<ImageData>& r) { return r ? "accepted" : r.error().message; }

// Returns a bitmap of 2 x 2 pixels, with the rows in the order of the file. Two zero bytes pad each 24-bit
// row to a multiple of four.
std::string bmp(std::uint16_t bits, std::int32_t height, std::uint32_t compression = 0,
                std::int32_t width = 2) {
  std::string s = "BM";
  for (const std::uint32_t v : {70u, 0u, 54u, 40u}) append(s, v);
  append(s, width);
  append(s, height);
  append(s, std::uint16_t{1});
  append(s, bits);
  append(s, compression);
  s.append(20, '\0');
  const auto pixel = [&](int r, int g, int b) {
    for (const int v : {b, g, r}) s += static_cast<char>(v);
    if (bits == 32) s += '\x7f';
  };
  pixel(255, 0, 0), pixel(0, 255, 0);
  if (bits == 24) s.append(2, '\0');
  pixel(0, 0, 255), pixel(10, 20, 30);
  if (bits == 24) s.append(2, '\0');
  return s;
}
Result<ImageData> decode(const std::string& file) { return decode_image("a.bmp", bytes_of(file)); }

TEST(Bmp, RowsRunFromTheBottomUnlessTheHeightIsNegative) {
  for (const std::uint16_t bits : {24, 32}) {
    const auto up = decode(bmp(bits, 2)), down = decode(bmp(bits, -2));
    ASSERT_TRUE(up && down) << bits;
    EXPECT_EQ(up->width, 2u);
    EXPECT_EQ(up->height, 2u);
    EXPECT_EQ(up->channels, 3u);
    EXPECT_TRUE(up->srgb);
    EXPECT_THAT(up->u8, ElementsAre(0, 0, 255, 10, 20, 30, 255, 0, 0, 0, 255, 0));
    EXPECT_THAT(down->u8, ElementsAre(255, 0, 0, 0, 255, 0, 0, 0, 255, 10, 20, 30));
  }
}

TEST(Bmp, RefusesUnsupportedKindsByName) {
  const auto error = [](const std::string& file) {
    const auto r = decode(file);
    return r ? std::string() : r.error().message;
  };
  EXPECT_THAT(error(bmp(8, 2)), HasSubstr("'a.bmp': a BMP image of 8 bits a pixel"));
  EXPECT_THAT(error(bmp(24, 2, 1)), HasSubstr("save it as PNG"));
  EXPECT_THAT(error(bmp(24, 0)), HasSubstr("its size is 2 x 0"));
  EXPECT_THAT(error(bmp(24, 2, 0, -2)), HasSubstr("its size is -2 x 2"));
  EXPECT_THAT(error(bmp(24, 3)), HasSubstr("too short"));
  EXPECT_EQ(decode_bmp("a.bmp", bytes_of(bmp(24, 2)), 3).error().code, Errc::resource_exhausted);
}

TEST(Bmp, SurvivesRandomDamage) {
  const auto plain = [](std::string_view name, std::span<const std::byte> file) {
    return decode_bmp(name, file);
  };
  EXPECT_EQ(test::accepted_truncations(bmp(24, 2), plain), 0);
  test::survive_mutations(bmp(32, 2), plain, [](const ImageData& image) {
    EXPECT_EQ(image.u8.size(), std::size_t{image.width} * image.height * 3);
  });
}

std::string qoi(std::uint32_t width, std::uint32_t height, int channels, std::initializer_list<int> chunks,
                int space = 0) {
  std::string s = "qoif";
  for (const std::uint32_t n : {width, height})
    for (int shift = 24; shift >= 0; shift -= 8) s += static_cast<char>(n >> shift & 0xff);
  s += static_cast<char>(channels);
  s += static_cast<char>(space);
  for (const int b : chunks) s += static_cast<char>(b);
  return s;
}
Result<ImageData> decode_qoi_file(const std::string& file) { return decode_image("a.qoi", bytes_of(file)); }
std::string qoi_error(const std::string& file) { return refusal(decode_qoi_file(file)); }

TEST(Qoi, EveryKindOfChunkIsRead) {
  // The chunks: rgb 10 20 30; differences +1 -2 0; luma: green +10, red +10 - 8, blue +10 + 7; a run of 2;
  // rgba 1 2 3 4; the index of an earlier pixel. This is the first pixel's hash, (10 * 3 + 20 * 5 + 30 * 7 +
  // 255 * 11) mod 64 = 9.
  const auto i = decode_qoi_file(qoi(
      7, 1, 4,
      {0xfe, 10, 20, 30, 0x40 | 3 << 4 | 0 << 2 | 2, 0x80 | 42, 0x0f, 0xc0 | 1, 0xff, 1, 2, 3, 4, 0x00 | 9}));
  ASSERT_TRUE(i) << i.error().message;
  EXPECT_EQ(i->width, 7u);
  EXPECT_EQ(i->height, 1u);
  EXPECT_EQ(i->channels, 4u);
  EXPECT_TRUE(i->srgb);
  EXPECT_THAT(i->u8, ElementsAre(10, 20, 30, 255, 11, 18, 30, 255, 13, 28, 47, 255, 13, 28, 47, 255, 13, 28,
                                 47, 255, 1, 2, 3, 4, 10, 20, 30, 255));
}

TEST(Qoi, BeginsWithBlackAndWrapsAround) {
  EXPECT_THAT(decode_qoi_file(qoi(1, 2, 3, {0xc0, 0x40 | 1 << 4 | 2 << 2 | 3}))->u8,
              ElementsAre(0, 0, 0, 255, 0, 1));
}

TEST(Qoi, DistinguishesLinearFromSrgb) { EXPECT_FALSE(decode_qoi_file(qoi(1, 1, 3, {0xc0}, 1))->srgb); }

TEST(Qoi, ReportsErrors) {
  EXPECT_THAT(qoi_error("qoif"), HasSubstr("'a.qoi': broken QOI image: its header"));
  EXPECT_THAT(qoi_error(qoi(1, 1, 5, {0xc0})), HasSubstr("its header"));
  EXPECT_THAT(qoi_error(qoi(1, 1, 3, {0xc0}, 2)), HasSubstr("its header"));
  EXPECT_THAT(qoi_error(qoi(0, 1, 3, {0xc0})), HasSubstr("its size is 0 x 1"));
  EXPECT_THAT(qoi_error(qoi(1, 1u << 31, 3, {0xc0})), HasSubstr("its size is 1 x 2147483648"));
  EXPECT_THAT(qoi_error(qoi(2, 1, 3, {0xc0})), HasSubstr("too short"));
  EXPECT_THAT(qoi_error(qoi(1, 1, 3, {0xfe, 1, 2})), HasSubstr("too short"));
  // The header claims more pixels than the file can contain at 62 pixels per byte, the longest run.
  EXPECT_THAT(qoi_error(qoi(16384, 16384, 3, {0xfd})), HasSubstr("too short"));
  EXPECT_EQ(decode_qoi("a.qoi", bytes_of(qoi(2, 2, 3, {0xc3})), 3).error().code, Errc::resource_exhausted);
}

TEST(Qoi, SurvivesRandomDamage) {
  const auto plain = [](std::string_view name, std::span<const std::byte> file) {
    return decode_qoi(name, file, 1 << 16);
  };
  const std::string file = qoi(3, 2, 4, {0xfe, 10, 20, 30, 0x72, 0xaa, 0x0f, 0xc1, 0xff, 1, 2, 3, 4});
  EXPECT_EQ(test::accepted_truncations(file, plain), 0);
  test::survive_mutations(file, plain, [](const ImageData& image) {
    EXPECT_EQ(image.u8.size(), std::size_t{image.width} * image.height * image.channels);
  });
}

struct TgaFields {
  std::uint8_t type = 2, bits = 24, order = 0x20;  // order: rows from the top
  std::uint16_t width = 2, height = 2;
  std::uint16_t map_first = 0, map_count = 0;
  std::uint8_t map_bits = 0;
};

std::string tga(const TgaFields& h, std::initializer_list<int> rest, const std::string& id = "") {
  std::string s;
  s += static_cast<char>(id.size());
  s += static_cast<char>(h.map_bits > 0);
  s += static_cast<char>(h.type);
  append(s, h.map_first), append(s, h.map_count), append(s, h.map_bits);
  append(s, std::uint32_t{0});
  append(s, h.width), append(s, h.height);
  append(s, h.bits), append(s, h.order);
  s += id;
  for (const int b : rest) s += static_cast<char>(b);
  return s;
}
Result<ImageData> decode_tga_file(const std::string& file) { return decode_image("a.TGA", bytes_of(file)); }
std::string tga_error(const std::string& file) { return refusal(decode_tga_file(file)); }

TEST(Tga, TrueColourIsBlueGreenRed) {
  const auto i = decode_tga_file(tga({}, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, "some words"));
  ASSERT_TRUE(i) << i.error().message;
  EXPECT_EQ(i->width, 2u);
  EXPECT_EQ(i->height, 2u);
  EXPECT_EQ(i->channels, 3u);
  EXPECT_TRUE(i->srgb);
  EXPECT_THAT(i->u8, ElementsAre(3, 2, 1, 6, 5, 4, 9, 8, 7, 12, 11, 10));
}

TEST(Tga, RowAndColumnOrderFollowsTheHeader) {
  const auto grey = [](std::uint8_t order) {
    const auto i = decode_tga_file(tga({.type = 3, .bits = 8, .order = order}, {1, 2, 3, 4}));
    EXPECT_TRUE(i) << i.error().message;
    return i ? i->u8 : std::vector<std::uint8_t>{};
  };
  EXPECT_THAT(grey(0x20), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(grey(0x00), ElementsAre(3, 4, 1, 2)) << "from the bottom";
  EXPECT_THAT(grey(0x30), ElementsAre(2, 1, 4, 3)) << "from the right";
  EXPECT_THAT(grey(0x10), ElementsAre(4, 3, 2, 1));
}

TEST(Tga, FourBytePixelsHaveAlphaIfTheHeaderSaysSo) {
  const TgaFields plain{.bits = 32, .width = 1, .height = 1},
      with{.bits = 32, .order = 0x28, .width = 1, .height = 1};
  EXPECT_THAT(decode_tga_file(tga(plain, {1, 2, 3, 4}))->u8, ElementsAre(3, 2, 1));
  EXPECT_THAT(decode_tga_file(tga(with, {1, 2, 3, 4}))->u8, ElementsAre(3, 2, 1, 4));
}

TEST(Tga, TwoBytesHaveFiveBitsPerColour) {
  // Red is 31 of 31, green 16, blue 1. In 8 bits these are 255, 16 * 255 / 31 = 131.6 and 8.2.
  const int low = (16 & 7) << 5 | 1, high = 31 << 2 | 16 >> 3;
  for (const std::uint8_t bits : {15, 16})
    EXPECT_THAT(decode_tga_file(tga({.bits = bits, .width = 1, .height = 1}, {low, high}))->u8,
                ElementsAre(255, 132, 8));
  const TgaFields alpha{.bits = 16, .order = 0x21, .width = 2, .height = 1};
  EXPECT_THAT(decode_tga_file(tga(alpha, {low, high, low, high | 0x80}))->u8,
              ElementsAre(255, 132, 8, 0, 255, 132, 8, 255));
}

TEST(Tga, ReadsIndexedColours) {
  TgaFields h{.type = 1, .bits = 8, .map_first = 5, .map_count = 2, .map_bits = 24};
  EXPECT_THAT(decode_tga_file(tga(h, {1, 2, 3, 4, 5, 6, 5, 6, 6, 5}))->u8,
              ElementsAre(3, 2, 1, 6, 5, 4, 6, 5, 4, 3, 2, 1));
  EXPECT_THAT(tga_error(tga(h, {1, 2, 3, 4, 5, 6, 5, 6, 6, 4})),
              HasSubstr("has the colour 4, which its map lacks"));
  EXPECT_THAT(tga_error(tga(h, {1, 2, 3, 4, 5, 6, 5, 6, 6, 7})), HasSubstr("has the colour 7"));
  h.bits = 16;
  EXPECT_THAT(decode_tga_file(tga(h, {1, 2, 3, 4, 5, 6, 5, 0, 6, 0, 6, 0, 5, 0}))->u8,
              ElementsAre(3, 2, 1, 6, 5, 4, 6, 5, 4, 3, 2, 1));
  EXPECT_THAT(tga_error(tga(h, {1, 2, 3, 4, 5})), HasSubstr("its colour map is cut off"));
  h.map_bits = 8;
  EXPECT_THAT(tga_error(tga(h, {1, 2, 5, 0, 6, 0, 6, 0, 5, 0})), HasSubstr("not understood"));
}

TEST(Tga, SkipsTheColourMapOfATrueColourImage) {
  const TgaFields h{.width = 1, .height = 1, .map_count = 2, .map_bits = 16};
  EXPECT_THAT(decode_tga_file(tga(h, {9, 9, 9, 9, 1, 2, 3}))->u8, ElementsAre(3, 2, 1));
}

TEST(Tga, RunsContinueInTheNextRow) {
  // A run of three pixels of one colour, then a packet of one plain pixel.
  EXPECT_THAT(decode_tga_file(tga({.type = 10}, {0x82, 1, 2, 3, 0x00, 4, 5, 6}))->u8,
              ElementsAre(3, 2, 1, 3, 2, 1, 3, 2, 1, 6, 5, 4));
  EXPECT_THAT(decode_tga_file(tga({.type = 11, .bits = 8}, {0x01, 1, 2, 0x81, 7}))->u8,
              ElementsAre(1, 2, 7, 7));
  EXPECT_THAT(
      decode_tga_file(tga({.type = 9, .bits = 8, .map_count = 1, .map_bits = 24}, {1, 2, 3, 0x83, 0}))->u8,
      ElementsAre(3, 2, 1, 3, 2, 1, 3, 2, 1, 3, 2, 1));
  EXPECT_THAT(tga_error(tga({.type = 11, .bits = 8}, {0x01, 1, 2, 0x81})), HasSubstr("too short"));
  // A run may be longer than the image. Its excess is ignored.
  EXPECT_THAT(decode_tga_file(tga({.type = 11, .bits = 8}, {0xff, 7}))->u8, ElementsAre(7, 7, 7, 7));
}

TEST(Tga, RefusesUnsupportedKindsByName) {
  EXPECT_THAT(tga_error(tga({.type = 0}, {})),
              HasSubstr("'a.TGA': a TGA image of type 0 with 24 bits a pixel"));
  EXPECT_THAT(tga_error(tga({.type = 10, .bits = 8}, {})), HasSubstr("of type 10 with 8 bits"));
  EXPECT_THAT(tga_error(tga({.type = 32}, {})), HasSubstr("broken TGA image: its header"));
  EXPECT_THAT(tga_error(tga({.order = 0x40}, {})), HasSubstr("broken TGA image: its header"));
  EXPECT_THAT(tga_error(tga({.width = 0}, {})), HasSubstr("its size is 0 x 2"));
  EXPECT_THAT(tga_error(tga({.width = 40000}, {})), HasSubstr("its size is 40000 x 2"));
  EXPECT_THAT(tga_error(tga({}, {1, 2, 3})), HasSubstr("too short"));
  EXPECT_EQ(decode_tga("a.tga", bytes_of(tga({}, {})), 3).error().code, Errc::resource_exhausted);
}

TEST(Tga, IsRecognisedByItsNameOnly) {
  const std::string file = tga({.width = 1, .height = 1}, {1, 2, 3});
  EXPECT_TRUE(decode_image("b.tga", bytes_of(file)));
  EXPECT_THAT(decode_image("b.dat", bytes_of(file)).error().message, HasSubstr("does not end in .tga"));
}

// The header claims more pixels than the file can contain at 128 pixels per packet, the longest run.
TEST(Tga, HugeClaimedSizesCostNoMemory) {
  for (const std::uint8_t type : {2, 10})
    EXPECT_THAT(tga_error(tga({.type = type, .width = 16384, .height = 16384}, {1, 2, 3})),
                HasSubstr("too short"));
}

TEST(Tga, SurvivesRandomDamage) {
  const auto plain = [](std::string_view name, std::span<const std::byte> file) {
    return decode_tga(name, file, 1 << 16);
  };
  const std::string colour = tga({}, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}),
                    packed = tga({.type = 10}, {0x82, 1, 2, 3, 0x00, 4, 5, 6}),
                    mapped = tga({.type = 1, .bits = 8, .map_count = 2, .map_bits = 32},
                                 {1, 2, 3, 4, 5, 6, 7, 8, 0, 1, 1, 0});
  for (const std::string& file : {colour, packed, mapped}) {
    EXPECT_EQ(test::accepted_truncations(file, plain), 0);
    test::survive_mutations(file, plain, [](const ImageData& image) {
      EXPECT_EQ(image.u8.size(), std::size_t{image.width} * image.height * image.channels);
    });
  }
}

}  // namespace
}  // namespace ls

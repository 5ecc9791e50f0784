// Truevision TGA.
#include <gmock/gmock.h>

#include <initializer_list>

#include "common/assets/image.h"
#include "tests/unit/assets/hostile.h"

namespace ls {
namespace {

using test::append;
using test::bytes_of;
using testing::ElementsAre;
using testing::HasSubstr;

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
std::string tga_error(const std::string& file) {
  const auto r = decode_tga_file(file);
  return r ? "accepted" : r.error().message;
}

TEST(Tga, TrueColourIsBlueGreenRed) {
  const auto i = decode_tga_file(tga({}, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, "some words"));
  ASSERT_TRUE(i) << i.error().message;
  EXPECT_EQ(i->width, 2u);
  EXPECT_EQ(i->height, 2u);
  EXPECT_EQ(i->channels, 3u);
  EXPECT_TRUE(i->srgb);
  EXPECT_THAT(i->u8, ElementsAre(3, 2, 1, 6, 5, 4, 9, 8, 7, 12, 11, 10));
}

TEST(Tga, RowsAndColumnsRunAsTheHeaderSays) {
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

TEST(Tga, FourBytesHaveAlphaIfTheHeaderSaysSo) {
  const TgaFields plain{.bits = 32, .width = 1, .height = 1},
      with{.bits = 32, .order = 0x28, .width = 1, .height = 1};
  EXPECT_THAT(decode_tga_file(tga(plain, {1, 2, 3, 4}))->u8, ElementsAre(3, 2, 1));
  EXPECT_THAT(decode_tga_file(tga(with, {1, 2, 3, 4}))->u8, ElementsAre(3, 2, 1, 4));
}

TEST(Tga, TwoBytesHaveFiveBitsAColour) {
  // Red is 31 of 31, green 16, blue 1. In 8 bits these are 255, 16 * 255 / 31 = 131.6 and 8.2.
  const int low = (16 & 7) << 5 | 1, high = 31 << 2 | 16 >> 3;
  for (const std::uint8_t bits : {15, 16})
    EXPECT_THAT(decode_tga_file(tga({.bits = bits, .width = 1, .height = 1}, {low, high}))->u8,
                ElementsAre(255, 132, 8));
  const TgaFields alpha{.bits = 16, .order = 0x21, .width = 2, .height = 1};
  EXPECT_THAT(decode_tga_file(tga(alpha, {low, high, low, high | 0x80}))->u8,
              ElementsAre(255, 132, 8, 0, 255, 132, 8, 255));
}

TEST(Tga, ColoursMayBeNumbersOfAMap) {
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

TEST(Tga, AMapOfATrueColourImageIsPassedOver) {
  const TgaFields h{.width = 1, .height = 1, .map_count = 2, .map_bits = 16};
  EXPECT_THAT(decode_tga_file(tga(h, {9, 9, 9, 9, 1, 2, 3}))->u8, ElementsAre(3, 2, 1));
}

TEST(Tga, RunsGoOnInTheNextRow) {
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

TEST(Tga, WhatIsNotUnderstoodIsRefusedByName) {
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

TEST(Tga, IsToldByItsNameAlone) {
  const std::string file = tga({.width = 1, .height = 1}, {1, 2, 3});
  EXPECT_TRUE(decode_image("b.tga", bytes_of(file)));
  EXPECT_THAT(decode_image("b.dat", bytes_of(file)).error().message, HasSubstr("does not end in .tga"));
}

// The header claims more pixels than the file can contain at 128 pixels per packet, the longest run.
TEST(Tga, HugeClaimsCostNoMemory) {
  for (const std::uint8_t type : {2, 10})
    EXPECT_THAT(tga_error(tga({.type = type, .width = 16384, .height = 16384}, {1, 2, 3})),
                HasSubstr("too short"));
}

TEST(Tga, NoDamageDoesHarm) {
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

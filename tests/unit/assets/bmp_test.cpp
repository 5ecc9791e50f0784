// Windows bitmaps.
#include <gmock/gmock.h>

#include "common/assets/image.h"
#include "tests/unit/assets/hostile.h"

namespace ls {
namespace {

using test::append;
using test::bytes_of;
using testing::ElementsAre;
using testing::HasSubstr;

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

TEST(Bmp, WhatIsNotUnderstoodIsRefusedByName) {
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

TEST(Bmp, NoDamageDoesHarm) {
  const auto plain = [](std::string_view name, std::span<const std::byte> file) {
    return decode_bmp(name, file);
  };
  EXPECT_EQ(test::accepted_truncations(bmp(24, 2), plain), 0);
  test::survive_mutations(bmp(32, 2), plain, [](const ImageData& image) {
    EXPECT_EQ(image.u8.size(), std::size_t{image.width} * image.height * 3);
  });
}

}  // namespace
}  // namespace ls

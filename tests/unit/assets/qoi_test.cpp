// QOI images.
#include <gmock/gmock.h>

#include "common/assets/image.h"
#include "tests/unit/assets/hostile.h"

namespace ls {
namespace {

using test::bytes_of;
using testing::ElementsAre;
using testing::HasSubstr;

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
std::string qoi_error(const std::string& file) {
  const auto r = decode_qoi_file(file);
  return r ? "accepted" : r.error().message;
}

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

TEST(Qoi, LinearCodesAreToldFromThoseOfSrgb) { EXPECT_FALSE(decode_qoi_file(qoi(1, 1, 3, {0xc0}, 1))->srgb); }

TEST(Qoi, WhatIsWrongIsTold) {
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

TEST(Qoi, NoDamageDoesHarm) {
  const auto plain = [](std::string_view name, std::span<const std::byte> file) {
    return decode_qoi(name, file, 1 << 16);
  };
  const std::string file = qoi(3, 2, 4, {0xfe, 10, 20, 30, 0x72, 0xaa, 0x0f, 0xc1, 0xff, 1, 2, 3, 4});
  EXPECT_EQ(test::accepted_truncations(file, plain), 0);
  test::survive_mutations(file, plain, [](const ImageData& image) {
    EXPECT_EQ(image.u8.size(), std::size_t{image.width} * image.height * image.channels);
  });
}

}  // namespace
}  // namespace ls

// Portable Float Maps.
#include <gmock/gmock.h>

#include <algorithm>

#include "common/assets/image.h"
#include "tests/unit/assets/hostile.h"

namespace ls {
namespace {

using test::append;
using test::bytes_of;
using testing::ElementsAre;
using testing::HasSubstr;

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

TEST(Pfm, TheSignOfTheScaleIsTheByteOrder) {
  EXPECT_THAT(decode_pfm_file(pfm("Pf\n2 1\n1\n", {1.5f, -2}, true))->f32, ElementsAre(1.5f, -2));
  EXPECT_THAT(decode_pfm_file(pfm("Pf 2 1 -1\n", {1.5f, -2}))->f32, ElementsAre(1.5f, -2));
}

TEST(Pfm, TheScaleIsAFactor) {
  EXPECT_THAT(decode_pfm_file(pfm("Pf\n1 2\n-0.5\n", {3, 4}))->f32, ElementsAre(2, 1.5f));
}

// The byte after this blank belongs to the first value, even if it looks like another blank.
TEST(Pfm, OneBlankEndsTheHeader) {
  const auto i = decode_pfm_file(std::string("Pf\n1 1\n-1\n\x20\x0a\x80\x3f", 14));
  ASSERT_TRUE(i) << i.error().message;
  EXPECT_EQ(i->f32.at(0), 0x1.001440p+0f);  // 0x3f800a20
}

TEST(Pfm, WhatIsWrongIsTold) {
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

TEST(Pfm, NoDamageDoesHarm) {
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

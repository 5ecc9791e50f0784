// Tests images that are read from files of the user.
#include "compare/picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "core/image/exr/exr_file.h"

namespace ls::race {
namespace {

using testing::HasSubstr;

constexpr FrameSize kSize{4, 3};

struct Scratch {
  std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "race-pictures";
  Scratch() { std::filesystem::create_directories(path); }
  ~Scratch() { std::filesystem::remove_all(path); }
};

std::filesystem::path write_picture(const Scratch& scratch, FrameSize size, float first) {
  const auto values = static_cast<std::size_t>(size.width * size.height);
  ExrPicture picture{size, {}, {}};
  for (const char* channel : {"R", "G", "B"})
    picture.channels[channel] = ExrFloat{std::vector<float>(values, first)};
  const auto bytes = write_exr(picture);
  const auto file = scratch.path / "picture.exr";
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));
  return file;
}

TEST(HandedIn, ImagesAreReadAndKept) {
  const Scratch scratch;
  const auto pixels = read_picture(write_picture(scratch, kSize, .25f), kSize);
  ASSERT_TRUE(pixels) << pixels.error().message;

  ASSERT_TRUE(keep(scratch.path / "kept", *pixels));
  EXPECT_EQ(*kept(scratch.path / "kept", kSize), *pixels);
  EXPECT_EQ(pixels->size(), 36u);
}

// With the standard errors s of the reference, the squared error is (x - ref)^2 - s^2.
TEST(HandedIn, ReferencesOwnErrorIsSubtracted) {
  const Scratch scratch;
  ExrPicture picture{kSize, {}, {}};
  for (const std::string channel : {"R", "G", "B"}) {
    picture.channels[channel] = ExrFloat{std::vector<float>(12, 2)};
    picture.channels["stderr." + channel] = ExrFloat{std::vector<float>(12, .25f)};
  }
  const auto bytes = write_exr(picture);
  std::ofstream(scratch.path / "ref.exr", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));
  const auto known = read_reference(scratch.path / "ref.exr", kSize),
             unknown = read_reference(write_picture(scratch, kSize, 2), kSize);
  ASSERT_TRUE(known && unknown);

  const Pixels x(36, 2.5f);
  EXPECT_DOUBLE_EQ(wrong(x, combine({*unknown})).mse, .25);
  EXPECT_DOUBLE_EQ(wrong(x, combine({*known})).mse, .25 - .0625);
  EXPECT_NEAR(wrong(x, combine({*known})).relmse, (.25 - .0625) / (4 + .01), 1e-15);  // 36 values are summed
  EXPECT_DOUBLE_EQ(noise_of(combine({*known})), .0625 / (4 + .01));
  EXPECT_EQ(describe({*known}), "ref.exr, less its own noise by its layers of errors");
  EXPECT_EQ(describe({*unknown}), "picture.exr, whose own noise counts as everybody's error");
}

TEST(HandedIn, OtherSizesAreNamed) {
  const Scratch scratch;
  EXPECT_THAT(read_picture(write_picture(scratch, {3, 3}, 1), kSize).error().message,
              HasSubstr("is 3 x 3 pixels"));
}

TEST(HandedIn, LargerImagesAreRefusedUnread) {
  const Scratch scratch;
  EXPECT_FALSE(read_picture(write_picture(scratch, {40, 30}, 1), kSize));
}

TEST(HandedIn, NonFiniteValuesAreCounted) {
  const Scratch scratch;
  const auto bad = read_picture(write_picture(scratch, kSize, std::nanf("")), kSize);
  EXPECT_THAT(bad.error().message, HasSubstr("36 values that are NaN or infinite, the first in pixel 0,0"));
}

TEST(HandedIn, FileThatIsNotAnExrIsNamed) {
  const Scratch scratch;
  const auto file = scratch.path / "picture.exr";
  std::ofstream(file) << "this is no picture";
  EXPECT_THAT(read_picture(file, kSize).error().message, HasSubstr("picture.exr"));
  EXPECT_FALSE(read_picture(scratch.path / "none.exr", kSize));
}

}  // namespace
}  // namespace ls::race

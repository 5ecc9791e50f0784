// Reference images are decoded by another process, which nothing that a file does can harm.
#include "coordinator/admission/decoded_reference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/image/exr/exr_file.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

using testing::HasSubstr;

std::vector<std::byte> grey_exr(FrameSize size, float level) {
  ExrPicture p{size, {}, {}};
  for (const char* c : {"R", "G", "B"}) p.channels[c] = ExrFloat{std::vector<float>(size.pixels(), level)};
  return write_exr(p).value();
}

// A program that stands in for lightshaft-exr.
std::filesystem::path decoder(const TempFolder& folder, const std::string& commands) {
  const auto path = folder.path() / "decoder";
  std::ofstream(path) << "#!/bin/sh\n" << commands << "\n";
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

TEST(DecodedReference, MatchesTheLibrarysDecoding) {
  const FrameSize size{40, 24};
  const auto exr = grey_exr(size, .5F);

  const auto read = decode_reference(exr, size, {});
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->rgb, read_reference(exr, "the reference", size)->rgb);
  EXPECT_EQ(decode_reference(exr, {41, 24}, {}).error().message,
            read_reference(exr, "the reference", {41, 24}).error().message);

  const auto missing = decode_reference(exr, size, {}, "/no/such/lightshaft-exr");
  EXPECT_EQ(missing.error().code, Errc::failed_precondition);
  EXPECT_THAT(missing.error().message, HasSubstr("/no/such/lightshaft-exr"));
}

TEST(DecodedReference, FileThatCrashesOrTakesOverItsDecoderIsRefused) {
  const TempFolder folder;
  const FrameSize size{40, 24};
  const auto exr = grey_exr(size, .5F);
  const auto error = [&](const std::string& commands) {
    const auto read = decode_reference(exr, size, {}, decoder(folder, commands));
    return read ? Error{} : read.error();
  };

  EXPECT_THAT(error("kill -SEGV $$").message, HasSubstr("crashed"));
  EXPECT_THAT(error("exit 3").message, HasSubstr("ended with 3"));
  EXPECT_THAT(error("exit 0").message, HasSubstr("no answer"));
  // Bytes that the decoder writes all over the shared memory are no image; it cannot shorten it either.
  EXPECT_EQ(error("yes | head -c 4096 >&3; exit 0").code, Errc::invalid_argument);
}

}  // namespace
}  // namespace ls::coordinator

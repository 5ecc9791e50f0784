#include "core/base/file_form.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "core/base/text/name_forms.h"

namespace ls {
namespace {

using testing::HasSubstr;

std::string gzipped(std::string_view bytes) {
  z_stream z{};
  EXPECT_EQ(deflateInit2(&z, 9, Z_DEFLATED, 15 + 16, 9, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&z, bytes.size()) + 32, '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  z.avail_in = static_cast<uInt>(bytes.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&z, Z_FINISH), Z_STREAM_END);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

TEST(FileForm, GzipIsUnpackedWithAllItsMembersAndPadding) {
  const std::string long_text(200'000, 'x');
  EXPECT_EQ(plain_bytes("a", std::string("plain")).value(), "plain");
  EXPECT_EQ(plain_bytes("a", std::string()).value(), "");
  EXPECT_EQ(plain_bytes("a", gzipped("")).value(), "");
  EXPECT_EQ(plain_bytes("a", gzipped(long_text)).value(), long_text);
  EXPECT_EQ(plain_bytes("a", gzipped("one ") + gzipped("two")).value(), "one two");
  EXPECT_EQ(plain_bytes("a", gzipped("one") + std::string(512, '\0')).value(), "one");
}

TEST(FileForm, DamagedGzipIsRefusedByName) {
  const std::string whole = gzipped("a text of some length, in which no word comes twice");
  for (std::size_t n = 3; n < whole.size(); ++n) {
    const auto cut = plain_bytes("a.gz", whole.substr(0, n));
    ASSERT_FALSE(cut) << n;
    EXPECT_EQ(cut.error().message, "'a.gz': is packed by gzip, and damaged or cut short");
  }
  EXPECT_FALSE(plain_bytes("a.gz", whole + "rest"));
}

TEST(FileForm, TooLargeUnpackedSizeIsRefused) {
  const std::string bomb = gzipped(std::string(1 << 20, '\0'));
  ASSERT_LT(bomb.size(), 2000u);

  const auto unpacked = plain_bytes("a.gz", bomb, 1 << 19);

  ASSERT_FALSE(unpacked);
  EXPECT_EQ(unpacked.error().code, Errc::resource_exhausted);
  EXPECT_TRUE(plain_bytes("a.gz", bomb, 1 << 20));
}

TEST(FileForm, GitLfsPointerIsRecognisedPackedOrNot) {
  const std::string pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:ab\nsize 7\n";
  for (const std::string& file : {pointer, gzipped(pointer)})
    EXPECT_THAT(plain_bytes("a.ply", file).error().message, HasSubstr("'a.ply': is a pointer of Git LFS"));
  EXPECT_EQ(why_placeholder("version 3"), "");
}

TEST(FileForm, RecognisesNamesAndByteMarks) {
  EXPECT_EQ(without_gz("a.vdb.gz"), "a.vdb");
  EXPECT_EQ(without_gz("a.vdb"), "a.vdb");
  EXPECT_EQ(without_mark("\xef\xbb\xbfv"), "v");
  EXPECT_EQ(why_no_utf8("v 0 0 0"), "");
  EXPECT_EQ(why_no_utf8(""), "");
  EXPECT_THAT(why_no_utf8("\xfe\xff"), HasSubstr("UTF-16"));
}

TEST(NameForms, LettersAndAccentsAreComposed) {
  EXPECT_EQ(composed("man\u0303ana"), "ma\u00f1ana");
  EXPECT_EQ(composed("e\u0302\u0301"), "\u1ebf");                               // Vietnamese: two accents
  EXPECT_EQ(composed("\u0438\u0306"), "\u0439");                                // Cyrillic
  EXPECT_EQ(composed("\u306f\u3099"), "\u3070");                                // kana
  EXPECT_EQ(composed("\u1112\u1161\u11ab\u1100\u1173\u11af"), "\ud55c\uae00");  // hangul
  EXPECT_EQ(composed("ma\u00f1ana \xff\xc3"), "ma\u00f1ana \xff\xc3");          // composed already; no UTF-8
  EXPECT_EQ(composed("\U0001f980q\u0301"), "\U0001f980q\u0301");                // no such letter
  EXPECT_EQ(with_slashes("a\\b/c"), "a/b/c");
}

}  // namespace
}  // namespace ls

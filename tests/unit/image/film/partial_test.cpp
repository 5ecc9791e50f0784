#include "core/image/film/partial.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/image/frame/render_limits.h"
#include "tests/unit/image/support.h"

namespace ls {
namespace {

using test::make_partial;
using ::testing::HasSubstr;

constexpr FrameSize kFrame{20, 13};
const TileGrid kPartialGrid{kFrame, 8};

std::vector<std::byte> encoded(const Partial& partial, FrameSize frame = kFrame) {
  auto bytes = encode_partial(partial, frame);
  EXPECT_TRUE(bytes) << bytes.error().message;
  return bytes.value_or(std::vector<std::byte>{});
}

std::string refusal(std::span<const std::byte> exr, const UnitHeader& expected, FrameSize frame = kFrame) {
  const auto got = decode_partial(exr, expected, frame);
  return got ? "accepted" : got.error().message;
}

std::size_t find(const std::vector<std::byte>& bytes, std::string_view text) {
  const auto at = std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()).find(text);
  EXPECT_NE(at, std::string_view::npos) << text;
  return at;
}

TEST(UnitHeader, CanonicalJsonIsSortedAndWithoutSpaces) {
  const UnitHeader header{Digest{}, Digest{}, Digest{}, {8, 0, 16, 8}, {2, 4}};
  const std::string zero(64, '0');

  EXPECT_EQ(canonical_json(header), "{\"class\":\"" + zero + "\",\"s0\":2,\"s1\":4,\"scene\":\"" + zero +
                                        "\",\"settings\":\"" + zero + "\",\"tile\":[8,0,16,8]}");
}

TEST(UnitHeader, ParsesWhatItWrites) {
  const UnitHeader header = make_partial(kPartialGrid, 4, {64, 128}).header;

  EXPECT_EQ(parse_unit_header(canonical_json(header)).value(), header);
}

TEST(UnitHeader, RefusesOtherSpellingsAndWrongValuesByName) {
  const std::string good = canonical_json(make_partial(kPartialGrid, 4, {64, 128}).header);
  const auto with = [&](std::string_view from, std::string_view to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    const auto got = parse_unit_header(text);
    return got ? "accepted" : got.error().message;
  };

  EXPECT_THAT(with("{", "{ "), HasSubstr("canonical"));
  EXPECT_THAT(with("{", "{\"host\":\"x\","), HasSubstr("canonical"));
  EXPECT_THAT(with("\"s0\":64", "\"s0\":63"), HasSubstr("'s0' is 63"));
  EXPECT_THAT(with("\"s0\":64", "\"s0\":-2"), HasSubstr("'s0'"));
  EXPECT_THAT(with("\"s0\":64", "\"s0\":64.0"), HasSubstr("'s0'"));
  EXPECT_THAT(with("\"s1\":128", "\"s1\":64"), HasSubstr("empty"));
  EXPECT_THAT(with("\"s1\":128", "\"s1\":18446744073709551617"), HasSubstr("'s1'"));
  EXPECT_THAT(with("\"tile\":[", "\"tile\":[-"), HasSubstr("'tile'"));
  EXPECT_THAT(with("\"scene\":\"", "\"scene\":\"Z"), HasSubstr("'scene'"));
  EXPECT_THAT(with("\"class\":", "\"clas\":"), HasSubstr("'class'"));
  EXPECT_THAT(with("}", ""), HasSubstr("not a JSON object"));
  EXPECT_FALSE(parse_unit_header(std::string(100000, '[')));
}

TEST(Partial, SurvivesEncodingBitForBit) {
  for (TileIndex tile = 0; tile < kPartialGrid.count(); ++tile) {
    Partial partial = make_partial(kPartialGrid, tile, {2, 4});
    partial.sums[0] = -0.0f;
    partial.sums[1] = std::numeric_limits<float>::denorm_min();
    partial.sums[2] = std::numeric_limits<float>::max();

    const auto back = decode_partial(encoded(partial), partial.header, kFrame);

    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->header, partial.header);
    EXPECT_EQ(std::memcmp(back->sums.data(), partial.sums.data(), partial.sums.size() * sizeof(float)), 0);
    EXPECT_EQ(unit_digest(*back), unit_digest(partial));
  }
}

TEST(Partial, FileContainsItsHeaderAndFrame) {
  const Partial partial = make_partial(kPartialGrid, 5, {0, 2});

  const auto file = decode_partial_file(encoded(partial));

  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->partial, partial);
  EXPECT_EQ(file->frame, kFrame);
}

TEST(Partial, DigestDependsOnHeaderAndOnEveryPlane) {
  const Partial partial = make_partial(kPartialGrid, 0, {0, 2});
  const Digest digest = unit_digest(partial);

  for (std::size_t plane = 0; plane < 6; ++plane) {
    Partial other = partial;
    other.sums[plane * 64 + 5] += 1;
    EXPECT_NE(unit_digest(other), digest) << plane;
  }
  Partial later = partial;
  later.header.samples = {2, 4};
  EXPECT_NE(unit_digest(later), digest);
}

TEST(Partial, IsNotWrittenWithWrongSizeOrValues) {
  Partial partial = make_partial(kPartialGrid, 0, {0, 2});
  partial.sums.pop_back();
  EXPECT_FALSE(encode_partial(partial, kFrame));

  partial = make_partial(kPartialGrid, 0, {0, 2});
  partial.sums[64 * 4 + 8 * 3 + 2] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(encode_partial(partial, kFrame).error().message, HasSubstr("B.G of pixel (2, 3) is nan"));

  EXPECT_FALSE(encode_partial(make_partial(kPartialGrid, 5, {0, 2}), {8, 8}));
}

TEST(PartialGate, RefusesEveryTruncation) {
  const Partial partial = make_partial(kPartialGrid, 2, {0, 2});
  const auto exr = encoded(partial);

  for (std::size_t n = 0; n < exr.size(); ++n)
    ASSERT_NE(refusal(std::span(exr).first(n), partial.header), "accepted") << n;
}

TEST(PartialGate, RefusesTrailingBytes) {
  const Partial partial = make_partial(kPartialGrid, 2, {0, 2});
  auto exr = encoded(partial);
  exr.push_back(std::byte{0});

  EXPECT_THAT(refusal(exr, partial.header), HasSubstr("needs exactly"));
}

// If one bit is flipped, the file is rejected, or it decodes to other sums and so has another digest, or the
// byte is one that is not decoded (aspect ratio, screen window, the "linear" hints of the channels).
TEST(PartialGate, DetectsEveryFlippedBit) {
  const Partial partial = make_partial(kPartialGrid, 5, {0, 2});
  const auto good = encoded(partial);
  const Digest digest = unit_digest(partial);
  std::size_t harmless = 0;

  for (std::size_t i = 0; i < good.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      auto exr = good;
      exr[i] ^= static_cast<std::byte>(1 << bit);
      const auto got = decode_partial(exr, partial.header, kFrame);
      if (got && unit_digest(*got) == digest) ++harmless;
    }
  }

  // The bytes that are not decoded: 4 for each of six channels, 4 of pixelAspectRatio, 8 of
  // screenWindowCenter, 4 of screenWindowWidth.
  EXPECT_EQ(harmless, 8u * (6 * 4 + 4 + 8 + 4));
}

TEST(PartialGate, NamesWhatIsWrong) {
  const Partial partial = make_partial(kPartialGrid, 4, {2, 4});
  const auto good = encoded(partial);
  const auto with = [&](std::size_t at, int value) {
    auto exr = good;
    exr[at] = static_cast<std::byte>(value);
    return refusal(exr, partial.header);
  };

  EXPECT_THAT(with(0, 0), HasSubstr("magic"));
  EXPECT_THAT(with(4, 3), HasSubstr("version 3"));
  EXPECT_THAT(with(5, 0x02), HasSubstr("tiled"));
  EXPECT_THAT(with(5, 0x08), HasSubstr("deep"));
  EXPECT_THAT(with(5, 0x10), HasSubstr("several parts"));
  EXPECT_THAT(with(find(good, "compression\0compression") + 28, 3), HasSubstr("compressed"));
  EXPECT_THAT(with(find(good, "lineOrder\0lineOrder") + 24, 1), HasSubstr("order"));
  EXPECT_THAT(with(find(good, "A.G"), 'C'), HasSubstr("'C.G' stands where 'A.G' belongs"));
  EXPECT_THAT(with(find(good, "A.G") + 4, 1), HasSubstr("FLOAT"));
  EXPECT_THAT(with(find(good, "A.G") + 12, 2), HasSubstr("sampling"));
  EXPECT_THAT(with(find(good, "pixelAspect"), 'x'), HasSubstr("'xixelAspectRatio' does not belong"));
  EXPECT_THAT(with(find(good, "dataWindow\0box2i") + 21, 0xff), HasSubstr("dataWindow"));
}

TEST(PartialGate, RefusesAnotherUnitNamingTheDifference) {
  const Partial partial = make_partial(kPartialGrid, 4, {2, 4});
  const auto exr = encoded(partial);
  const auto expecting = [&](auto change) {
    UnitHeader header = partial.header;
    change(header);
    return refusal(exr, header);
  };

  EXPECT_THAT(expecting([](UnitHeader& h) { h.scene.bytes[0] ^= 1; }), HasSubstr("scene"));
  EXPECT_THAT(expecting([](UnitHeader& h) { h.settings.bytes[0] ^= 1; }), HasSubstr("settings"));
  EXPECT_THAT(expecting([](UnitHeader& h) { h.numeric_class.bytes[0] ^= 1; }), HasSubstr("numeric class"));
  EXPECT_THAT(expecting([](UnitHeader& h) {
                h.tile = {0, 0, 8, 8};
              }),
              HasSubstr("tile [8,8,16,13], expected [0,0,8,8]"));
  EXPECT_THAT(expecting([](UnitHeader& h) {
                h.samples = {4, 8};
              }),
              HasSubstr("samples [2, 4), expected [4, 8)"));
  EXPECT_THAT(refusal(exr, partial.header, {20, 14}), HasSubstr("frame is 20x13, expected 20x14"));
}

TEST(PartialGate, RefusesNonFiniteSumsNamingThePixel) {
  const Partial partial = make_partial(kPartialGrid, 4, {2, 4});
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
    auto exr = encoded(partial);
    // The last pixel of the last channel (B.R) in the last line.
    std::memcpy(exr.data() + exr.size() - sizeof bad, &bad, sizeof bad);

    EXPECT_THAT(refusal(exr, partial.header), HasSubstr("B.R of pixel (15, 12)"));
  }
}

TEST(PartialGate, DoesNotAllocateForAHugeTile) {
  const Partial partial = make_partial(kPartialGrid, 0, {0, 2});
  auto exr = encoded(partial);
  std::string json = canonical_json(partial.header);
  const std::size_t at = find(exr, json);
  std::string huge = json;
  huge.replace(huge.find("8,8]"), 4, "9,9]");
  std::memcpy(exr.data() + at, huge.data(), huge.size());
  const std::int32_t window[4] = {0, 0, kMaxFrameSide - 2, kMaxFrameSide - 2};
  std::memcpy(exr.data() + find(exr, "dataWindow") + 21, window, sizeof window);

  EXPECT_THAT(refusal(exr, partial.header), HasSubstr("is not the unit's tile"));

  const std::int32_t beyond[4] = {0, 0, kMaxFrameSide, 0};  // bounds are inclusive
  std::memcpy(exr.data() + find(exr, "dataWindow") + 21, beyond, sizeof beyond);
  EXPECT_THAT(refusal(exr, partial.header), HasSubstr("is out of range"));
}

}  // namespace
}  // namespace ls

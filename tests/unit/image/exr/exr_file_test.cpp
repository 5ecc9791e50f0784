#include "core/image/exr/exr_file.h"

#include <ImfChannelList.h>
#include <ImfChromaticities.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfTiledOutputFile.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <climits>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>

#include "core/image/exr/memory.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

// Odd, and more rows than one band of the reader.
constexpr int kExrWidth = 37, kExrHeight = 70;

// Returns values that half floats represent exactly: small multiples of 1/8.
float value(int x, int y, int c) { return static_cast<float>((x * 3 + y * 5 + c * 7) % 64) / 8; }

// Returns values from 0.05 to 8 that have more bits than a half float, so that a lossy compression changes
// them.
float fine_value(int x, int y, int c) {
  return (value(x, y, c) + .05f) * (1 + 1e-4f * static_cast<float>(x));
}

std::vector<float> plane(int c, float (*value_at)(int, int, int) = value) {
  std::vector<float> out;
  for (int y = 0; y < kExrHeight; ++y)
    for (int x = 0; x < kExrWidth; ++x) out.push_back(value_at(x, y, c));
  return out;
}

void expect_rgb(const Result<RgbImage>& image, bool grey = false) {
  ASSERT_TRUE(image) << image.error().message;
  ASSERT_EQ(image->size, (FrameSize{kExrWidth, kExrHeight}));
  for (int y = 0, i = 0; y < kExrHeight; ++y)
    for (int x = 0; x < kExrWidth; ++x)
      for (int c = 0; c < 3; ++c, ++i)
        ASSERT_EQ(image->rgb[static_cast<std::size_t>(i)], value(x, y, grey ? 0 : c))
            << x << " " << y << " " << c;
}

// The parameters of a file of another program.
struct Foreign {
  int x0 = 0, y0 = 0;
  Imf::Compression compression = Imf::ZIP_COMPRESSION;
  Imf::PixelType type = Imf::FLOAT;
  std::vector<std::string> channels = {"R", "G", "B"};
  bool tiled = false;
  float (*value)(int x, int y, int c) = ls::value;
  std::optional<Imf::Chromaticities> primaries = std::nullopt;
};

std::vector<std::byte> write(const Foreign& f) {
  exr::MemoryWriter out;
  const Imath::Box2i window({f.x0, f.y0}, {f.x0 + kExrWidth - 1, f.y0 + kExrHeight - 1});
  Imf::Header header(window, window, 1, {0, 0}, 1, Imf::INCREASING_Y, f.compression);
  if (f.primaries) Imf::addChromaticities(header, *f.primaries);
  if (f.tiled) header.setTileDescription(Imf::TileDescription(16, 16, Imf::ONE_LEVEL));
  Imf::FrameBuffer buffer;
  std::vector<std::vector<float>> floats;
  std::vector<std::vector<half>> halves;
  floats.reserve(8), halves.reserve(8);
  for (std::size_t c = 0; c < f.channels.size(); ++c) {
    floats.push_back(plane(static_cast<int>(c), f.value));
    halves.emplace_back(floats.back().begin(), floats.back().end());
    const void* data =
        f.type == Imf::HALF ? static_cast<const void*>(halves.back().data()) : floats.back().data();
    header.channels().insert(f.channels[c], Imf::Channel(f.type));
    buffer.insert(f.channels[c], Imf::Slice::Make(f.type, data, window.min, kExrWidth, kExrHeight));
  }
  if (f.tiled) {
    Imf::TiledOutputFile file(out, header, 0);
    file.setFrameBuffer(buffer);
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
  } else {
    Imf::OutputFile file(out, header, 0);
    file.setFrameBuffer(buffer);
    file.writePixels(kExrHeight);
  }
  return out.take();
}

TEST(ExrRead, UnderstandsEveryLosslessCompressionTypeAndLayout) {
  for (const auto compression : {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION,
                                 Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION})
    for (const auto type : {Imf::HALF, Imf::FLOAT})
      for (const bool tiled : {false, true})
        expect_rgb(
            read_exr_rgb(write({.compression = compression, .type = type, .tiled = tiled}), "foreign"));
}

// ---- colours and alpha of textures ----

// Returns the linear sRGB that an image's matrix makes of the stored colour (.25, .5, .25).
std::array<double, 3> in_srgb(const Imf::Chromaticities& primaries) {
  const auto image = read_exr_image(write({.primaries = primaries}), "wide");
  std::array<double, 3> out{};
  EXPECT_TRUE(image && image->to_srgb);
  if (!image || !image->to_srgb) return out;
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t k = 0; k < 3; ++k)
      out[row] += double{(*image->to_srgb)[3 * row + k]} * (k == 1 ? .5 : .25);
  return out;
}

// The expected values are those of Mitsuba 3.9.1, which computes in float: it and we are exact to about 1e-6.
TEST(ExrImage, ChromaticitiesAreConvertedAsInMitsuba) {
  using V2 = Imath::V2f;
  const V2 d65(.3127f, .3290f), aces(.32168f, .33767f);
  const struct {
    Imf::Chromaticities primaries;
    std::array<double, 3> srgb;
  } rows[] = {
      {{V2(.708f, .292f), V2(.17f, .797f), V2(.131f, .046f), d65},
       {.10308978, .53322476, .2248553}},  // Rec. 2020
      {{V2(.7347f, .2653f), V2(0, 1), V2(.0001f, -.077f), aces},
       {-.01809171, .59013957, .1916973}},  // ACES AP0
      {{V2(.713f, .293f), V2(.165f, .83f), V2(.128f, .044f), aces},
       {.11076511, .53234595, .19739203}}  // ACES AP1
  };
  for (const auto& row : rows) {
    const auto got = in_srgb(row.primaries);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(got[k], row.srgb[k], 2e-6) << k;
  }
  // X, Y, Z by their chromaticities. Mitsuba's matrix for these has four digits after the point.
  const auto xyz = in_srgb({V2(1, 0), V2(0, 1), V2(0, 0), V2(1 / 3.f, 1 / 3.f)});
  EXPECT_NEAR(xyz[0], -.083089, 2e-4);
  EXPECT_NEAR(xyz[1], .706071, 2e-4);
  EXPECT_NEAR(xyz[2], .176218, 2e-4);
}

TEST(ExrImage, Rec709IsUnchangedAndInvalidPrimariesGiveNoMatrix) {
  EXPECT_FALSE(read_exr_image(write({}), "plain")->to_srgb);
  EXPECT_FALSE(read_exr_image(write({.primaries = Imf::Chromaticities()}), "rec709")->to_srgb);
  EXPECT_FALSE(read_exr_image(write({.channels = {"Y"}}), "grey")->to_srgb);
  const Imath::V2f one(.3f, .3f);
  const auto nonsense =
      read_exr_image(write({.primaries = Imf::Chromaticities(one, one, one, one)}), "flat.exr");
  ASSERT_TRUE(nonsense && nonsense->to_srgb);
  EXPECT_FALSE(std::isfinite((*nonsense->to_srgb)[0]));
}

TEST(ExrImage, HasAlphaIfTheFileHas) {
  const auto with = read_exr_image(write({.channels = {"R", "G", "B", "A"}}), "alpha"),
             without = read_exr_image(write({}), "none"),
             grey = read_exr_image(write({.channels = {"Y", "A"}}), "grey");
  ASSERT_TRUE(with && without && grey);
  EXPECT_EQ(with->channels, 4u);
  EXPECT_EQ(without->channels, 3u);
  EXPECT_EQ(with->values.at(3), value(0, 0, 3));
  EXPECT_EQ(grey->channels, 4u);
  EXPECT_EQ(grey->values.at(2), value(0, 0, 0));
  EXPECT_EQ(grey->values.at(3), value(0, 0, 1));
}

// ---- lossy compression: the largest error that its definition allows ----

// An image before and after compression: R, G, B of each pixel, row by row.
struct Pair {
  std::vector<float> was, is;
  float before(int x, int y, int c) const { return was[at(x, y, c)]; }
  float after(int x, int y, int c) const { return is[at(x, y, c)]; }
  static std::size_t at(int x, int y, int c) { return static_cast<std::size_t>((y * kExrWidth + x) * 3 + c); }
};

Pair packed(Imf::Compression compression, Imf::PixelType type, bool tiled) {
  const auto image = read_exr_rgb(
      write({.compression = compression, .type = type, .tiled = tiled, .value = fine_value}), "lossy");
  if (!image) throw std::runtime_error(image.error().message);
  Pair pair{{}, image->rgb};
  for (int y = 0; y < kExrHeight; ++y)
    for (int x = 0; x < kExrWidth; ++x)
      for (int c = 0; c < 3; ++c) {
        const float v = fine_value(x, y, c);
        pair.was.push_back(type == Imf::HALF ? float(half(v)) : v);
      }
  if (pair.was.size() != pair.is.size()) throw std::runtime_error("another size");
  return pair;
}

// For each channel of each block, calls check(x, y, c) for its pixels and then done(x0, y0, c).
template <class Check, class Done>
void each_block(int side, Check check, Done done) {
  for (int c = 0; c < 3; ++c)
    for (int y0 = 0; y0 < kExrHeight; y0 += side)
      for (int x0 = 0; x0 < kExrWidth; x0 += side) {
        for (int y = y0; y < std::min(kExrHeight, y0 + side); ++y)
          for (int x = x0; x < std::min(kExrWidth, x0 + side); ++x) check(x, y, c);
        done(x0, y0, c);
      }
}

TEST(ExrRead, ReadsPxr24WithFloatsOf24Bits) {
  for (const bool tiled : {false, true}) {
    EXPECT_EQ(packed(Imf::PXR24_COMPRESSION, Imf::HALF, tiled).is,
              packed(Imf::PXR24_COMPRESSION, Imf::HALF, tiled).was);
    const Pair p = packed(Imf::PXR24_COMPRESSION, Imf::FLOAT, tiled);
    EXPECT_NE(p.is, p.was);
    // The format keeps a sign, 8 bits of exponent and 15 of mantissa, rounded to nearest: the relative error
    // is at most 2^-16.
    for (std::size_t i = 0; i < p.was.size(); ++i)
      ASSERT_LE(std::abs(p.is[i] - p.was[i]), 0x1p-16f * p.was[i]) << i;
  }
}

// Returns the index of a positive half float among all of them in ascending order.
int step_of(float v) { return half(v).bits(); }

// A block of 4 x 4 halves stores its largest value, and for each value its distance from the largest in steps
// of 2^s halves. s is the smallest number for which the differences of neighbours fit into 6 bits. No
// difference exceeds spread / 2^s + 1, with `spread` the largest distance in the block. So s is 0 if spread
// is at most 30, and otherwise spread / 2^(s-1) > 30. Values are rounded to the nearest step, so the error is
// at most 2^(s-1) < spread / 30. Floats are not compressed.
TEST(ExrRead, ReadsB44WithinItsQuantisation) {
  for (const auto compression : {Imf::B44_COMPRESSION, Imf::B44A_COMPRESSION})
    for (const bool tiled : {false, true}) {
      EXPECT_EQ(packed(compression, Imf::FLOAT, tiled).is, packed(compression, Imf::FLOAT, tiled).was);
      const Pair p = packed(compression, Imf::HALF, tiled);
      EXPECT_NE(p.is, p.was);
      int least = INT_MAX, most = 0, off = 0;
      each_block(
          4,
          [&](int x, int y, int c) {
            const int was = step_of(p.before(x, y, c));
            least = std::min(least, was), most = std::max(most, was);
            off = std::max(off, std::abs(step_of(p.after(x, y, c)) - was));
          },
          [&](int x0, int y0, int c) {
            EXPECT_LE(off, (most - least) / 30.) << x0 << " " << y0 << " " << c;
            least = INT_MAX, most = off = 0;
          });
    }
}

// The scale on which DWA stores values: x^(1/2.2) up to 1, ln(x) / 2.2 + 1 above.
double on_dwa_scale(double v) { return v <= 1 ? std::pow(v, 1 / 2.2) : std::log(v) / 2.2 + 1; }

// The bound of the error on that scale. DWA applies an orthonormal cosine transform to blocks of 8 x 8 values
// of Y', Cb and Cr. It rounds the coefficients within 45 / 100,000 (the default level) times JPEG's
// quantisation table divided by the table's smallest number. The sum of squared errors of the 64 pixels is
// that of the 64 coefficients (Parseval). So the root mean square error is at most 0.00045 times that of the
// divided table: 6.71 for Y', 5.31 for Cb and Cr. Blue is Y' + 1.8556 Cb, red is Y' + 1.5747 Cr.
// Roundings to half floats add to this. The values are below 2.2, a coefficient is at most 8 times as large
// (a sum over 64 values, divided by 8), and a rounding is 2^-11 of the number: over a block, 2^-11 times 2.2
// per pixel. There are four such roundings (to the scale, to Y'CbCr, and back from both), which blue enlarges
// by up to 2.9.
TEST(ExrRead, ReadsDwaWithinItsQuantisation) {
  constexpr double kBase = 45. / 100'000, kY = 6.71 * kBase, kC = 5.31 * kBase;
  const double bound = kY + 1.8556 * kC + 2.9 * 4 * 0x1p-11 * 2.2;
  for (const auto compression : {Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION})
    for (const auto type : {Imf::HALF, Imf::FLOAT})
      for (const bool tiled : {false, true}) {
        const Pair p = packed(compression, type, tiled);
        if (!tiled)
          // Blocks that do not become smaller, as in small tiles, are stored uncompressed.
          EXPECT_NE(p.is, p.was);
        double squares = 0;
        each_block(
            8,
            [&](int x, int y, int c) {
              const double off = on_dwa_scale(p.after(x, y, c)) - on_dwa_scale(p.before(x, y, c));
              squares += off * off;
            },
            [&](int x0, int y0, int c) {
              EXPECT_LE(std::sqrt(squares / 64), bound) << x0 << " " << y0 << " " << c;
              squares = 0;
            });
      }
}

TEST(ExrRead, ReadsAnyDataWindow) {
  expect_rgb(read_exr_rgb(write({.x0 = -5, .y0 = 1000}), "shifted"));
  expect_rgb(read_exr_rgb(write({.x0 = 2'000'000, .y0 = -2'000'000, .tiled = true}), "far away"));
}

TEST(ExrRead, ReadsGreyAndIgnoresOtherChannels) {
  expect_rgb(read_exr_rgb(write({.channels = {"Y"}}), "grey"), true);
  expect_rgb(read_exr_rgb(write({.channels = {"R", "G", "B", "A", "Z"}}), "more"));
}

TEST(ExrRead, ReadsTheFirstPartWithColour) {
  exr::MemoryWriter out;
  {
    std::vector<Imf::Header> headers(2, Imf::Header(kExrWidth, kExrHeight));
    headers[0].setName("depth"), headers[1].setName("beauty");
    for (auto& h : headers) h.setType(Imf::SCANLINEIMAGE);
    headers[0].channels().insert("Z", Imf::Channel(Imf::FLOAT));
    for (const char* c : {"R", "G", "B"}) headers[1].channels().insert(c, Imf::Channel(Imf::FLOAT));
    Imf::MultiPartOutputFile file(out, headers.data(), 2, false, 0);
    const std::vector<float> planes[3] = {plane(0), plane(1), plane(2)};
    Imf::FrameBuffer depth, beauty;
    depth.insert("Z", Imf::Slice::Make(Imf::FLOAT, planes[0].data(), {0, 0}, kExrWidth, kExrHeight));
    const char* names[3] = {"R", "G", "B"};
    for (int c = 0; c < 3; ++c)
      beauty.insert(names[c], Imf::Slice::Make(Imf::FLOAT, planes[c].data(), {0, 0}, kExrWidth, kExrHeight));
    Imf::OutputPart first(file, 0), second(file, 1);
    first.setFrameBuffer(depth), second.setFrameBuffer(beauty);
    first.writePixels(kExrHeight), second.writePixels(kExrHeight);
  }
  expect_rgb(read_exr_rgb(out.take(), "parts"));
}

TEST(ExrRead, RefusesUnsupportedFilesByName) {
  const auto refusal = [](const Foreign& f) {
    const auto got = read_exr_rgb(write(f), "sky.exr");
    return got ? "accepted" : got.error().message;
  };
  EXPECT_THAT(refusal({.channels = {"X", "G", "B"}}), HasSubstr("sky.exr: no flat part"));
  EXPECT_THAT(refusal({.channels = {"Y", "RY", "BY"}}), HasSubstr("no flat part"));
  EXPECT_THAT(read_exr_rgb(std::vector<std::byte>(1000), "sky.exr").error().message,
              HasSubstr("sky.exr: cannot read this EXR: not an EXR file"));
  EXPECT_FALSE(read_exr_rgb(std::vector<std::byte>{}, "sky.exr"));
}

TEST(ExrRead, EnforcesItsLimits) {
  const auto exr = write({});

  EXPECT_THAT(read_exr_rgb(exr, "a", {.max_bytes = 100}).error().message, HasSubstr("limit"));
  EXPECT_THAT(read_exr_rgb(exr, "a", {.max_pixels = 1000}).error().message, HasSubstr("37 x 70"));
  EXPECT_EQ(read_exr_rgb(exr, "a", {.max_side = 69}).error().code, Errc::resource_exhausted);
  EXPECT_TRUE(read_exr_rgb(exr, "a",
                           {.max_bytes = exr.size(), .max_pixels = kExrWidth * kExrHeight, .max_side = 70}));
}

// Small files that claim a large size must be rejected before memory of that size is allocated.
TEST(ExrRead, RefusesClaimedSizesBeyondTheFile) {
  const ExrLimits wide{.max_pixels = std::uint64_t{1} << 32, .max_side = 1 << 30};
  const auto claim = [&](const Foreign& f, std::string_view attribute, std::size_t skip,
                         std::vector<std::int32_t> values) {
    auto exr = write(f);
    const std::string_view text(reinterpret_cast<const char*>(exr.data()), exr.size());
    const auto at = text.find(attribute);
    EXPECT_NE(at, std::string_view::npos);
    std::memcpy(exr.data() + at + attribute.size() + skip, values.data(), values.size() * 4);
    const auto got = read_exr_rgb(exr, "claim", wide);
    return got ? "accepted" : got.error().message;
  };
  // The bytes between an attribute's name and its value: a zero, the type with a zero, and the size.
  EXPECT_THAT(claim({}, "dataWindow", 1 + 6 + 4, {0, 0, 0, 99'999'999}), HasSubstr("ends too early"));
  EXPECT_THAT(claim({}, "dataWindow", 1 + 6 + 4, {-2147483647, -2147483647, 2147483646, 2147483646}),
              HasSubstr("limits"));
  EXPECT_THAT(claim({.tiled = true}, "tiles", 1 + 9 + 4, {1, 1}), HasSubstr("ends too early"));
  EXPECT_THAT(claim({.tiled = true}, "tiles", 1 + 9 + 4, {1 << 30, 1 << 30}), HasSubstr("needs more than"));
  EXPECT_THAT(claim({}, "channels", 1 + 7, {2147483647}), HasSubstr("more than the file has"));
  EXPECT_THAT(claim({}, "dataWindow", 1 + 6 + 4, {0, 0, 99'999'999, 15}), HasSubstr("needs more than"));
  EXPECT_THAT(claim({}, "dataWindow", 1 + 6 + 4, {0, 0, 1'999'999, 15}), HasSubstr("can hold packed"));
}

// The library would read only the first bytes of this value, and continue in its middle, where another
// attribute claims 2 GB.
TEST(ExrRead, RefusesAttributesThatHideOthers) {
  const std::string size("\x00\x00\x00\x7e", 4), hidden = std::string("\0\0\0\0hidden\0opaque\0", 18) + size;
  const auto file_with = [](const std::string& type, const std::string& value) {
    std::vector<std::byte> file = write({});
    std::string attribute = std::string("note\0", 5) + type + '\0';
    const auto length = static_cast<std::int32_t>(value.size());
    attribute.append(reinterpret_cast<const char*>(&length), 4).append(value);
    const auto* bytes = reinterpret_cast<const std::byte*>(attribute.data());
    file.insert(file.begin() + 8, bytes, bytes + attribute.size());
    return file;
  };
  for (const char* type : {"int", "float", "v2f", "m44f", "box2i", "timecode", "chlist", "preview"}) {
    const auto read = read_exr_rgb(file_with(type, hidden), "a.exr");
    ASSERT_FALSE(read) << type;
    EXPECT_THAT(read.error().message, HasSubstr("attribute 'note' is not as long")) << type;
  }
  EXPECT_FALSE(read_exr_rgb(file_with("stringvector", size + "abc"), "a.exr"));
  EXPECT_FALSE(read_exr_rgb(file_with("floatvector", "abc"), "a.exr"));

  // An inserted attribute of correct size is accepted. But it moves the pixels, so the chunk table is wrong,
  // and the file may be rejected for that.
  for (const auto& [type, value] :
       std::vector<std::pair<std::string, std::string>>{{"int", "abcd"},
                                                        {"stringvector", std::string("\1\0\0\0x", 5)},
                                                        {"preview", std::string("\1\0\0\0\1\0\0\0abcd", 12)},
                                                        {"unheard_of", "abc"}}) {
    const auto read = read_exr_rgb(file_with(type, value), "a.exr");
    if (!read) {
      EXPECT_THAT(read.error().message, testing::Not(HasSubstr("not as long"))) << type;
    }
  }
}

TEST(ExrRead, SurvivesEveryTruncation) {
  for (const bool tiled : {false, true}) {
    const auto exr = write({.type = Imf::HALF, .tiled = tiled});
    for (std::size_t n = 0; n < exr.size(); n += 3)
      ASSERT_FALSE(read_exr_rgb(std::span(exr).first(n), "cut")) << n;
  }
}

// Changes every byte of header and tables in three ways. The file may be read or rejected, but the reader
// must not crash (AddressSanitizer runs this test, too).
TEST(ExrRead, SurvivesDamage) {
  for (const bool tiled : {false, true}) {
    const auto good = write({.type = Imf::HALF, .tiled = tiled});
    std::size_t refused = 0;
    for (std::size_t i = 0; i < std::min<std::size_t>(good.size(), 800); ++i)
      for (const int flip : {0x01, 0x80, 0xff}) {
        auto exr = good;
        exr[i] ^= static_cast<std::byte>(flip);
        const auto got =
            read_exr_rgb(exr, "damaged", {.max_bytes = 1 << 20, .max_pixels = 1 << 20, .max_side = 4096});
        refused += !got;
      }
    EXPECT_GT(refused, 500u);
  }
}

TEST(ExrRead, ReadsFilesAndNamesMissingOnes) {
  const auto path = std::filesystem::path(::testing::TempDir()) / "lightshaft_exr_file_test.exr";
  const auto exr = write({});
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(exr.data()), static_cast<std::streamsize>(exr.size()));

  expect_rgb(read_exr_rgb(path));
  std::filesystem::remove(path);

  EXPECT_EQ(read_exr_rgb(path).error().code, Errc::not_found);
  EXPECT_FALSE(read_exr_rgb(std::filesystem::path(::testing::TempDir())));
}

TEST(ExrWrite, WritesHalfFloatAndIntegerChannels) {
  ExrPicture picture{{kExrWidth, kExrHeight}, {}, {{"lightshaft:test", "hello"}}};
  const char* names[3] = {"R", "G", "B"};
  for (int c = 0; c < 3; ++c) picture.channels[names[c]] = ExrHalf{plane(c)};
  picture.channels["depth.Z"] = ExrFloat{plane(1)};
  picture.channels["spp"] = ExrUint{std::vector<std::uint32_t>(kExrWidth * kExrHeight, 2049)};

  const auto exr = write_exr(picture);

  ASSERT_TRUE(exr) << exr.error().message;
  expect_rgb(read_exr_rgb(*exr, "own"));
  EXPECT_EQ(*exr, *write_exr(picture));
}

class Memory final : public ByteSink {
 public:
  Result<void> write(std::uint64_t at, std::span<const std::byte> more) override {
    if (at + more.size() > most) return fail(Errc::resource_exhausted, "the disk is full");
    bytes.resize(std::max<std::size_t>(bytes.size(), at + more.size()));
    std::copy(more.begin(), more.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
    return {};
  }
  std::size_t most = std::size_t{1} << 30;
  std::vector<std::byte> bytes;
};

// Returns some of an image's 50 rows. They are written in bands of 13 rows; neither number is a multiple of
// the 16 rows that are compressed together.
ExrPicture rows_of(int y0, int rows) {
  ExrPicture picture{{7, rows}, {}, {}};
  std::vector<float> half, full;
  std::vector<std::uint32_t> count;
  for (int i = 7 * y0; i < 7 * (y0 + rows); ++i) {
    half.push_back(static_cast<float>(i)), full.push_back(1 / (1 + static_cast<float>(i)));
    count.push_back(static_cast<std::uint32_t>(3 * i));
  }
  picture.channels = {{"R", ExrHalf{half}}, {"stderr.R", ExrFloat{full}}, {"spp", ExrUint{count}}};
  return picture;
}

TEST(ExrWrite, ImageWrittenInBandsEqualsTheWholeImage) {
  ExrPicture whole = rows_of(0, 50);
  whole.strings = {{"lightshaft:test", "hello"}};
  Memory sink;

  const auto written = write_sealed_exr(
      {{7, 50}, whole.strings, [](int band) { return rows_of(13 * band, std::min(13, 50 - 13 * band)); }},
      sink);

  ASSERT_TRUE(written) << written.error().message;
  exr::MemoryReader in(sink.bytes, "sealed");
  const std::string seal =
      Imf::InputFile(in).header().typedAttribute<Imf::StringAttribute>("lightshaft:seal").value();
  EXPECT_THAT(seal, HasSubstr(" header lightshaft:test\n"));
  EXPECT_THAT(seal, HasSubstr(" layer stderr.R\n"));
  whole.strings["lightshaft:seal"] = seal;
  EXPECT_EQ(sink.bytes, write_exr(whole).value());
}

TEST(ExrWrite, ReportsWhyABandCouldNotBeWritten) {
  const auto length = write_exr(rows_of(0, 50)).value().size();
  for (std::size_t most = 0; most < length; most += 97) {
    Memory sink;
    sink.most = most;
    const auto written =
        write_sealed_exr({{7, 50}, {}, [](int band) { return rows_of(25 * band, 25); }}, sink);
    ASSERT_FALSE(written) << most;
    EXPECT_EQ(written.error().code, Errc::resource_exhausted);
    EXPECT_EQ(written.error().message, "the disk is full");
  }
}

TEST(ExrWrite, RefusesBandsThatDoNotMatchTheImage) {
  Memory sink;
  EXPECT_FALSE(write_sealed_exr({{7, 40}, {}, [](int) { return rows_of(0, 25); }}, sink)) << "too many rows";
  EXPECT_FALSE(write_sealed_exr({{8, 50}, {}, [](int) { return rows_of(0, 25); }}, sink)) << "too narrow";
}

TEST(ExrWrite, RefusesPlanesOfTheWrongSize) {
  ExrPicture picture{{4, 4}, {{"R", ExrFloat{std::vector<float>(15)}}}, {}};
  EXPECT_THAT(write_exr(picture).error().message, HasSubstr("channel R"));
  EXPECT_FALSE(write_exr({{0, 4}, {}, {}}));
}

}  // namespace
}  // namespace ls

#include "core/image/exr/final_image.h"

#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/image/exr/exr_file.h"
#include "core/image/exr/memory.h"
#include "core/image/exr/pixel_layers.h"
#include "tests/unit/image/support.h"

namespace ls {
namespace {

using test::make_film;
using test::make_partial;
using ::testing::HasSubstr;

const TileGrid kFinalGrid{{20, 13}, 8};

// Returns a tile in which both halves of every pixel have this sum.
Partial flat(const TileGrid& grid, TileIndex tile, std::array<float, 3> half_sum) {
  Partial p = make_partial(grid, tile, {0, 2});
  const auto n = static_cast<std::size_t>(p.header.tile.pixels());
  for (std::size_t i = 0; i < p.sums.size(); ++i) p.sums[i] = half_sum[i / n % 3];
  return p;
}

std::string as_text(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(PixelsDigest, IsOverFloatsOfTheMeansRowByRow) {
  const Film film = make_film(kFinalGrid, 6);
  std::vector<float> pixels(20 * 13 * 3);
  for (TileIndex t = 0; t < kFinalGrid.count(); ++t) {
    const TilePixels tile = film.pixels(t);
    for (int i = 0; i < tile.rect.pixels(); ++i)
      for (int c = 0; c < 3; ++c) {
        const int x = tile.rect.x0 + i % tile.rect.width(), y = tile.rect.y0 + i / tile.rect.width();
        pixels[static_cast<std::size_t>((y * 20 + x) * 3 + c)] =
            static_cast<float>(tile.mean[static_cast<std::size_t>(3 * i + c)]);
      }
  }

  EXPECT_EQ(pixels_sha256(film), sha256(std::as_bytes(std::span(pixels))));
}

TEST(PixelsDigest, MakesNoDifferenceBetweenZeros) {
  const TileGrid grid{{8, 8}, 8};
  Film plus(grid), minus(grid);
  ASSERT_TRUE(plus.fold(0, 0, flat(grid, 0, {0.0f, 0.0f, 0.0f})));
  ASSERT_TRUE(minus.fold(0, 0, flat(grid, 0, {-0.0f, -0.0f, -0.0f})));

  EXPECT_EQ(pixels_sha256(plus), pixels_sha256(minus));
  EXPECT_EQ(pixels_sha256(plus), sha256(std::string(8 * 8 * 3 * 4, '\0')));
}

Provenance some_provenance() {
  Provenance from{test::name_of("scene"), R"({"seed":7})", "build 1", test::name_of("class"), 7, 12.3456};
  from.core_seconds = 98.7654;
  from.stopped = "time; so and so";
  return from;
}

TEST(FinalExr, HoldsMeansErrorsSamplesAndProvenance) {
  const Film film = make_film(kFinalGrid, 6);

  const auto image = final_exr(film, some_provenance(), {.float_output = true});
  ASSERT_TRUE(image) << image.error().message;
  const auto back = read_exr_rgb(image->exr, "final");

  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->size, kFinalGrid.frame);
  EXPECT_EQ(sha256(std::as_bytes(std::span(back->rgb))), pixels_sha256(film));
  const std::string text = as_text(image->exr);
  for (const char* name :
       {"stderr.R", "stderr.G", "stderr.B", "spp", "lightshaft:scene", "lightshaft:job", "lightshaft:build",
        "lightshaft:class", "lightshaft:seed", "lightshaft:relmse", "lightshaft:relmse_ci95",
        "lightshaft:rmse", "lightshaft:few_hits", "lightshaft:seconds", "lightshaft:tiles"})
    EXPECT_THAT(text, HasSubstr(name));
  EXPECT_THAT(text, HasSubstr(R"({"seed":7})"));
  const auto header = read_final_exr(image->exr, "final")->strings;
  EXPECT_EQ(header.at("lightshaft:core_seconds"), "98.765");
  EXPECT_EQ(header.at("lightshaft:stopped"), "time; so and so");
  EXPECT_EQ(header.at("lightshaft:verdict"), "trusted");
  for (TileIndex t = 0; t < kFinalGrid.count(); ++t) EXPECT_THAT(text, HasSubstr(film.tile_digest(t).hex()));
}

TEST(FinalExr, HasStandardAttributesForOtherPrograms) {
  Provenance from = some_provenance();
  from.camera = CameraMatrices{{1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 0, 13, 14, 15, 1}, RowMatrix{.5}};
  from.frames_per_second = 23.976;
  from.owner = "anna";
  const auto exr = final_exr(make_film(kFinalGrid, 2), from, {}).value().exr;

  exr::MemoryReader in(exr, "standard");
  const Imf::Header header = Imf::InputFile(in).header();

  const Imf::Chromaticities rec709;  // the library's default
  EXPECT_EQ(Imf::chromaticities(header).red, rec709.red);
  EXPECT_EQ(Imf::chromaticities(header).green, rec709.green);
  EXPECT_EQ(Imf::chromaticities(header).blue, rec709.blue);
  EXPECT_EQ(Imf::chromaticities(header).white, rec709.white);
  EXPECT_EQ(header.pixelAspectRatio(), 1);
  EXPECT_EQ(Imf::worldToCamera(header)[3][1], 14);  // the translation is in the last row
  EXPECT_EQ(Imf::worldToCamera(header)[1][3], 0);
  EXPECT_EQ(Imf::worldToNDC(header)[0][0], .5f);
  EXPECT_EQ(Imf::framesPerSecond(header), Imf::Rational(24000, 1001));
  EXPECT_EQ(Imf::owner(header), "anna");
  EXPECT_TRUE(read_final_exr(exr, "standard")->changed.value().empty()) << "they are part of the seal";
}

const std::vector<float>& floats_of(const FinalPicture& image, const std::string& layer) {
  return std::get<ExrFloat>(image.channels.at(layer)).values;
}

TEST(FinalExr, ColoursAndTheirStandardErrorsAreThoseOfTheSpace) {
  const Film film = make_film(kFinalGrid, 6);
  const ColourMatrix m = from_rec709(ColourSpace::acescg);

  const auto image = read_final_exr(
      final_exr(film, some_provenance(), {.float_output = true, .colour_space = ColourSpace::acescg})->exr,
      "acescg");

  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->strings.at("lightshaft:color_space"), "acescg");
  EXPECT_TRUE(image->changed.value().empty());
  for (TileIndex t = 0; t < kFinalGrid.count(); ++t) {
    const TilePixels tile = film.pixels(t);
    const auto halves = film.half_means(t);
    const auto n = static_cast<std::size_t>(tile.rect.pixels());
    each_pixel(tile.rect, kFinalGrid.frame, [&](std::size_t to, std::size_t from) {
      // The two halves as images of their own, converted
      Tristimulus a, b;
      for (std::size_t c = 0; c < 3; ++c) a[c] = halves[0][c * n + from], b[c] = halves[1][c * n + from];
      a = m * a, b = m * b;
      for (std::size_t c = 0; c < 3; ++c) {
        // Two roundings to float of the mean, and one of the error; the sums in double are exact by
        // comparison but for the cancellation of a - b, which is off by a few 2^-53 of a.
        EXPECT_NEAR(floats_of(*image, std::string(1, "RGB"[c]))[to], (a[c] + b[c]) / 2,
                    2 * 0x1p-24 * std::abs(a[c] + b[c]));
        EXPECT_NEAR(floats_of(*image, fmt::format("stderr.{}", "RGB"[c]))[to], std::abs(a[c] - b[c]) / 2,
                    0x1p-24 * std::abs(a[c] - b[c]) + 0x1p-48 * std::abs(a[c]));
      }
    });
  }
}

TEST(FinalExr, LayersInPartsAreTheSameLayers) {
  const Film film = make_film(kFinalGrid, 6);
  const auto one = read_final_exr(final_exr(film, some_provenance(), {})->exr, "one").value();
  for (const ExrCompression compression : exr_compressions()) {
    const ImageForm form{.compression = compression, .parts = ExrParts::layers};

    const auto image = read_final_exr(final_exr(film, some_provenance(), form)->exr, "parts");

    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->lossy, is_lossy(compression)) << to_string(compression);
    EXPECT_EQ(image->strings.at("lightshaft:scene"), one.strings.at("lightshaft:scene"));
    for (const char* layer : {"stderr.R", "stderr.G", "stderr.B"})
      EXPECT_EQ(floats_of(*image, layer), floats_of(one, layer));
    EXPECT_EQ(std::get<ExrUint>(image->channels.at("spp")).values,
              std::get<ExrUint>(one.channels.at("spp")).values);
    if (!is_lossy(compression))
      EXPECT_EQ(std::get<ExrHalf>(image->channels.at("R")).values,
                std::get<ExrHalf>(one.channels.at("R")).values);
    EXPECT_EQ(image->changed.has_value(), !is_lossy(compression));
    if (image->changed) EXPECT_TRUE(image->changed->empty()) << to_string(compression);
  }
  EXPECT_FALSE(final_exr(film, some_provenance(), {.compression = ExrCompression::dwaa}));
}

TEST(FinalExr, SealOfPartsFindsAChangedValue) {
  const auto exr =
      final_exr(make_film(kFinalGrid, 6), some_provenance(),
                {.float_output = true, .compression = ExrCompression::none, .parts = ExrParts::layers});
  std::vector<std::byte> forged = exr->exr;
  forged.back() ^= std::byte{1};  // a value of the last chunk

  const auto image = read_final_exr(forged, "forged");
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->changed.value().size(), 1u);
}

TEST(FinalExr, DependsOnlyOnFilmAndProvenance) {
  EXPECT_EQ(final_exr(make_film(kFinalGrid, 6), some_provenance(), {})->exr,
            final_exr(make_film(kFinalGrid, 6), some_provenance(), {})->exr);
}

TEST(FinalExr, ClampsToTheLargestHalfAndCounts) {
  const TileGrid grid{{8, 8}, 8};
  Film film(grid);
  ASSERT_TRUE(film.fold(0, 0, flat(grid, 0, {1e6f, -1e30f, 65504.0f})));

  const auto half = final_exr(film, some_provenance(), {}),
             full = final_exr(film, some_provenance(), {.float_output = true});

  EXPECT_EQ(half->clamped, 128u);
  EXPECT_EQ(full->clamped, 0u);
  const auto a = read_exr_rgb(half->exr, "half")->rgb, b = read_exr_rgb(full->exr, "full")->rgb;
  EXPECT_EQ((std::array{a[0], a[1], a[2]}), (std::array{65504.0f, -65504.0f, 65504.0f}));
  EXPECT_EQ((std::array{b[0], b[1], b[2]}), (std::array{1e6f, -1e30f, 65504.0f}));
}

TEST(FinalExr, RoundsToTheNearestHalf) {
  const TileGrid grid{{8, 8}, 8};
  Film film(grid);
  ASSERT_TRUE(film.fold(0, 0, flat(grid, 0, {0.1f, 1.0f, 3e-8f})));

  const auto rgb = read_exr_rgb(final_exr(film, some_provenance(), {})->exr, "half")->rgb;

  // Half a unit of the 10-bit mantissa.
  EXPECT_NEAR(rgb[0], 0.1f, 0.1f * 0x1p-11f);
  EXPECT_EQ(rgb[1], 1.0f);
  // Half of the smallest step of a half float, which is 2^-24.
  EXPECT_NEAR(rgb[2], 3e-8f, 0x1p-25f);
}

TEST(FinalExr, UnfinishedFilmHasZerosWithoutSamples) {
  Film film = make_film(kFinalGrid, 4);
  film.discard(0);

  const auto rgb = read_exr_rgb(final_exr(film, some_provenance(), {.float_output = true})->exr, "part")->rgb;

  EXPECT_EQ(rgb[0], 0);
  EXPECT_NE(rgb[3 * 8], 0);
}

TEST(FinalExr, HasNoErrorOfMissingPixels) {
  const auto strings = [](const Film& film) {
    return read_final_exr(final_exr(film, some_provenance(), {.float_output = true})->exr, "part")
        .value()
        .strings;
  };
  Film film = make_film(kFinalGrid, 4);
  const std::string whole = strings(film).at("lightshaft:relmse");
  EXPECT_FALSE(strings(film).contains("lightshaft:pixels_without_samples"));
  film.discard(0);

  const auto part = strings(film), none = strings(Film(kFinalGrid));

  EXPECT_EQ(part.at("lightshaft:pixels_without_samples"), std::to_string(kFinalGrid.rect(0).pixels()));
  // The error is the mean over the pixels that have samples. Pixels without samples must not lower it.
  TileError rest;
  for (TileIndex t = 1; t < kFinalGrid.count(); ++t) rest.add(film.error(t));
  EXPECT_EQ(part.at("lightshaft:relmse"), fmt::format("{:.9g}", image_error(rest).relmse));
  for (const char* key : {"relmse", "relmse_ci95", "rmse", "rmse_ci95", "verdict", "few_hits"})
    EXPECT_FALSE(none.contains(std::string("lightshaft:") + key)) << key;
}

TEST(FinalExr, IsUntrustedIfItsCurveIs) {
  const Film film = make_film(kFinalGrid, 4);
  Provenance from = some_provenance();
  from.convergence_status =
      ConvergenceStatus{ConvergenceStatus::Kind::heavy_tail, "don't trust yet: it falls too slowly", false};
  from.figures = {{"slope", -.5}};
  from.seed.reset();
  from.seconds.reset();

  const auto strings =
      read_final_exr(final_exr(film, from, {.float_output = true})->exr, "a tail").value().strings;

  EXPECT_NE(strings.at("lightshaft:verdict"), "trusted");
  EXPECT_EQ(strings.at("lightshaft:slope"), "-0.5");
  EXPECT_FALSE(strings.contains("lightshaft:seed"));
  EXPECT_FALSE(strings.contains("lightshaft:seconds"));
}

// A tile of two samples as flat() makes it, with the opacities that its two halves have.
Partial with_alpha(Partial p, float a, float b) {
  const auto n = static_cast<std::size_t>(p.header.tile.pixels());
  p.aovs = AovSet{}.with(Aov::alpha);
  p.sums.insert(p.sums.end(), n, a);
  p.sums.insert(p.sums.end(), n, b);
  return p;
}

TEST(FinalExr, HasAlphaWithItsStandardError) {
  Film film(kFinalGrid, AovSet{}.with(Aov::alpha));
  ASSERT_TRUE(film.fold(0, 0, with_alpha(flat(kFinalGrid, 0, {1, 1, 1}), .25f, .75f)));

  const auto image = read_final_exr(final_exr(film, some_provenance(), {})->exr, "alpha").value();

  EXPECT_EQ(std::get<ExrHalf>(image.channels.at("A")).values[0], .5f);
  EXPECT_EQ(std::get<ExrFloat>(image.channels.at("stderr.A")).values[0], .25f);  // half of the difference
  EXPECT_EQ(image.channels.count("alpha.A"), 0u);
}

// The opacity .25 of half A and .5 of half B; the shadow takes 1/4 of the light by half A, and 3/4 of half of
// the light by half B. Both halves together: 3/8 + 3/4 (1 - 1 / 2).
TEST(FinalExr, AddsTheShadowsOnShadowCatchersToAlphaAndOpacity) {
  Partial p = flat(kFinalGrid, 0, {1, 1, 1});
  p.aovs = AovSet{}.with(Aov::alpha).with(Aov::opacity).with(Aov::shadow_catcher).with(Aov::volume_opacity);
  const auto n = static_cast<std::size_t>(p.header.tile.pixels());
  for (const std::string& name : planes_of(p.aovs).names) {
    const bool a = name.find(".A.") != std::string::npos;
    float value = a ? .25f : .5f;
    if (name.ends_with("shadow_catcher.A.L")) value = .75f;
    if (name.ends_with("shadow_catcher.B.L")) value = .25f;
    if (name.find("shadow_catcher") != std::string::npos && name.ends_with(".T")) value = a ? 1 : .5f;
    if (name.find("shadow_catcher") != std::string::npos && name.ends_with(".U")) value = 1;
    p.sums.insert(p.sums.end(), n, value);
  }
  const float both = .375f + .75f * (1 - .5f), half_a = .25f + .25f, half_b = .5f + .5f * .75f;
  Film film(kFinalGrid, p.aovs);
  ASSERT_TRUE(film.fold(0, 0, p));

  const auto image = read_final_exr(final_exr(film, some_provenance(), {})->exr, "a shadow").value();
  const auto viewed = [&](std::string_view name) {
    return TileLayers(film, 0, true).values(pixel_layer(film.aovs(), name).value())[0];
  };

  EXPECT_EQ(std::get<ExrHalf>(image.channels.at("A")).values[0], both);
  EXPECT_EQ(std::get<ExrHalf>(image.channels.at("opacity.G")).values[0], both);
  EXPECT_EQ(std::get<ExrHalf>(image.channels.at("volume_opacity.G")).values[0], .375f);
  EXPECT_EQ(std::get<ExrFloat>(image.channels.at("stderr.A")).values[0], (half_b - half_a) / 2);
  EXPECT_EQ(std::get<ExrFloat>(image.channels.at("shadow_catcher.U")).values[0], 1);
  EXPECT_EQ(viewed("alpha"), both);
  EXPECT_EQ(viewed("volume_opacity"), .375f);
}

// No worker sends such sums. The image stores A as a half, which is clamped; the layer is a float.
TEST(FinalExr, HasAFiniteAlphaForAnySumsOfShadows) {
  for (const float through : {0.f, 1.f, 3e38f})
    for (const float unshadowed : {0.f, 1e-45f, -1e-45f, -1.f}) {
      Partial p = flat(kFinalGrid, 0, {1, 1, 1});
      p.aovs = AovSet{}.with(Aov::alpha).with(Aov::shadow_catcher);
      const auto n = static_cast<std::size_t>(p.header.tile.pixels());
      for (const std::string& name : planes_of(p.aovs).names)
        p.sums.insert(p.sums.end(), n,
                      name.ends_with(".U")                  ? unshadowed
                      : name.ends_with(".A.L")              ? 3e38f
                      : name.ends_with(".B.L")              ? -3e38f
                      : name.ends_with(".T") && through > 0 ? through
                                                            : 0.f);
      Film film(kFinalGrid, p.aovs);
      ASSERT_TRUE(film.fold(0, 0, p));

      const auto image = read_final_exr(final_exr(film, some_provenance(), {})->exr, "no light").value();
      const auto viewed = TileLayers(film, 0, true).values(pixel_layer(film.aovs(), "alpha").value());

      EXPECT_TRUE(std::isfinite(std::get<ExrHalf>(image.channels.at("A")).values[0])) << unshadowed;
      EXPECT_TRUE(std::isfinite(std::get<ExrFloat>(image.channels.at("stderr.A")).values[0])) << unshadowed;
      EXPECT_TRUE(std::isfinite(viewed[0])) << unshadowed;
    }
}

struct Decoded {
  FrameSize size;
  std::size_t channels;
  std::vector<png_byte> values;
  std::array<int, 3> at(int x, int y) const {
    const png_byte* p = pixel(x, y);
    return {p[0], p[1], p[2]};
  }
  int alpha(int x, int y) const { return pixel(x, y)[3]; }
  const png_byte* pixel(int x, int y) const {
    return &values[static_cast<std::size_t>(y * size.width + x) * channels];
  }
};
Decoded decode(const std::vector<std::byte>& png) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_TRUE(png_image_begin_read_from_memory(&image, png.data(), png.size())) << image.message;
  const bool alpha = image.format & PNG_FORMAT_FLAG_ALPHA;
  image.format = alpha ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  Decoded out{{static_cast<int>(image.width), static_cast<int>(image.height)},
              alpha ? 4u : 3u,
              std::vector<png_byte>(PNG_IMAGE_SIZE(image))};
  EXPECT_TRUE(png_image_finish_read(&image, nullptr, out.values.data(), 0, nullptr)) << image.message;
  return out;
}

TEST(Preview, IsSrgbWithExposureInStops) {
  Film film(kFinalGrid);
  ASSERT_TRUE(film.fold(0, 0, flat(kFinalGrid, 0, {0.5f, 0.001f, 2.0f})));
  ASSERT_TRUE(film.fold(1, 0, flat(kFinalGrid, 1, {-1.0f, 0.0f, 1.0f})));

  const Decoded normal = decode(preview_png(film, 0).value()), darker = decode(preview_png(film, -1).value());

  EXPECT_EQ(normal.size, kFinalGrid.frame);
  // sRGB values: 0.5 is 0.735357 (188); 0.25 is 0.537099 (137); on the linear part 0.001 is 0.01292 (3) and
  // 0.0005 is 0.00646 (2).
  EXPECT_EQ(normal.at(3, 3), (std::array{188, 3, 255}));
  EXPECT_EQ(normal.at(9, 3), (std::array{0, 0, 255}));
  EXPECT_EQ(darker.at(3, 3), (std::array{137, 2, 255}));
  EXPECT_EQ(darker.at(9, 3), (std::array{0, 0, 188}));
}

TEST(Preview, HasAlphaAndColoursThatAreNotMultipliedByIt) {
  Film film(kFinalGrid, AovSet{}.with(Aov::alpha));
  ASSERT_TRUE(film.fold(0, 0, with_alpha(flat(kFinalGrid, 0, {.25f, .125f, 2}), .25f, .75f)));
  ASSERT_TRUE(film.fold(1, 0, with_alpha(flat(kFinalGrid, 1, {1, 1, 1}), 0, 0)));

  const Decoded image = decode(preview_png(film, 0).value());

  ASSERT_EQ(image.channels, 4u);
  EXPECT_EQ(image.at(3, 3), (std::array{188, 137, 255}));  // 0.5, 0.25 and 4
  EXPECT_EQ(image.alpha(3, 3), 128);
  EXPECT_EQ(image.alpha(9, 3), 0);
  EXPECT_EQ(decode(preview_png(Film(kFinalGrid), 0).value()).channels, 3u);
}

TEST(Preview, ShowsNaNInMagentaAndInfinitiesAtTheEnds) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  using Pixel = std::array<std::uint8_t, 3>;

  EXPECT_EQ(srgb8(std::array{0.5, nan, 0.5}.data(), 1), (Pixel{255, 0, 255}));
  EXPECT_EQ(srgb8(std::array{inf, -inf, 0.0}.data(), 1), (Pixel{255, 0, 0}));
}

TEST(Preview, ShowsADarkCheckerboardWithoutSamples) {
  const Decoded image = decode(preview_png(Film(kFinalGrid), 0).value());

  EXPECT_NE(image.at(0, 0), image.at(8, 0));
  EXPECT_EQ(image.at(0, 0), image.at(8, 8));
  for (const int v : image.at(8, 0)) EXPECT_TRUE(v > 10 && v < 50) << v;
}

TEST(Preview, RefusesAnAbsurdExposure) {
  for (const double stops :
       {1e9, -61.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_THAT(preview_png(Film(kFinalGrid), stops).error().message, HasSubstr("exposure")) << stops;
}

}  // namespace
}  // namespace ls

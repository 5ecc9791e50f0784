#include "core/job/sealed_image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <tuple>

#include "core/image/exr/exr_file.h"
#include "tests/unit/image/support.h"
#include "worker/fake/fake_pixels.h"

namespace ls {
namespace {

using test::make_film;
using ::testing::HasSubstr;

const TileGrid kGrid{{25, 13}, 8};

RenderSettings settings() {
  RenderSettings s;
  s.size = kGrid.frame;
  s.tile = kGrid.tile;
  s.integrator = "volpath";
  return s;
}

std::vector<std::byte> sealed(const Film& film, bool float_output, const RenderSettings& s = settings()) {
  const Provenance from{test::name_of("scene"), canonical_json(s), "build 1", test::name_of("class"), 7, 1};
  auto image = final_exr(film, from, {.float_output = float_output});
  if (!image) throw std::runtime_error(image.error().message);
  return std::move(image->exr);
}

Result<SealedImage> read(std::span<const std::byte> exr) {
  auto picture = read_final_exr(exr, "image.exr");
  if (!picture) return tl::unexpected(picture.error());
  return read_sealed_image(std::move(*picture), "image.exr");
}

std::string refusal(const std::vector<std::byte>& exr) {
  const auto image = read(exr);
  return image ? "taken" : image.error().message;
}

// Returns the file with one text replaced by another of the same length.
std::vector<std::byte> changed(std::vector<std::byte> exr, std::string_view from, std::string_view to) {
  std::string text(reinterpret_cast<const char*>(exr.data()), exr.size());
  const auto at = text.find(from);
  if (at == std::string::npos || from.size() != to.size()) throw std::logic_error("not there");
  std::memcpy(exr.data() + at, to.data(), to.size());
  return exr;
}

bool same_bits(const std::variant<ExrHalf, ExrFloat, ExrUint>& a,
               const std::variant<ExrHalf, ExrFloat, ExrUint>& b) {
  return a.index() == b.index() && std::visit(
                                       [&]<class Channel>(const Channel& of_a) {
                                         const auto& of_b = std::get<Channel>(b);
                                         return of_a.values.size() == of_b.values.size() &&
                                                std::memcmp(of_a.values.data(), of_b.values.data(),
                                                            of_a.values.size() * sizeof of_a.values[0]) == 0;
                                       },
                                       a);
}

TEST(SealedImage, ReadsBackTheFinalImage) {
  const Film film = make_film(kGrid, 6);

  for (const bool floats : {false, true}) {
    const auto image = read(sealed(film, floats));

    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->picture.half, !floats);
    EXPECT_EQ(image->scene, test::name_of("scene"));
    EXPECT_EQ(image->numeric_class, test::name_of("class"));
    EXPECT_EQ(image->settings, settings());
    EXPECT_EQ(image->build, "build 1");
    ASSERT_EQ(image->tiles.size(), kGrid.count());
    for (TileIndex t = 0; t < kGrid.count(); ++t) {
      EXPECT_EQ(image->tiles[t], film.tile_digest(t));
      EXPECT_EQ(tile_samples(*image, t).value(), 6u);
      EXPECT_FALSE(first_difference(*image, film, t));
    }
  }
}

// Returns a film with all AOVs, with samples in every pixel.
Film film_with_aovs() {
  AovSet all = AovSet{}.with_groups(2);
  for (const AovRow& row : aov_rows()) all = all.with(row.aov);
  Film film(kGrid, all);
  for (TileIndex t = 0; t < kGrid.count(); ++t)
    if (!film.fold(t, 0, fake_partial(test::make_partial(kGrid, t, {0, 2}).header, all)))
      throw std::logic_error("not folded");
  return film;
}

// Changes the value of a pixel to the next larger one that the layer's type can represent, or a few steps
// above.
void change(std::variant<ExrHalf, ExrFloat, ExrUint>& layer, std::size_t at) {
  if (auto* halves = std::get_if<ExrHalf>(&layer))
    // A half float has 11 significant bits, and steps of at least 2^-24.
    halves->values[at] += std::abs(halves->values[at]) / 512 + 1e-6f;
  if (auto* floats = std::get_if<ExrFloat>(&layer))
    floats->values[at] = std::nextafter(floats->values[at], 1e30f);
  if (auto* counts = std::get_if<ExrUint>(&layer)) ++counts->values[at];
}

TEST(SealedImage, FindsTheFirstChangedValueOfEachLayer) {
  const Film film = film_with_aovs();
  const int x = 11, y = 9;  // in tile 5, whose first pixel is (8, 8)
  for (const bool floats : {false, true}) {
    const auto whole = read(sealed(film, floats)).value();
    EXPECT_EQ(whole.picture.channels.size(), 85u + 2 * 2 * 6);
    for (const auto& [layer, values] : whole.picture.channels) {
      auto image = whole;
      change(image.picture.channels.at(layer), static_cast<std::size_t>(y * 25 + x));

      const auto found = first_difference(image, film, 5);
      ASSERT_TRUE(found) << layer;
      EXPECT_EQ(std::tuple(found->x, found->y, found->layer), std::tuple(x, y, layer));
      EXPECT_FALSE(first_difference(image, film, 3)) << layer;
      image.picture.channels.erase(layer);
      EXPECT_EQ(first_difference(image, film, 3)->layer, layer);
    }
  }
}

TEST(SealedImage, TileHasOneSampleCount) {
  auto image = read(sealed(make_film(kGrid, 6), true)).value();
  auto& spp = std::get<ExrUint>(image.picture.channels.at("spp")).values;
  spp[0] = 8;
  spp[8] = 7;

  EXPECT_THAT(tile_samples(image, 0).error().message,
              HasSubstr("pixel 0,0 says 8 samples, pixel 1,0 says 6"));
  EXPECT_FALSE(tile_samples(image, 1));
  EXPECT_TRUE(tile_samples(image, 2));
  for (int y = 0; y < 8; ++y)
    for (int x = 8; x < 16; ++x) spp[y * 25 + x] = 7;
  EXPECT_THAT(tile_samples(image, 1).error().message, HasSubstr("has 7 samples"));
}

TEST(SealedImage, NamesTheHeaderThatIsWrong) {
  const auto good = sealed(make_film(kGrid, 2), false);
  const std::string scene = test::name_of("scene").hex(), tile = make_film(kGrid, 2).tile_digest(3).hex();

  EXPECT_EQ(refusal(good), "taken");
  EXPECT_THAT(refusal(changed(good, "lightshaft:scene", "lightshaft:scent")),
              HasSubstr("no header \"lightshaft:scene\""));
  EXPECT_THAT(refusal(changed(good, scene, std::string(64, 'x'))),
              HasSubstr("\"lightshaft:scene\" is no SHA-256"));
  EXPECT_THAT(refusal(changed(good, tile, std::string(64, 'x'))), HasSubstr("tile 3 of its header"));
  EXPECT_THAT(refusal(changed(good, "\"tile\":8", "\"tile\":9")), HasSubstr("does not name 6 tiles"));
  EXPECT_THAT(refusal(changed(good, "[25,13]", "[26,13]")),
              HasSubstr("25 x 13 pixels, its settings say 26 x 13"));
}

TEST(SealedImage, ImageOfAnotherProgramIsRefusedNamingWhatIsMissing) {
  ExrPicture other{{2, 2}, {}, {}};
  for (const char* c : {"R", "G", "B"}) other.channels[c] = ExrFloat{std::vector<float>(4, 1.f)};
  EXPECT_THAT(refusal(write_exr(other).value()), HasSubstr("no layer spp"));
  other.channels["spp"] = ExrUint{std::vector<std::uint32_t>(4, 2)};
  EXPECT_THAT(refusal(write_exr(other).value()), HasSubstr("no layer stderr.R"));
  for (const char* c : {"stderr.R", "stderr.G", "stderr.B"})
    other.channels[c] = ExrFloat{std::vector<float>(4)};
  EXPECT_THAT(refusal(write_exr(other).value()), HasSubstr("only images that Lightshaft has finished"));
}

TEST(SealedImage, TruncatedFileIsRefused) {
  const auto good = sealed(make_film(kGrid, 2), false);
  for (std::size_t n = 0; n < good.size(); n += 1 + good.size() / 97)
    EXPECT_FALSE(read(std::span(good).first(n))) << n;
}

// ---- the seal ----

// Simulates a faulty disk: if a flipped bit changes anything that is read from the file, the file is rejected
// or the seal does not match.
TEST(SealedImage, DetectsEveryChangedBit) {
  const auto good = sealed(film_with_aovs(), false);
  const auto before = read_final_exr(good, "image.exr").value();
  ASSERT_TRUE(before.changed && before.changed->empty());
  std::size_t refused = 0, found = 0, same = 0;
  for (std::size_t at = 0; at < good.size(); at += 13) {
    auto bytes = good;
    bytes[at] ^= std::byte(1 << at % 8);

    const auto after = read_final_exr(bytes, "image.exr");
    if (!after)
      ++refused;
    else if (after->changed != before.changed)
      ++found;
    else
      ++same;
    if (after && after->changed == before.changed) {
      EXPECT_EQ(after->strings, before.strings) << "byte " << at;
      for (const auto& [layer, values] : before.channels)
        EXPECT_TRUE(same_bits(values, after->channels.at(layer))) << "byte " << at << ": " << layer;
    }
  }
  EXPECT_GT(refused, 0u);
  EXPECT_GT(found, 0u);
  EXPECT_LT(same, found);
}

TEST(SealedImage, WithoutItsSealIsCalledUnsealed) {
  const auto good = sealed(make_film(kGrid, 2), false);

  EXPECT_EQ(read(changed(good, "lightshaft:seal", "lightshaft:sea1")).value().picture.changed, std::nullopt);
}

}  // namespace
}  // namespace ls

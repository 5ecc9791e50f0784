// Tests of the samples that the slices of a deep pixel become, and of the files of deep images.
#include "core/image/exr/deep_samples.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "core/image/exr/final_image.h"
#include "core/image/film/partial.h"
#include "tests/unit/image/support.h"

namespace ls {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Flat {
  float rgb[3] = {0, 0, 0}, alpha = 0;
};
// Lays the samples over each other as programs for compositing do, in float32.
Flat flattened(const std::vector<DeepSample>& samples) {
  Flat out;
  for (const DeepSample& s : samples) {
    for (std::size_t c = 0; c < 3; ++c) out.rgb[c] += (1 - out.alpha) * s.rgb[c];
    out.alpha += (1 - out.alpha) * s.alpha;
  }
  return out;
}

// A deep EXR may have these samples: finite, sorted, none over another, with alphas from 0 to 1.
void expect_tidy(const std::vector<DeepSample>& samples, const char* what) {
  float last = 0;
  for (const DeepSample& s : samples) {
    ASSERT_TRUE(std::isfinite(s.z) && std::isfinite(s.z_back)) << what;
    ASSERT_GE(s.z, last) << what;
    ASSERT_GE(s.z_back, s.z) << what;
    ASSERT_TRUE(s.alpha >= 0 && s.alpha <= 1) << what << ": " << s.alpha;
    for (const float c : s.rgb) ASSERT_TRUE(std::isfinite(c)) << what;
    last = s.z_back;
  }
}

DeepPixel random_pixel(std::mt19937_64& random, std::size_t slices) {
  std::uniform_real_distribution<double> share(0, 1), exponent(-8, 8);
  DeepPixel pixel;
  double z = 1, t = 1;
  for (std::size_t i = 0; i <= slices; ++i) {
    pixel.edges.push_back(share(random) < .2 ? -z : z);
    z += share(random);
    if (const double kind = share(random); kind < .6)
      t *= share(random);
    else if (kind < .7)
      t *= std::exp(exponent(random) - 8);
    pixel.transmittance.push_back(t);
    pixel.light.push_back({0, 0, 0});
    if (share(random) < .8)
      for (double& c : pixel.light.back()) c = t * std::exp(exponent(random));
  }
  return pixel;
}

TEST(DeepSamples, LaidOverEachOtherAreThePixel) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20000; ++i) {
    const DeepPixel pixel = random_pixel(random, 1 + static_cast<std::size_t>(i) % kMostDeepSlices);
    for (const bool halves : {true, false}) {
      const auto samples = deep_samples(pixel, halves);
      expect_tidy(samples, "a random pixel");
      const Flat flat = flattened(samples);
      // Each colour is rounded once, by 2^-11 of itself if it is a half, or by 2^-24; colours below the
      // normal halves by 2^-25. The flattener rounds three times for each of at most 65 samples: its alpha
      // has an absolute error of 3 x 65 x 2^-24, by which each colour is multiplied, which is at most its
      // light divided by the light's transmittance; colours count here only through `sizes`.
      double sizes[3] = {0, 0, 0};
      for (const DeepSample& s : samples)
        for (std::size_t c = 0; c < 3; ++c) sizes[c] += double{s.rgb[c]};
      for (std::size_t c = 0; c < 3; ++c) {
        double light = 0;
        for (const auto& l : pixel.light) light += l[c];
        const double rounding = (halves ? 0x1p-11 : 0x1p-24) * light + (halves ? 65 * 0x1p-25 : 0);
        EXPECT_NEAR(flat.rgb[c], light, rounding + sizes[c] * 3 * 65 * 0x1p-24) << "pixel " << i;
      }
      // The last alpha is rounded by half a unit of the halves below 1, or by a whole one where light is
      // behind.
      EXPECT_NEAR(flat.alpha, 1 - pixel.transmittance.back(), (halves ? 0x1p-11 : 0) + 3 * 65 * 0x1p-24);
    }
  }
}

TEST(DeepSamples, OfASlabHaveTheAlphaOfTheirThickness) {
  DeepPixel pixel{{1, 1.5, 3, 4}, {}, {}};
  const double sigma = .7;
  for (const double end : {1.5, 3., 4., 4.}) pixel.transmittance.push_back(std::exp(-sigma * (end - 1)));

  const auto samples = deep_samples(pixel, false);

  ASSERT_EQ(samples.size(), 3u) << "nothing is behind the slab";
  // Each alpha is rounded once, after the ones before it.
  for (const DeepSample& s : samples)
    EXPECT_NEAR(s.alpha, 1 - std::exp(-sigma * (s.z_back - s.z)), 3 * 0x1p-24 / std::exp(-sigma * 3));
  EXPECT_EQ(samples[1].z, 1.5f);
  EXPECT_EQ(samples[1].z_back, 3.f);
}

TEST(DeepSamples, LeaveOutWhatIsEmpty) {
  EXPECT_THAT(deep_samples({{1, 2, 3}, {1, 1, 1}, {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}}, true), IsEmpty());
  EXPECT_THAT(deep_samples({}, true), IsEmpty());
}

TEST(DeepSamples, GiveSurfacesTheLeastThicknessAndPutTheEnvironmentFarAway) {
  const auto samples = deep_samples({{-2, 2.5, 4}, {.5, .5, 0}, {{1, 2, 3}, {0, 0, 0}, {4, 4, 4}}}, true);

  ASSERT_EQ(samples.size(), 2u);
  EXPECT_EQ(samples[0], (DeepSample{2, std::nextafter(2.f, 3.f), .5f, {1, 2, 3}}));
  EXPECT_EQ(samples[1],
            (DeepSample{static_cast<float>(kDeepFar), static_cast<float>(kDeepFar), 1, {8, 8, 8}}));
}

TEST(DeepSamples, JoinLightThatNothingLetsThroughToTheSliceInFront) {
  const auto samples = deep_samples({{1, 2, 3}, {0, 0, 0}, {{1, 1, 1}, {2, 2, 2}, {0, 0, 0}}}, true);

  ASSERT_EQ(samples.size(), 1u);
  EXPECT_EQ(samples[0], (DeepSample{1, 3, 1, {3, 3, 3}}));
}

TEST(DeepSamples, AreTidyWhateverTheNumbers) {
  std::mt19937_64 random(2);
  const std::array<double, 12> wild = {0, -0., 1, -1, 2, 1e-300, -1e-300, 1e300, -1e300, 3e38, .5, 65504};
  const auto any = [&] { return wild[random() % wild.size()]; };
  for (int i = 0; i < 20000; ++i) {
    DeepPixel pixel;
    for (std::size_t k = 0; k <= random() % 8; ++k) {
      pixel.edges.push_back(any());
      pixel.transmittance.push_back(any());
      pixel.light.push_back({any(), any(), any()});
    }
    expect_tidy(deep_samples(pixel, random() % 2), "wild numbers");
  }
}

TEST(DeepPlanes, HaveNamesInTheOrderOfTheFile) {
  EXPECT_THAT(names_of_deep_planes({1, true}),
              ElementsAre("deep.00.B", "deep.00.E", "deep.00.G", "deep.00.R", "deep.00.T", "deep.01.B",
                          "deep.01.E", "deep.01.G", "deep.01.R", "deep.01.T"));
  EXPECT_THAT(names_of_deep_planes({1, false}),
              ElementsAre("deep.00.E", "deep.00.T", "deep.01.E", "deep.01.T"));
  EXPECT_THAT(names_of_deep_planes({}), IsEmpty());
  for (const std::uint32_t count : {1u, 9u, kMostDeepSlices})
    for (const bool colours : {true, false}) {
      const auto names = names_of_deep_planes({count, colours});
      EXPECT_TRUE(std::ranges::is_sorted(names));
      const DeepPlanes planes({count, colours});
      EXPECT_EQ(planes.count(), names.size());
      for (std::size_t i = 0; i < planes.records(); ++i) {
        EXPECT_EQ(names[planes.edge(i)], fmt::format("deep.{:02}.E", i));
        EXPECT_EQ(names[planes.transmittance(i)], fmt::format("deep.{:02}.T", i));
        for (std::size_t c = 0; c < 3 && colours; ++c)
          EXPECT_EQ(names[planes.light(i, c)], fmt::format("deep.{:02}.{}", i, "RGB"[c]));
      }
      const std::vector<std::string_view> views(names.begin(), names.end());
      EXPECT_EQ(deep_slices_among(views), (DeepSlices{count, colours}));
    }
}

const TileGrid kDeepGrid{{20, 13}, 8};
constexpr AovSet kDeepSet = AovSet{}.with(Aov::alpha).with_deep({3, true});

// The sums of a unit of a scene without noise, whose slices differ from pixel to pixel.
Partial deep_partial(TileIndex tile, SampleRange samples) {
  Partial p = test::make_partial(kDeepGrid, tile, samples);
  p.aovs = kDeepSet;
  const auto pixels = static_cast<std::size_t>(p.header.tile.pixels());
  p.sums.resize(pixels * (kPartialChannels + planes_of(kDeepSet).count()));
  const DeepPlanes planes(kDeepSet.deep());
  float* const deep = p.sums.data() + (kPartialChannels + planes_of(kDeepSet).sums.size()) * pixels;
  const auto count = static_cast<float>(samples.count());
  for (std::size_t i = 0; i < pixels; ++i)
    for (std::size_t k = 0; k < planes.records(); ++k) {
      const auto at = static_cast<float>(i + 3 * tile);
      deep[planes.edge(k) * pixels + i] = .1f + at + static_cast<float>(k) / 3;
      deep[planes.transmittance(k) * pixels + i] = count * std::exp2(-static_cast<float>(k));
      for (std::size_t c = 0; c < 3; ++c)
        deep[planes.light(k, c) * pixels + i] = count * static_cast<float>(c + k * i % 3);
    }
  return p;
}
Film deep_film(std::uint64_t spp) {
  Film film(kDeepGrid, kDeepSet);
  for (TileIndex t = 0; t < kDeepGrid.count(); ++t)
    for (RoundIndex k = 0; k < round_count(spp); ++k)
      if (const auto folded = film.fold(t, k, deep_partial(t, cut_range(k, spp))); !folded)
        throw std::runtime_error(folded.error().message);
  return film;
}

TEST(DeepFilm, HasTheSameSlicesAfterAnyNumberOfRounds) {
  const DeepRows few = deep_rows(deep_film(2), {}), more = deep_rows(deep_film(64), {}),
                 cut = deep_rows(deep_film(10), {});
  EXPECT_EQ(few.samples.size(), 20u * 13 * 4);
  EXPECT_EQ(few.counts, more.counts);
  EXPECT_EQ(few.samples, more.samples);
  EXPECT_EQ(few.samples, cut.samples) << "with a tail";
}

TEST(DeepFilm, SurvivesARestart) {
  const Film film = deep_film(10);
  Film back(kDeepGrid, kDeepSet);
  for (TileIndex t = 0; t < kDeepGrid.count(); ++t) ASSERT_TRUE(back.load_tile(t, film.save_tile(t)));
  EXPECT_TRUE(back == film);
}

TEST(DeepFilm, RefusesPartialsOfOtherSlices) {
  Film film(kDeepGrid, AovSet{}.with(Aov::alpha).with_deep({3, false}));
  const auto folded = film.fold(0, 0, deep_partial(0, {0, 2}));
  ASSERT_FALSE(folded);
  EXPECT_THAT(folded.error().message, HasSubstr("other AOVs than the film"));
}

TEST(DeepPartial, ComesBackFromItsFile) {
  const Partial partial = deep_partial(1, {0, 2});
  const auto exr = encode_partial(partial, kDeepGrid.frame);
  ASSERT_TRUE(exr) << exr.error().message;
  const auto back = decode_partial(*exr, partial.header, kDeepGrid.frame, kDeepSet);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->sums, partial.sums);
}

TEST(DeepPartial, IsRefusedWithOtherSlicesOrNumbersThatAreNone) {
  Partial partial = deep_partial(1, {0, 2});
  const auto exr = encode_partial(partial, kDeepGrid.frame);
  for (const DeepSlices other :
       {DeepSlices{}, DeepSlices{2, true}, DeepSlices{4, true}, DeepSlices{3, false}}) {
    const auto back = decode_partial(*exr, partial.header, kDeepGrid.frame, kDeepSet.with_deep(other));
    ASSERT_FALSE(back);
    EXPECT_THAT(back.error().message, HasSubstr("3 slices with colours"));
  }
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    partial.sums.back() = bad;
    const auto encoded = encode_partial(partial, kDeepGrid.frame);
    ASSERT_FALSE(encoded);
    EXPECT_THAT(encoded.error().message, HasSubstr("deep.03.T"));
  }
}

// Transmittances that grow or are above 1, and other edges in each round, come from workers that lie; the
// image is wrong then, but it is one.
TEST(DeepFilm, GivesATidyImageOfAnySums) {
  Film film(kDeepGrid, kDeepSet);
  std::mt19937_64 random(3);
  for (RoundIndex k = 0; k < 3; ++k) {
    Partial partial = deep_partial(0, round_range(k));
    for (float& sum : partial.sums)
      sum = (random() % 2 ? 1.f : -1.f) * std::exp2(static_cast<float>(random() % 250) - 125);
    ASSERT_TRUE(film.fold(0, k, partial));
  }
  const DeepRows rows = deep_rows(film, {});
  std::size_t at = 0;
  for (const std::uint32_t count : rows.counts) {
    expect_tidy({rows.samples.begin() + static_cast<std::ptrdiff_t>(at),
                 rows.samples.begin() + static_cast<std::ptrdiff_t>(at + count)},
                "any sums");
    at += count;
  }
}

Provenance provenance() {
  return {test::name_of("scene"), R"({"seed":7})", "build 1", test::name_of("class"), 7};
}

TEST(DeepExr, ComesBackFromItsFileWithItsSeal) {
  const Film film = deep_film(6);
  for (const bool floats : {false, true}) {
    const auto exr = deep_exr_of(film, provenance(), {.float_output = floats});
    ASSERT_TRUE(exr) << exr.error().message;
    const auto back = read_deep_exr(*exr, "deep.exr");
    ASSERT_TRUE(back) << back.error().message;
    const DeepRows rows = deep_rows(film, {.float_output = floats});
    EXPECT_EQ(back->rows.counts, rows.counts);
    EXPECT_EQ(back->rows.samples, rows.samples);
    EXPECT_EQ(back->floats, floats);
    EXPECT_TRUE(back->colours);
    ASSERT_TRUE(back->changed);
    EXPECT_THAT(*back->changed, IsEmpty());
    EXPECT_EQ(back->strings.at("lightshaft:deep"), "3");
    EXPECT_EQ(back->strings.at("lightshaft:scene"), test::name_of("scene").hex());
  }
}

TEST(DeepExr, NamesWhatWasChanged) {
  DeepBands bands{{2, 1}, {}, [](int) { return DeepRows{{2, 1}, {1, 0}, {{1, 2, .5f, {1, 2, 3}}}}; }};
  class Sink final : public ByteSink {
   public:
    Result<void> write(std::uint64_t at, std::span<const std::byte> from) override {
      bytes.resize(std::max(bytes.size(), static_cast<std::size_t>(at) + from.size()));
      std::ranges::copy(from, bytes.begin() + static_cast<std::ptrdiff_t>(at));
      return {};
    }
    std::vector<std::byte> bytes;
  } sink;
  int calls = 0;
  const auto honest = bands.band;
  // The second pass, which writes the pixels, has another alpha than the first, of which the seal is.
  bands.band = [&](int band) {
    DeepRows rows = honest(band);
    if (++calls > 1) rows.samples[0].alpha = .25f;
    return rows;
  };
  ASSERT_TRUE(write_sealed_deep_exr(bands, sink));
  const auto back = read_deep_exr(sink.bytes, "deep.exr");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_THAT(back->changed.value(), ElementsAre("layer A"));
}

TEST(DeepExr, IsRefusedWhereItIsDamaged) {
  const auto exr = deep_exr_of(deep_film(2), provenance(), {});
  ASSERT_TRUE(exr);
  for (std::size_t size = 0; size < exr->size(); size += 1 + exr->size() / 200)
    EXPECT_FALSE(read_deep_exr(std::span(*exr).first(size), "deep.exr")) << size << " bytes";
  // A changed byte is an error or shows in the seal; nothing else may happen.
  for (std::size_t at = 0; at < exr->size(); at += 1 + exr->size() / 500) {
    std::vector<std::byte> changed = *exr;
    changed[at] ^= std::byte{0x40};
    (void)read_deep_exr(changed, "deep.exr");
  }
  const auto flat = final_exr(deep_film(2), provenance(), {});
  ASSERT_TRUE(flat);
  EXPECT_FALSE(read_deep_exr(flat->exr, "flat.exr"));
}

// A small file can claim very many samples, which deflate packs a thousand to one.
TEST(DeepExr, IsRefusedBeforeItsSamplesTakeMemory) {
  const auto exr = deep_exr_of(deep_film(2), provenance(), {});
  ASSERT_TRUE(exr);
  const auto error_of = [&](const DeepExpected& expected) {
    const auto read = read_deep_exr(*exr, "deep.exr", expected);
    return read ? std::string() : read.error().message;
  };
  // It has 20 x 13 pixels with 4 samples each.
  constexpr std::uint64_t kBytes = 20 * 13 * 4 * sizeof(DeepSample);
  EXPECT_EQ(error_of({.slices = 3, .max_bytes = kBytes}), "");
  EXPECT_THAT(error_of({.slices = 2}), HasSubstr("a pixel has 4 samples, and there can be 3"));
  EXPECT_THAT(error_of({.max_bytes = kBytes - 1}), HasSubstr("its samples need more than"));
  const auto check = [](const DeepPicture& header) -> Result<void> {
    EXPECT_EQ(header.rows.size, (FrameSize{20, 13}));
    EXPECT_EQ(header.strings.at("lightshaft:deep"), "3");
    EXPECT_TRUE(header.rows.counts.empty()) << "no pixel was read";
    return bad_argument("it is not wanted");
  };
  EXPECT_THAT(error_of({.check = check}), HasSubstr("it is not wanted"));
}

TEST(DeepExr, IsNotMadeOfAFilmWithoutSlices) {
  const auto none = deep_exr_of(test::make_film(kDeepGrid, 2), provenance(), {});
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("no slices"));
}

TEST(DeepFilm, AMixOfLightGroupsHasNoSlices) {
  const AovSet set = AovSet{}.with(Aov::light_groups).with_groups(1).with_deep({2, true});
  Film film(kDeepGrid, set);
  Partial partial = test::make_partial(kDeepGrid, 0, {0, 2});
  partial.aovs = set;
  partial.sums.resize(static_cast<std::size_t>(partial.header.tile.pixels()) *
                      (kPartialChannels + planes_of(set).count()));
  ASSERT_TRUE(film.fold(0, 0, partial));
  const std::array factors{GroupFactors{}};
  const Film mixed = film.mixed(factors);
  EXPECT_EQ(mixed.aovs().deep().count, 0u);
  EXPECT_EQ(mixed.aov_pixels(0).sums.size(), 0u);
}

}  // namespace
}  // namespace ls

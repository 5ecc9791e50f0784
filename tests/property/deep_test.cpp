// Deep images: their slices add up to the colour, leave its bits as they are, and have edges that no sample
// changes.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <span>
#include <vector>

#include "core/image/aov/deep_planes.h"
#include "tests/property/split_scenes.h"

namespace ls::test {
namespace {

constexpr int kSlices = 5;

std::vector<float> colour_of(const Picture& p) {
  return {p.sums.begin(), p.sums.begin() + static_cast<std::ptrdiff_t>(kPartialChannels * p.pixels)};
}
std::span<const float> slice(const Picture& p, std::size_t record, char letter) {
  return p.plane(fmt::format("deep.{:02}.{}", record, letter));
}

TEST(DeepImage, SlicesAddUpToTheColourAndLeaveItsBits) {
  std::set<std::string> variants;
  for (const NamedScene& s : all_scenes()) {
    const Picture plain = picture(s.builder, {}, 16, 1), deep = picture(s.builder, {}, 16, 1, kSlices);
    variants.insert(deep.variant);
    const std::vector<float> colour = colour_of(deep);
    EXPECT_EQ(colour, plain.sums) << s.name;
    double wrong = 0;
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < deep.pixels; ++i) {
        double sum = 0, size = 0;
        for (std::size_t k = 0; k <= kSlices; ++k) {
          const double part = double{slice(deep, k, "RGB"[c])[i]};
          sum += part;
          size += std::abs(part);
        }
        const double whole = double{colour[c * deep.pixels + i]} + double{colour[(3 + c) * deep.pixels + i]};
        wrong = std::max(wrong, std::abs(sum - whole) / std::max(std::max(std::abs(whole), size), 1e-30));
      }
    EXPECT_LE(wrong, kClose) << s.name << ": " << deep.variant;
  }
  fmt::print("variants:\n  {}\n", fmt::join(variants, "\n  "));
  EXPECT_GE(variants.size(), 5u) << "techniques with tracers of their own were not tried";
}

// The last transmittance is 1 - alpha of each sample. The sums of both are in double, and each is rounded to
// float32 once.
TEST(DeepImage, LetsThroughWhatTheAovAlphaSays) {
  constexpr double kSamples = 16;
  for (const NamedScene& s : all_scenes()) {
    const Picture deep = picture(s.builder, {"alpha"}, 16, 1, kSlices);
    for (std::size_t i = 0; i < deep.pixels; ++i) {
      const double alpha = double{deep.plane("aov.alpha.A.A")[i]} + double{deep.plane("aov.alpha.B.A")[i]};
      ASSERT_NEAR(double{slice(deep, kSlices, 'T')[i]}, kSamples - alpha, kSamples * 3 * 0x1p-24) << s.name;
    }
  }
}

TEST(DeepImage, HasEdgesThatGrowAndThatNoSampleChanges) {
  for (const NamedScene& s : all_scenes()) {
    const Picture few = picture(s.builder, {}, 2, 1, kSlices), other = picture(s.builder, {}, 8, 7, kSlices);
    for (std::size_t k = 0; k <= kSlices; ++k) {
      const auto edges = slice(few, k, 'E'), same = slice(other, k, 'E');
      ASSERT_TRUE(std::ranges::equal(edges, same)) << s.name << ", edge " << k;
      if (k == 0) continue;
      for (std::size_t i = 0; i < few.pixels; ++i)
        ASSERT_LE(std::abs(slice(few, k - 1, 'E')[i]), std::abs(edges[i])) << s.name << ", edge " << k;
    }
  }
}

TEST(DeepImage, WithoutColoursHasTheSameAlphaAndColour) {
  for (const NamedScene& s : scenes()) {
    RenderSettings settings = settings_of(s.builder.scene, 1);
    settings.deep = kSlices;
    const auto render = [&] {
      const auto world = render::build_world(s.builder.scene, settings, s.builder.files, 2);
      if (!world) throw std::runtime_error(world.error().message);
      Picture p;
      p.pixels = settings.size.pixels();
      p.planes = planes_of(aovs_of(settings));
      p.sums = render::render_tile(**world, {0, 0, settings.size.width, settings.size.height}, {0, 4},
                                   nullptr, nullptr)
                   .sums;
      return p;
    };
    const Picture with = render();
    settings.deep_alpha = true;
    const Picture without = render();
    EXPECT_EQ(colour_of(with), colour_of(without)) << s.name;
    EXPECT_EQ(without.planes.count(), 2 * (kSlices + 1u));
    for (std::size_t k = 0; k <= kSlices; ++k)
      for (const char letter : {'E', 'T'})
        ASSERT_TRUE(std::ranges::equal(slice(with, k, letter), slice(without, k, letter))) << s.name;
  }
}

}  // namespace
}  // namespace ls::test

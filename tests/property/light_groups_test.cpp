// Light groups: they add up to the colour, leave its bits as they are, and each is what its lights alone
// bring.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>
#include <span>

#include "core/image/aov/aov.h"
#include "core/scene/analysis/light_groups.h"
#include "tests/property/split_scenes.h"
#include "tests/support/significance.h"

namespace ls::test {
namespace {

// Removes the lights that are not in the group.
Scene alone(Scene scene, const std::string& group) {
  const auto is_in = [&](const std::string& name) {
    return (name.empty() ? kOtherLightGroup : name) == group;
  };
  for (Shape& s : scene.shapes)
    if (s.emitter && !is_in(s.emitter->light_group)) s.emitter.reset();
  std::erase_if(scene.emitters, [&](const Emitter& e) {
    return !std::visit([&](const auto& light) { return is_in(light.light_group); }, e);
  });
  for (Medium& m : scene.media) {
    if (std::visit([&](const auto& medium) { return is_in(medium.light_group); }, m)) continue;
    if (auto* h = std::get_if<HomogeneousMedium>(&m)) h->emission = h->source_radiance = {0, 0, 0};
    if (auto* h = std::get_if<HeterogeneousMedium>(&m)) h->emission_scale = 0;
  }
  return scene;
}

std::string plane_of(const char* aov, std::size_t group, int half, int channel) {
  return fmt::format("aov.{}.{:02}.{}.{}", aov, group, "AB"[half], "RGB"[channel]);
}

TEST(LightGroups, AddUpToTheColourAndLeaveItsBits) {
  std::set<std::string> variants;
  for (const NamedScene& s : all_scenes()) {
    const std::vector<std::string> groups = scene::light_groups_of(s.builder.scene);
    const Picture plain = picture(s.builder, {}, 16, 1),
                  apart = picture(s.builder, {"light_groups", "volume_light_groups", "volume"}, 16, 1);
    variants.insert(apart.variant);
    const std::vector<float> colour(
        apart.sums.begin(),
        apart.sums.begin() + static_cast<std::ptrdiff_t>(kPartialChannels * apart.pixels));
    EXPECT_EQ(colour, plain.sums) << s.name;
    double wrong = 0, in_volume = 0;
    for (int half = 0; half < 2; ++half)
      for (int c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < apart.pixels; ++i) {
          double sum = 0;
          for (std::size_t g = 0; g < groups.size(); ++g)
            sum += double{apart.plane(plane_of("light_groups", g, half, c))[i]};
          const double whole = double{colour[static_cast<std::size_t>(3 * half + c) * apart.pixels + i]};
          wrong = std::max(wrong, std::abs(sum - whole) / std::max(std::abs(whole), 1e-30));
        }
    EXPECT_LE(wrong, kClose) << s.name << ": " << apart.variant;
    wrong = 0;
    for (int c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < apart.pixels; ++i) {
        double sum = 0;
        for (std::size_t g = 0; g < groups.size(); ++g)
          for (int half = 0; half < 2; ++half)
            sum += double{apart.plane(plane_of("volume_light_groups", g, half, c))[i]};
        const double whole = double{apart.plane(fmt::format("aov.volume.{}", "RGB"[c]))[i]};
        in_volume += whole;
        wrong = std::max(wrong, std::abs(sum - whole) / std::max(std::abs(whole), 1e-30));
      }
    EXPECT_LE(wrong, kClose) << s.name << ": in volumes, of " << in_volume;
  }
  fmt::print("variants:\n  {}\n", fmt::join(variants, "\n  "));
  EXPECT_GE(variants.size(), 5u) << "techniques with tracers of their own were not tried";
}

// The estimate of a group's planes.
Estimate estimate_of_group(const Picture& p, std::size_t group, std::uint64_t spp) {
  Estimate e;
  const double per_half = static_cast<double>(spp) / 2, pixels = static_cast<double>(p.pixels);
  for (int c = 0; c < 3; ++c) {
    const auto a = p.plane(plane_of("light_groups", group, 0, c)),
               b = p.plane(plane_of("light_groups", group, 1, c));
    double sum = 0, square = 0, fourth = 0;
    for (std::size_t i = 0; i < p.pixels; ++i) {
      const double d = (double{a[i]} - double{b[i]}) / per_half;
      sum += (double{a[i]} + double{b[i]}) / per_half / 2;
      square += d * d / 4;
      fourth += d * d / 4 * d * d / 4;
    }
    const auto at = static_cast<std::size_t>(c);
    e.mean[at] = sum / pixels;
    e.standard_error[at] = std::sqrt(square) / pixels;
    e.freedom[at] = fourth > 0 ? 3 * square * square / fourth : pixels;
  }
  return e;
}

// The mean over images of several seeds, whose differences tell the error: pixels that share paths or light
// vertices are not independent of each other. image(seed) returns an image's estimate.
template <class Image>
Estimate over_seeds(const Image& image, std::uint64_t& seed) {
  constexpr int kSeeds = 12;
  Estimate all;
  std::array<double, 3> squares{};
  for (int i = 0; i < kSeeds; ++i) {
    const Estimate e = image(++seed);
    for (std::size_t c = 0; c < 3; ++c) {
      all.mean[c] += e.mean[c] / kSeeds;
      squares[c] += e.mean[c] * e.mean[c] / kSeeds;
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    all.standard_error[c] = std::sqrt(std::max(0., squares[c] - all.mean[c] * all.mean[c]) / (kSeeds - 1));
    all.freedom[c] = kSeeds - 1;
  }
  return all;
}

bool pixels_depend_on_each_other(const SceneBuilder& builder) {
  return builder.scene.integrator.path_reuse > 1 || builder.scene.integrator.light_vertices > 0;
}

TEST(LightGroups, AreTheImagesOfTheirLightsAlone) {
  Tests tests("property/light_groups");
  std::uint64_t seed = 5000;
  int compared = 0, dependent = 0;
  for (const NamedScene& s : all_scenes()) {
    const std::vector<std::string> groups = scene::light_groups_of(s.builder.scene);
    const bool by_seeds = pixels_depend_on_each_other(s.builder);
    if (groups.size() < 2 || (!by_seeds && ++compared > 8)) continue;
    dependent += by_seeds;
    for (std::size_t g = 0; g < groups.size() && g < 2; ++g) {
      SceneBuilder only = s.builder;
      only.scene = alone(only.scene, groups[g]);
      const auto at = [&](std::uint64_t spp, double level) {
        const auto group = [&](std::uint64_t of) {
          return estimate_of_group(picture(s.builder, {"light_groups"}, spp, of), g, spp);
        };
        const auto lights = [&](std::uint64_t of) { return estimate(only, spp, of); };
        const Estimate one = by_seeds ? over_seeds(group, seed) : group(++seed),
                       other = by_seeds ? over_seeds(lights, seed) : lights(++seed);
        return compare(one, other, level);
      };
      const double level = tests.level(3);
      Comparison c = at(by_seeds ? 32 : 64, .01);
      if (c.verdict != Verdict::alike) c = at(by_seeds ? 128 : 1024, level);
      EXPECT_NE(c.verdict, Verdict::different) << s.name << ", group " << groups[g] << ": " << c.told;
    }
  }
  EXPECT_GE(compared, 6);
  EXPECT_EQ(dependent, 5) << "with shared paths and with light vertices";
  tests.close();
}

// A mix of the groups is the image of the scene whose lights are multiplied.
TEST(LightGroups, MixedAreTheImageOfTheMixedScene) {
  Tests tests("property/light_mixes");
  std::uint64_t seed = 8000;
  int compared = 0;
  for (const NamedScene& s : all_scenes()) {
    const std::vector<std::string> groups = scene::light_groups_of(s.builder.scene);
    if (groups.size() < 2 || pixels_depend_on_each_other(s.builder) || compared == 8) continue;
    LightMix mix;
    // Grey, because some lights take no colour
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const double f = g == 0 ? 3 : g == 1 ? .25 : 1;
      mix.groups[groups[g]] = {{f, f, f}, {f, f, f}};
    }
    SceneBuilder mixed = s.builder;
    ASSERT_TRUE(scene::multiply_light(mix, mixed.scene)) << s.name;
    ++compared;
    const auto at = [&](std::uint64_t spp, double level) {
      const Picture apart = picture(s.builder, {"light_groups"}, spp, ++seed);
      Picture sum = apart;  // with the mix in the place of group 0
      for (int half = 0; half < 2; ++half)
        for (int c = 0; c < 3; ++c) {
          const auto to =
              sum.sums.begin() + (sum.plane(plane_of("light_groups", 0, half, c)).data() - sum.sums.data());
          for (std::size_t i = 0; i < sum.pixels; ++i) {
            double value = 0;
            for (std::size_t g = 0; g < groups.size(); ++g)
              value += mix.groups[groups[g]].surface[0] *
                       double{apart.plane(plane_of("light_groups", g, half, c))[i]};
            to[static_cast<std::ptrdiff_t>(i)] = static_cast<float>(value);
          }
        }
      return compare(estimate_of_group(sum, 0, spp), estimate(mixed, spp, ++seed), level);
    };
    const double level = tests.level(3);
    Comparison c = at(64, .01);
    if (c.verdict != Verdict::alike) c = at(1024, level);
    EXPECT_NE(c.verdict, Verdict::different) << s.name << ": " << c.told;
  }
  EXPECT_GE(compared, 6);
  tests.close();
}

}  // namespace
}  // namespace ls::test

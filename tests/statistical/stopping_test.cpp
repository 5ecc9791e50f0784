// Tests the promises of the stop rule on images whose truth is known. bench/stopping.cpp is the long version.
// Seeds are fixed.
#include <gtest/gtest.h>

#include <map>

#include "tests/support/synthetic_film.h"

namespace ls::coordinator {
namespace {

constexpr TileGrid kGrid{{128, 96}, 32};

struct Measured {
  double target = 0, uniform_variance = 0;   // relMSE x samples of uniform sampling
  double realised = 0, spp = 0;              // means over jobs
  double brightness = 0, brightness_se = 0;  // of the whole image, over its truth
};

Measured measure(const std::string& name, double samples, int jobs) {
  for (const test::SyntheticScene& scene : test::synthetic_scenes()) {
    if (scene.name != name) continue;
    const test::SyntheticFilm film(kGrid, scene.pixel);
    Measured out;
    out.uniform_variance = film.relative_variance();
    out.target = out.uniform_variance / samples;
    double truth = 0, squares = 0;
    for (TileIndex t = 0; t < kGrid.count(); ++t)
      for (const test::SyntheticPixel& p : film.tile(t)) truth += p.truth();
    for (int j = 0; j < jobs; ++j) {
      const test::StoppedJob job =
          test::run_to_target(film, out.target, 1000 + static_cast<std::uint64_t>(j));
      double sum = 0;
      for (const double e : job.errors) sum += e / truth;
      out.realised += job.realised / jobs;
      out.spp += job.stop.mean_spp / jobs;
      out.brightness += sum / jobs;
      squares += sum * sum / jobs;
    }
    out.brightness_se = std::sqrt((squares - out.brightness * out.brightness) / (jobs - 1));
    return out;
  }
  ADD_FAILURE() << "no image " << name;
  return {};
}

// To 600 samples a pixel by uniform sampling.
const Measured& usual(const std::string& name) {
  static std::map<std::string, Measured> known;
  const auto [found, fresh] = known.try_emplace(name);
  if (fresh) found->second = measure(name, 600, 12);
  return found->second;
}

TEST(Stopping, FinalErrorIsAtOrSlightlyBelowTheTarget) {
  for (const char* name : {"even noise", "uneven noise", "a shaft in a calm room", "dark", "fireflies"}) {
    const Measured& m = usual(name);
    EXPECT_LE(m.realised, m.target) << name;
    EXPECT_GE(m.realised, .85 * m.target) << name << ": a level is 9 %, a round of 64 samples the rest";
  }
}

TEST(Stopping, AdaptiveSamplesAreMoreEfficientThanUniformOnes) {
  for (const char* name : {"uneven noise", "a shaft in a calm room", "dark", "fireflies"}) {
    const Measured& m = usual(name);
    EXPECT_GT(m.uniform_variance / m.spp / m.realised, 1.7) << name;
  }
  const Measured& even = usual("even noise");
  EXPECT_GT(even.uniform_variance / even.spp / even.realised, .97) << "nothing to gain, little to lose";
}

TEST(Stopping, BiasIsFarBelowTheTargetError) {
  for (const char* name : {"uneven noise", "fireflies", "rare fireflies"}) {
    const Measured m = measure(name, 300, 30);
    const double promised = std::sqrt(m.target);
    EXPECT_LT(std::abs(m.brightness), .02 * promised) << name;
    EXPECT_LT(6 * m.brightness_se, .02 * promised) << name << ": else the line above says nothing";
  }
}

}  // namespace
}  // namespace ls::coordinator

// Jobs with a target error through the whole coordinator. Tiles stop after different numbers of rounds. The
// pixels are the same for any workers, any order of results and any number of restarts.
#include <algorithm>
#include <random>

#include "coordinator/views/views.h"
#include "core/image/exr/final_image.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

// The image has 5 x 4 tiles of fake pixels, whose noise is the same everywhere; so the relative error is
// largest where they are dark, at the upper left. The lowest row of tiles has a height of 13 pixels and stops
// with its neighbours.
JobSpec spec_with(std::optional<double> target, std::optional<std::uint64_t> spp = {}) {
  JobSpec spec;
  spec.size = FrameSize{160, 109};
  spec.target_error = target;
  spec.spp = spp;
  return spec;
}

constexpr double kTarget = 1e-3;

struct Outcome {
  std::string pixels, stopped;
  double spp = 0;
};
Outcome outcome(const Coordinator& coordinator, const JobId& job) {
  const auto j = report(coordinator, job);
  return {j.value("pixels_sha256", ""), j["stopped"].is_string() ? j.value("stopped", "") : "",
          j.value("spp", 0.)};
}

Outcome at_once(const JobSpec& spec) {
  auto coordinator = open_at({});
  const JobId job = submit(*coordinator, spec);
  EXPECT_TRUE(finish(*coordinator, job));
  return outcome(*coordinator, job);
}

std::vector<std::uint64_t> spp_of_tiles(const Coordinator& coordinator, const JobId& job) {
  std::vector<std::uint64_t> spp;
  const auto tiles = coordinator.tiles(job);
  for (const TileView& t : *tiles) spp.push_back(t.spp);
  return spp;
}

// When a checkpoint is taken, some tiles are rounds, and levels of adaptive sampling, ahead of others. The
// cost of the checkpoint must include only its own samples, even after a restart. Every sample costs the same
// here.
TEST(Adaptive, CheckpointCostsOnlyItsOwnSamples) {
  // CPU seconds per sample of a pixel; so little that no unit seems to take longer than it was leased
  constexpr double kCost = 0x1p-40;
  for (const bool killed : {false, true}) {
    TempFolder dir;
    auto coordinator = open_at(dir.path());
    const JobId job = submit(*coordinator, spec_with(kTarget));
    const auto work = [&](int stop_after) {
      FakeFarm farm(*coordinator, 2);
      farm.stop_after = stop_after;
      farm.tamper = [&](UnitResult r) {
        const SampleRange range = round_range(r.unit.round);
        const PixelRect rect = TileGrid{{160, 109}}.rect(r.unit.tile);
        r.cpu_seconds = kCost * static_cast<double>(range.count() * rect.pixels());
        return std::vector{std::move(r)};
      };
      farm.reorder = [](auto& units) { std::reverse(units.begin(), units.end()); };
      return farm.finish(job);
    };
    if (killed) {
      EXPECT_FALSE(work(70));
      coordinator.reset();
      coordinator = open_at(dir.path());
    }
    ASSERT_TRUE(work(-1));

    const auto points = report(*coordinator, job)["convergence"];
    ASSERT_GT(points.size(), 7u);
    for (std::size_t i = 0; i < points.size(); ++i)
      EXPECT_NEAR(points[i]["core_seconds"].get<double>(), kCost * 160 * 109 * points[i]["spp"].get<double>(),
                  // The cost of each unit is stored as a float
                  1e-6 * points[i]["core_seconds"].get<double>())
          << i << " of " << points.size() << (killed ? ", killed" : "");
  }
}

TEST(Adaptive, NoisierTilesGetMoreSamplesAndTheImageSaysSo) {
  auto coordinator = open_at({});
  const JobId job = submit(*coordinator, spec_with(kTarget));
  ASSERT_TRUE(finish(*coordinator, job, 2));

  const auto spp = spp_of_tiles(*coordinator, job);
  EXPECT_GT(spp.front(), spp.back());
  EXPECT_GE(*std::min_element(spp.begin(), spp.end()), 64u);
  const auto exr = coordinator->image_exr(job);
  ASSERT_TRUE(exr);
  const auto picture = read_final_exr(*exr, "image.exr");
  ASSERT_TRUE(picture);
  const auto& counts = std::get<ExrUint>(picture->channels.at("spp")).values;
  EXPECT_EQ(counts.front(), spp.front());
  EXPECT_EQ(counts.back(), spp.back());
  const auto& header = picture->strings;
  EXPECT_TRUE(header.at("lightshaft:stopped").starts_with("error; stopped at a target error"));
  EXPECT_GE(std::stod(header.at("lightshaft:core_seconds")), 0);  // rounded
  EXPECT_GT(report(*coordinator, job)["core_seconds"].get<double>(), 0);
  EXPECT_EQ(header.at("lightshaft:verdict"), "trusted");
  const auto j = report(*coordinator, job);
  EXPECT_EQ(j["stopped"], "error");
  EXPECT_TRUE(j["adaptive"].get<bool>());
  EXPECT_NE(j["note"].get<std::string>().find("bias"), std::string::npos);
  EXPECT_LE(j["relmse"].get<double>(), kTarget);
  const auto& curve = j["convergence"];
  ASSERT_GT(curve.size(), 6u);
  for (std::size_t i = 1; i < curve.size(); ++i) EXPECT_GT(curve[i]["spp"], curve[i - 1]["spp"]);
  EXPECT_EQ(curve.back()["spp"], j["spp"]);
  EXPECT_EQ(curve.back()["relmse"], j["relmse"]) << "the last checkpoint is the image";
}

TEST(Adaptive, EachTileHasAnErrorAndTheirMeanIsTheImagesError) {
  auto coordinator = open_at({});
  const JobId job = submit(*coordinator, spec_with(kTarget));
  const auto untouched = nlohmann::json::parse(tiles_json(*coordinator->tiles(job)))["tiles"];
  EXPECT_TRUE(untouched[0]["relmse"].is_null());
  ASSERT_TRUE(finish(*coordinator, job));

  double sum = 0, pixels = 0;
  const std::vector<TileView> all = coordinator->tiles(job).value();
  for (const TileView& t : all) {
    ASSERT_TRUE(t.relmse);
    sum += *t.relmse * t.rect.pixels();
    pixels += t.rect.pixels();
  }
  EXPECT_NEAR(sum / pixels / report(*coordinator, job)["relmse"].get<double>(), 1, 1e-9);
  const auto tiles = nlohmann::json::parse(tiles_json(*coordinator->tiles(job)))["tiles"];
  EXPECT_EQ(tiles[0]["relmse"], *coordinator->tiles(job)->front().relmse);
}

TEST(Adaptive, TimeLeftHasAnIntervalFromTheFirstCheckpointToTheTarget) {
  auto coordinator = open_at({});
  const JobId job = submit(*coordinator, spec_with(kTarget));
  FakeFarm farm(*coordinator, 2);
  int with = 0, without = 0;
  farm.tamper = [&](UnitResult r) {
    const JobView v = *coordinator->job(job);
    if (v.state == JobState::running && v.error_now && v.error_now->relmse > kTarget && v.eta_seconds) {
      ++(v.eta_ci95 ? with : without);
      if (v.eta_ci95) {
        EXPECT_LE(v.eta_ci95->first, *v.eta_seconds);
        EXPECT_GE(v.eta_ci95->second, *v.eta_seconds);
        EXPECT_LT(v.eta_with_more.value(), *v.eta_seconds + 1e-12);
        EXPECT_TRUE(v.eta_with_more_ci95);
      }
    }
    return std::vector<UnitResult>{std::move(r)};
  };
  ASSERT_TRUE(farm.finish(job));
  EXPECT_GT(with, 50);
  EXPECT_EQ(without, 0);
}

TEST(Adaptive, ShuffledDuplicatedAndLostResultsGiveTheSamePixels) {
  const Outcome expected = at_once(spec_with(kTarget));
  for (unsigned seed = 1; seed <= 4; ++seed) {
    std::mt19937 random(seed);
    auto coordinator = open_at({});
    const JobId job = submit(*coordinator, spec_with(kTarget));
    FakeFarm farm(*coordinator, 1 + static_cast<int>(seed));
    std::vector<UnitResult> kept;  // results that are sent late
    farm.tamper = [&](UnitResult r) {
      std::vector<UnitResult> out{r};
      if (random() % 4 == 0) out.push_back(r);
      if (random() % 4 == 0) kept.push_back(r);
      if (kept.size() > 5) out.push_back(kept.front()), kept.erase(kept.begin());
      return out;
    };
    farm.reorder = [&](auto& units) { std::shuffle(units.begin(), units.end(), random); };
    ASSERT_TRUE(farm.finish(job));
    EXPECT_EQ(outcome(*coordinator, job).pixels, expected.pixels) << seed;
  }
}

TEST(Adaptive, CoordinatorKilledAtAnyPointGivesTheSamePixels) {
  const Outcome expected = at_once(spec_with(kTarget));
  for (const int k : {1, 40, 95, 101, 107, 113, 119, 125}) {
    TempFolder dir;
    const JobId job = interrupted(dir.path(), k, 2, spec_with(kTarget));
    auto coordinator = open_at(dir.path());
    ASSERT_TRUE(finish(*coordinator, job, 3)) << k;
    const Outcome there = outcome(*coordinator, job);
    EXPECT_EQ(there.pixels, expected.pixels) << k;
    EXPECT_EQ(there.stopped, "error") << k;
  }
}

TEST(Adaptive, HalvingTheTargetOfAFinishedJobGivesTheBitsOfAJobSubmittedWithThatTarget) {
  const Outcome expected = at_once(spec_with(kTarget / 2));
  for (const int way : {0, 1, 2}) {  // in memory, on disk, on disk with a restart between
    TempFolder dir;
    auto coordinator = open_at(way == 0 ? std::filesystem::path{} : dir.path());
    const JobId job = submit(*coordinator, spec_with(kTarget));
    ASSERT_TRUE(finish(*coordinator, job, 2));
    if (way == 2) {
      coordinator.reset();
      coordinator = open_at(dir.path());
    }
    EXPECT_NE(outcome(*coordinator, job).pixels, expected.pixels);
    EXPECT_FALSE(coordinator->change(job, {{}, {}, {}, 2 * kTarget})) << "it is better than that";
    ASSERT_TRUE(coordinator->change(job, {{}, {}, {}, kTarget / 2}));
    EXPECT_EQ(coordinator->job(job)->state, JobState::running);
    ASSERT_TRUE(finish(*coordinator, job, 2));
    const Outcome there = outcome(*coordinator, job);
    EXPECT_EQ(there.pixels, expected.pixels) << way;
    EXPECT_EQ(there.spp, expected.spp);
    EXPECT_EQ(there.stopped, "error");
  }
}

TEST(Adaptive, ExtendingBySamplesGivesTheBitsOfAJobBySamples) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId job = submit(*coordinator, spec_with(kTarget));
  ASSERT_TRUE(finish(*coordinator, job, 2));
  const auto spp = spp_of_tiles(*coordinator, job);
  const std::uint64_t most = *std::max_element(spp.begin(), spp.end());
  ASSERT_TRUE(extend(*coordinator, job, most + 40));
  EXPECT_FALSE(coordinator->job(job)->target_error) << "it is reached";
  ASSERT_TRUE(finish(*coordinator, job, 2));

  EXPECT_EQ(outcome(*coordinator, job).pixels, at_once(spec_with({}, most + 40)).pixels);
  EXPECT_EQ(outcome(*coordinator, job).stopped, "spp");
}

TEST(Adaptive, TheSampleLimitHoldsForEveryTile) {
  auto coordinator = open_at({});
  const JobId job = submit(*coordinator, spec_with(kTarget, 150));
  ASSERT_TRUE(finish(*coordinator, job, 2));
  const auto spp = spp_of_tiles(*coordinator, job);
  EXPECT_EQ(*std::max_element(spp.begin(), spp.end()), 150u);
}

}  // namespace
}  // namespace ls::coordinator

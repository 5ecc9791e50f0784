// The health of a job (the counts of its bad samples). Like its pixels it depends on the job only, not on the
// order of results or on restarts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/image/exr/exr_file.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

using testing::HasSubstr;

// The health that the tests' workers report for a unit; it depends on the unit's pixels and samples only.
Health unhealthy(const PixelRect& rect, const SampleRange& samples) {
  Health h;
  for (std::uint64_t s = samples.s0; s < samples.s1; ++s)
    if (s % 3 == 0) h.add(HealthCause::infinite, 1, {rect.x0, rect.y1 - 1, s});
  if (samples.s0 == 4) h.add(HealthCause::majorant_violation, 5, {rect.x0, rect.y0, 4});
  h.add(HealthCause::negative_density, 9);
  return h;
}
UnitResult unhealthy(UnitResult r) {
  const UnitHeader header = decode_partial_file(r.exr).value().partial.header;
  r.health = unhealthy(header.tile, header.samples);
  return r;
}
// Returns the health of the tiles from `from` up to 2, the number of tiles in the image.
Health expected(std::uint64_t spp, TileIndex from = 0) {
  Health sum;
  for (TileIndex t = from; t < 2; ++t) sum.merge(unhealthy(TileGrid{{40, 24}, 32}.rect(t), {0, spp}));
  if (spp > 4)  // the round that begins with sample 4, of each tile, even if it is cut short
    for (TileIndex t = from; t < 2; ++t) {
      const PixelRect rect = TileGrid{{40, 24}, 32}.rect(t);
      sum.add(HealthCause::majorant_violation, 5, {rect.x0, rect.y0, 4});
    }
  return sum;
}
JobId submit_spp(Coordinator& coordinator, std::uint64_t spp) {
  JobSpec spec;
  spec.spp = spp;
  return submit(coordinator, spec);
}

TEST(ServiceHealth, IsTheSameForShuffledAndDuplicatedResults) {
  TempFolder dir;
  for (unsigned seed = 0; seed < 3; ++seed) {
    auto coordinator = open_at(seed == 2 ? std::filesystem::path() : dir.path() / std::to_string(seed));
    const JobId job = submit_spp(*coordinator, 16);
    FakeFarm farm(*coordinator, 3);
    std::mt19937 random(seed);
    farm.reorder = [&](auto& units) { std::shuffle(units.begin(), units.end(), random); };
    farm.tamper = [&](UnitResult r) {
      return std::vector<UnitResult>(1 + random() % 3, unhealthy(std::move(r)));
    };

    ASSERT_TRUE(farm.finish(job));

    EXPECT_EQ(coordinator->job(job)->health, expected(16)) << seed;
    EXPECT_EQ(report(*coordinator, job)["nonfinite_samples"], 2 * 6) << seed;
    EXPECT_EQ(report(*coordinator, job)["majorant_violations"], 2 * 5) << seed << ": once of each tile";
    EXPECT_TRUE(farm.refusals.empty());
  }
}

TEST(ServiceHealth, SurvivesARestartAtAnyPointAndAfterTheEnd) {
  for (int k = 0; k <= 8; k += 2) {
    TempFolder dir;
    JobId job;
    {
      auto coordinator = open_at(dir.path());
      job = submit_spp(*coordinator, 16);
      FakeFarm farm(*coordinator, 1);
      farm.tamper = [](UnitResult r) { return std::vector{unhealthy(std::move(r))}; };
      farm.stop_after = k;
      farm.finish(job);
    }
    {
      auto coordinator = open_at(dir.path());
      FakeFarm farm(*coordinator, 1);
      farm.tamper = [](UnitResult r) { return std::vector{unhealthy(std::move(r))}; };
      ASSERT_TRUE(farm.finish(job)) << k;
      EXPECT_EQ(coordinator->job(job)->health, expected(16)) << k;
    }
    auto coordinator = open_at(dir.path());
    EXPECT_EQ(coordinator->job(job)->health, expected(16)) << k;
  }
}

// 6 samples end with a truncated round; when the job is extended, that round is rendered again in full.
TEST(ServiceHealth, ExtendedJobHasTheHealthOfASingleRender) {
  TempFolder dir;
  for (const bool restart : {false, true}) {
    const auto folder = dir.path() / std::to_string(restart);
    auto coordinator = open_at(folder);
    const JobId job = submit_spp(*coordinator, 6);
    const auto render = [&] {
      FakeFarm farm(*coordinator, 1);
      farm.tamper = [](UnitResult r) { return std::vector{unhealthy(std::move(r))}; };
      return farm.finish(job);
    };
    ASSERT_TRUE(render());
    EXPECT_EQ(coordinator->job(job)->health, expected(6));
    if (restart) {
      coordinator.reset();
      coordinator = open_at(folder);
    }
    ASSERT_TRUE(extend(*coordinator, job, 16));
    ASSERT_TRUE(render());
    EXPECT_EQ(coordinator->job(job)->health, expected(16)) << restart;
  }
}

// The health includes only units that are in the image: those of tile 0 wait for its first round.
TEST(ServiceHealth, CountsOnlyFoldedResults) {
  auto coordinator = open_at({});
  const JobId job = submit_spp(*coordinator, 16);
  FakeFarm farm(*coordinator, 1);
  farm.tamper = [](UnitResult r) {
    if (r.unit.tile == 0 && r.unit.round == 0) return std::vector<UnitResult>{};
    return std::vector{unhealthy(std::move(r))};
  };
  ASSERT_TRUE(farm.run([&] { return coordinator->job(job)->units_done == 7; }));
  EXPECT_EQ(coordinator->job(job)->health, expected(16, 1));
}

TEST(ServiceHealth, AppearsWithPlaceAndCommandInReportViewAndImage) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  JobSpec spec;
  spec.spp = 4;
  spec.seed = 3;
  spec.size = FrameSize{40, 24};
  const JobId job = submit(*coordinator, spec);
  FakeFarm farm(*coordinator, 1);
  farm.tamper = [](UnitResult r) { return std::vector{unhealthy(std::move(r))}; };
  ASSERT_TRUE(farm.finish(job));

  const auto health = report(*coordinator, job)["health"];
  EXPECT_EQ(health["clean"], false);
  ASSERT_EQ(health["causes"].size(), 2u);
  EXPECT_EQ(health["causes"][0]["text"], "4 samples were infinite; they count as zero");
  EXPECT_EQ(health["causes"][0]["replay"],
            "lightshaft render test.xml --seed 3 --size 40x24 --pixel 0,23 --sample 0");
  EXPECT_EQ(health["causes"][1]["effect"], "input");
  const auto image = coordinator->image_exr(job).value();
  const std::string bytes(reinterpret_cast<const char*>(image.data()), image.size());
  EXPECT_THAT(bytes, HasSubstr("lightshaft:health"));
  EXPECT_THAT(bytes, HasSubstr(canonical_json(coordinator->job(job)->health)));
}

TEST(ServiceHealth, HealthyJobIsClean) {
  auto coordinator = open_at({});
  const JobId job = submit_spp(*coordinator, 4);
  ASSERT_TRUE(finish(*coordinator, job));
  EXPECT_TRUE(coordinator->job(job)->health.clean());
  EXPECT_EQ(report(*coordinator, job)["health"]["clean"], true);
  const auto image = coordinator->image_exr(job).value();
  EXPECT_THAT(std::string(reinterpret_cast<const char*>(image.data()), image.size()), HasSubstr("clean"));
}

// A result is rejected if its health names a pixel outside the unit.
TEST(ServiceHealth, HealthOfOtherPixelsIsRefused) {
  auto coordinator = open_at({});
  const JobId job = submit_spp(*coordinator, 2);
  FakeFarm farm(*coordinator, 1);
  bool first = true;
  farm.tamper = [&](UnitResult r) {
    if (std::exchange(first, false)) r.health.add(HealthCause::infinite, 1, {1000, 0, 0});
    return std::vector{std::move(r)};
  };
  ASSERT_TRUE(farm.finish(job));
  ASSERT_EQ(farm.refusals.size(), 1u);
  EXPECT_THAT(farm.refusals[0].refused->message, HasSubstr("pixel 1000,0"));
  EXPECT_TRUE(coordinator->job(job)->health.clean());
}

}  // namespace
}  // namespace ls::coordinator

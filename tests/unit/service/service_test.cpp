// Whole jobs through the public interface: the pixels are the same for any order of results and any number of
// restarts.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

#include "core/base/log.h"
#include "tests/support/fake_clock.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

TEST(Service, RendersAJobOnDiskToThePixelsOfOneInMemory) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId job = submit(*coordinator);
  ASSERT_TRUE(finish(*coordinator, job, 2));

  EXPECT_EQ(pixels(*coordinator, job), reference_pixels());
  const auto r = report(*coordinator, job);
  EXPECT_EQ(r["spp"], 16);
  EXPECT_EQ(r["samples"], 16 * 40 * 24);
  EXPECT_EQ(r["stopped"], "spp");
  EXPECT_EQ(r["convergence"].size(), 4u);          // rounds of 2, 2, 4, 8 samples
  EXPECT_EQ(r["core_seconds"], 8 * kUnitSeconds);  // 2 tiles, 4 rounds; duplicate results count once
  EXPECT_TRUE(std::filesystem::exists(dir.path() / "jobs" / job.value / "image.exr"));
  const JobView view = coordinator->job(job).value();
  EXPECT_EQ(view.state, JobState::done);
  EXPECT_EQ(view.progress, 1);
  EXPECT_EQ(view.spp_done, 16);
  EXPECT_TRUE(view.error_now.has_value());
}

// The rounds have 2, 2, 4 and 8 samples, so the first half of a tile's units is a quarter of its samples.
TEST(Service, ProgressCountsSamplesNotUnits) {
  auto coordinator = open_at({});
  const JobId job = submit(*coordinator);
  FakeFarm farm(*coordinator, 1);
  bool seen = false;

  ASSERT_TRUE(farm.run([&] {
    const JobView view = coordinator->job(job).value();
    EXPECT_DOUBLE_EQ(view.progress, view.spp_done / 16);
    seen |= view.progress > 0 && view.progress < 1;
    return view.units_done == view.units_total;
  }));

  EXPECT_TRUE(seen);
}

TEST(Service, ShuffledAndDuplicatedResultsGiveTheSamePixels) {
  TempFolder dir;
  const std::string expected = reference_pixels();
  for (unsigned seed = 0; seed < 4; ++seed) {
    auto coordinator = open_at(dir.path() / std::to_string(seed));
    const JobId job = submit(*coordinator);
    FakeFarm farm(*coordinator, 3);
    std::mt19937 random(seed);
    farm.reorder = [&](auto& units) { std::shuffle(units.begin(), units.end(), random); };
    farm.tamper = [&](UnitResult r) { return std::vector<UnitResult>(1 + random() % 3, r); };

    ASSERT_TRUE(farm.finish(job));

    EXPECT_EQ(pixels(*coordinator, job), expected);
    EXPECT_TRUE(farm.refusals.empty());
  }
}

TEST(Service, RestartAtAnyPointLosesNoAcknowledgedResult) {
  const std::string expected = reference_pixels();
  for (int k = 0; k <= 8; ++k) {
    TempFolder dir;
    const JobId job = interrupted(dir.path(), k, 1);
    auto coordinator = open_at(dir.path());
    ASSERT_TRUE(coordinator->job(job)) << k;
    // One worker, since with two an idle worker also renders units of the other
    FakeFarm farm(*coordinator, 1);
    ASSERT_TRUE(farm.finish(job)) << k;
    EXPECT_EQ(pixels(*coordinator, job), expected) << k;
    EXPECT_LE(farm.results_sent, 8);
  }
}

TEST(Service, SegmentCutAtAnyByteIsRenderedAgainWithTheSamePixels) {
  const std::string expected = reference_pixels();
  for (const double share : {0.0, .13, .5, .77, .999}) {
    TempFolder dir;
    const JobId job = interrupted(dir.path(), 6, 1);
    const auto segment = dir.path() / "jobs" / job.value / "partials-000.seg";
    const auto size = static_cast<double>(std::filesystem::file_size(segment));
    std::filesystem::resize_file(segment, static_cast<std::uintmax_t>(size * share));

    auto coordinator = open_at(dir.path());
    ASSERT_TRUE(finish(*coordinator, job)) << share;
    EXPECT_EQ(pixels(*coordinator, job), expected) << share;
  }
}

TEST(Service, AcknowledgedResultsAreNotRenderedAgainAfterARestart) {
  TempFolder dir;
  JobId job;
  std::uint64_t done = 0;
  {
    auto coordinator = open_at(dir.path());
    job = submit(*coordinator);
    FakeFarm farm(*coordinator, 1);
    farm.tamper = [&](UnitResult r) { return std::vector<UnitResult>(farm.results_sent < 5 ? 1 : 0, r); };
    // When the fifth result is acknowledged, all five are on disk.
    ASSERT_TRUE(farm.run([&] { return coordinator->job(job)->units_done == 5; }));
    done = coordinator->job(job)->units_done;
  }
  ASSERT_EQ(done, 5u);
  auto coordinator = open_at(dir.path());
  EXPECT_EQ(coordinator->job(job)->units_done, 5u);
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.finish(job));
  EXPECT_EQ(farm.results_sent, 3);  // the rest of 8 units
}

TEST(Service, WrongPartialsAreRefusedWithAReasonAndTheJobContinues) {
  const std::string expected = reference_pixels();
  for (int kind = 0; kind < 4; ++kind) {
    auto coordinator = open_at({});
    const JobId job = submit(*coordinator);
    FakeFarm farm(*coordinator, 2);
    int wrong = 1;
    farm.tamper = [&](UnitResult r) {
      if (wrong-- <= 0) return std::vector{r};
      if (kind == 0) r.digest = sha256("other");
      if (kind == 1) r.exr.resize(r.exr.size() / 2);
      if (kind == 2 || kind == 3) {
        Partial partial = decode_partial_file(r.exr)->partial;
        if (kind == 2) partial.header.numeric_class = sha256("another class");
        if (kind == 3) {
          // Changes the last float of the file, since encode_partial would reject NaN.
          const float nan = std::numeric_limits<float>::quiet_NaN();
          std::memcpy(r.exr.data() + r.exr.size() - sizeof nan, &nan, sizeof nan);
          return std::vector{r};
        }
        r.exr = encode_partial(partial, {40, 24}).value();
        r.digest = unit_digest(partial);
      }
      return std::vector{r};
    };

    ASSERT_TRUE(farm.finish(job)) << kind;

    ASSERT_EQ(farm.refusals.size(), 1u) << kind;
    EXPECT_FALSE(farm.refusals[0].refused->message.empty());
    EXPECT_EQ(pixels(*coordinator, job), expected) << kind;
  }
}

TEST(Service, ExtendedJobHasTheBitsOfASingleRender) {
  TempFolder dir;
  for (const bool restart : {false, true}) {
    const auto data = dir.path() / (restart ? "restart" : "live");
    auto coordinator = open_at(data);
    JobSpec spec;
    spec.spp = 11;  // rounded up to 12, so the last round is truncated
    const JobId job = submit(*coordinator, spec);
    ASSERT_TRUE(finish(*coordinator, job));
    EXPECT_EQ(pixels(*coordinator, job), reference_pixels(12));
    if (restart) {
      coordinator.reset();
      coordinator = open_at(data);
    }
    EXPECT_FALSE(extend(*coordinator, job, 12));
    ASSERT_TRUE(extend(*coordinator, job, 70));
    EXPECT_EQ(coordinator->job(job)->state, JobState::running);

    ASSERT_TRUE(finish(*coordinator, job, 2));

    EXPECT_EQ(pixels(*coordinator, job), reference_pixels(70));
    EXPECT_EQ(report(*coordinator, job)["spp"], 70);
  }
}

TEST(Service, CancelledJobIgnoresResults) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId job = submit(*coordinator);
  FakeFarm farm(*coordinator, 1);
  farm.tamper = [&](UnitResult r) {
    EXPECT_TRUE(coordinator->cancel(job));
    return std::vector{r};
  };

  ASSERT_TRUE(farm.finish(job));
  EXPECT_EQ(coordinator->job(job)->state, JobState::cancelled);
  EXPECT_EQ(coordinator->job(job)->units_done, 0u);
  EXPECT_TRUE(coordinator->cancel(job));
  EXPECT_EQ(extend(*coordinator, job, 64).error().code, Errc::failed_precondition);
}

TEST(Service, RestartFromASnapshotAndLaterResultsGivesTheSamePixels) {
  const std::string expected = reference_pixels();
  for (int k = 2; k <= 8; k += 2) {
    TempFolder dir;
    JobId job;
    {
      const auto clock = std::make_shared<FakeClock>();
      Coordinator::Options options;
      options.data = dir.path();
      options.clock = clock;
      auto coordinator = Coordinator::open(options).value();
      job = submit(*coordinator);
      FakeFarm farm(*coordinator, 1);
      farm.tamper = [&](UnitResult r) {
        if (farm.results_sent == k) return std::vector<UnitResult>{};
        if (farm.results_sent == k / 2) clock->advance(std::chrono::seconds(61));
        return std::vector{r};
      };
      ASSERT_TRUE(
          farm.run([&] { return coordinator->job(job)->units_done == static_cast<std::uint64_t>(k); }));
      const auto patience = std::chrono::steady_clock::now() + std::chrono::minutes(2);
      const auto snapshot = dir.path() / "jobs" / job.value / "film.snap";
      while (!std::filesystem::exists(snapshot) && std::chrono::steady_clock::now() < patience)
        std::this_thread::yield();
      ASSERT_TRUE(std::filesystem::exists(snapshot)) << k;
    }
    auto coordinator = open_at(dir.path());
    ASSERT_TRUE(finish(*coordinator, job));
    EXPECT_EQ(pixels(*coordinator, job), expected) << k;
    EXPECT_EQ(coordinator->convergence(job)->size(), 4u) << k;
  }
}

TEST(Service, FullDiskPausesTheJobUntilSomebodyResumesIt) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId job = submit(*coordinator);
  FakeFarm farm(*coordinator, 1);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  ::signal(SIGXFSZ, SIG_IGN);
  farm.tamper = [&](UnitResult r) {
    // The disk has room for two and a half records.
    if (farm.results_sent == 2) {
      const rlimit tight{2 * (r.exr.size() + 184) + 1000, before.rlim_max};
      ::setrlimit(RLIMIT_FSIZE, &tight);
    }
    return std::vector<UnitResult>(farm.results_sent < 3 ? 1 : 0, r);
  };
  farm.run([&] { return !farm.refusals.empty(); });
  ::setrlimit(RLIMIT_FSIZE, &before);

  ASSERT_EQ(farm.refusals.size(), 1u);
  EXPECT_EQ(farm.refusals[0].refused->code, Errc::resource_exhausted);
  EXPECT_EQ(coordinator->job(job)->state, JobState::paused);
  EXPECT_NE(coordinator->job(job)->error.find("disk is full"), std::string::npos);
  std::string why;
  EXPECT_FALSE(coordinator->ready(&why));

  // The units of the two results that were held back are freed when their worker disconnects.
  farm.sessions()[0]->disconnected();
  ASSERT_TRUE(resume(*coordinator, job));
  FakeFarm other(*coordinator, 1);
  ASSERT_TRUE(other.finish(job));
  EXPECT_EQ(pixels(*coordinator, job), reference_pixels());
  EXPECT_TRUE(coordinator->ready(&why));
}

TEST(Service, UnknownJobIsReportedAsUnknown) {
  auto coordinator = open_at({});
  const JobId nobody{"j-none"};
  EXPECT_EQ(coordinator->job(nobody).error().code, Errc::not_found);
  EXPECT_EQ(coordinator->image_exr(nobody).error().code, Errc::not_found);
  EXPECT_EQ(coordinator->wait(nobody).error().code, Errc::not_found);
}

TEST(Service, TargetErrorStopsTheJobEvenAfterARestart) {
  JobSpec spec;
  spec.target_error = .003;
  auto whole = open_at({});
  const JobId at_once = submit(*whole, spec);
  FakeFarm one(*whole, 1);
  ASSERT_TRUE(one.finish(at_once));
  ASSERT_EQ(report(*whole, at_once)["stopped"], "error");

  TempFolder dir;
  const JobId job = interrupted(dir.path(), 9, 2, spec);
  auto coordinator = open_at(dir.path());
  ASSERT_TRUE(finish(*coordinator, job, 2));
  EXPECT_EQ(pixels(*coordinator, job), pixels(*whole, at_once));
  EXPECT_LE(report(*coordinator, job)["relmse"].get<double>(), .003);
}

TEST(Service, TwoCoordinatorsCannotShareAFolder) {
  TempFolder dir;
  auto first = open_at(dir.path());
  Coordinator::Options options;
  options.data = dir.path();
  const auto second = Coordinator::open(options);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("another coordinator"), std::string::npos);
}

}  // namespace
}  // namespace ls::coordinator

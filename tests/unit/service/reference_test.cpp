// A job with a reference image: its true error is known at every checkpoint, also after restarts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "coordinator/admission/admission.h"
#include "coordinator/store/blobs/memory_blobs.h"
#include "core/image/exr/exr_file.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

using testing::HasSubstr;

std::vector<std::byte> grey_exr(FrameSize size, float level) {
  ExrPicture p{size, {}, {}};
  for (const char* c : {"R", "G", "B"})
    p.channels[c] = ExrFloat{std::vector<float>(
        static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height), level)};
  return write_exr(p).value();
}

JobSpec against(Coordinator& coordinator, FrameSize size = {40, 24}) {
  const auto exr = grey_exr(size, .5F);
  JobSpec spec;
  spec.spp = 16;
  spec.reference = sha256(std::span<const std::byte>(exr));
  EXPECT_TRUE(coordinator.blobs().put(*spec.reference, exr));
  return spec;
}

std::vector<std::optional<ReferenceError>> truths(Coordinator& coordinator, const JobId& job) {
  std::vector<std::optional<ReferenceError>> out;
  const auto points = coordinator.convergence(job);
  if (!points) return out;
  for (const ConvergencePoint& p : *points) out.push_back(p.reference_error);
  return out;
}

std::vector<std::optional<ReferenceError>> rendered(const std::filesystem::path& data, unsigned seed) {
  auto coordinator = open_at(data);
  const JobId job = submit(*coordinator, against(*coordinator));
  FakeFarm farm(*coordinator, 2);
  std::mt19937 random(seed);
  farm.reorder = [&](auto& units) { std::shuffle(units.begin(), units.end(), random); };
  EXPECT_TRUE(farm.finish(job));
  const auto told = report(*coordinator, job);
  EXPECT_EQ(told["true_relmse"], truths(*coordinator, job).back()->relmse);
  EXPECT_EQ(told["reference"]["noise_relmse"], nullptr);
  return truths(*coordinator, job);
}

// One read of a store returns a limited number of bytes, as of a reference of more than 256 MiB.
TEST(ServiceReference, IsReadWholeFromAStoreThatReturnsPieces) {
  struct Pieces : MemoryBlobs {
    Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                        std::uint64_t length) const override {
      return MemoryBlobs::read(digest, offset, std::min<std::uint64_t>(length, 100));
    }
  } blobs;
  const auto exr = grey_exr({40, 24}, .5F);
  ASSERT_GT(exr.size(), 100u);
  JobSpec spec;
  spec.reference = sha256(std::span<const std::byte>(exr));
  ASSERT_TRUE(blobs.put(*spec.reference, exr));

  const auto reference = load_reference(spec, {40, 24}, blobs);

  EXPECT_TRUE(reference) << reference.error().message;
}

TEST(ServiceReference, GivesTheTrueErrorAtEveryCheckpointForAnyOrderOfResults) {
  TempFolder dir;
  const auto first = rendered(dir.path() / "a", 1);
  ASSERT_EQ(first.size(), 4u);  // 2, 4, 8, 16 samples
  for (const auto& reference_error : first) {
    ASSERT_TRUE(reference_error);
    EXPECT_GT(reference_error->rmse, 0);
    ASSERT_TRUE(reference_error->flip);
    EXPECT_GT(*reference_error->flip, 0);
  }
  EXPECT_EQ(rendered(dir.path() / "b", 2), first);
  EXPECT_EQ(rendered({}, 3), first);  // in memory
}

// The job is cancelled in the middle of a round. The list of jobs, the curve and the report then describe the
// same image, which is the one that the user gets, and the true error is that of this image.
TEST(ServiceReference, CurveEndsWithTheErrorOfTheFinalImage) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId job = submit(*coordinator, against(*coordinator));
  {
    FakeFarm farm(*coordinator, 1);
    farm.reorder = [](auto& units) {
      std::stable_sort(units.begin(), units.end(),
                       [](const LeaseUnit& a, const LeaseUnit& b) { return a.round < b.round; });
    };
    farm.stop_after = 5;  // both tiles to 4 samples, and the third round of one of them
    farm.finish(job);
    while (coordinator->job(job)->spp_done < 7)
      std::this_thread::yield();  // it is 7.2 when all five are in the image
    ASSERT_EQ(coordinator->convergence(job)->size(), 2u);
    ASSERT_TRUE(coordinator->cancel(job));
  }
  const auto told_alike = [&] {
    const auto points = coordinator->convergence(job).value();
    const auto told = report(*coordinator, job);
    ASSERT_EQ(points.size(), 3u);
    EXPECT_EQ(points.back().spp, told["spp"]);
    EXPECT_EQ(points.back().error.relmse, told["relmse"]);
    EXPECT_EQ(coordinator->job(job)->error_now->relmse, told["relmse"]);
    if (const auto reference_error =
            points.back().reference_error) {  // lost with the coordinator if it was not stored yet
      EXPECT_EQ(reference_error->relmse, told["true_relmse"]);
      EXPECT_NE(reference_error->relmse, points[1].reference_error->relmse);
    }
  };
  while (!coordinator->convergence(job)->back().reference_error) std::this_thread::yield();
  told_alike();
  while (!std::filesystem::exists(dir.path() / "jobs" / job.value / "film.snap")) std::this_thread::yield();
  coordinator.reset();
  coordinator = open_at(dir.path());
  told_alike();
}

TEST(ServiceReference, SurvivesARestart) {
  TempFolder dir;
  const auto expected = rendered(dir.path() / "whole", 1);
  for (int k = 1; k < 8; ++k) {
    JobId job;
    {
      auto coordinator = open_at(dir.path() / std::to_string(k));
      job = submit(*coordinator, against(*coordinator));
      FakeFarm farm(*coordinator, 1);
      farm.stop_after = k;
      farm.finish(job);
    }
    auto coordinator = open_at(dir.path() / std::to_string(k));
    ASSERT_TRUE(finish(*coordinator, job));
    EXPECT_EQ(truths(*coordinator, job), expected) << k;
  }
}

TEST(ServiceReference, IsReadWhenTheJobIsSubmitted) {
  auto coordinator = open_at({});
  SubmitRequest request{"s.xml", kSceneText, {}, against(*coordinator, {40, 25})};
  EXPECT_THAT(coordinator->submit(request).error().error.message, HasSubstr("40 x 25"));
  request.spec.reference = sha256("nothing");
  EXPECT_THAT(coordinator->submit(request).error().error.message, HasSubstr("PUT /api/v1/blobs/"));
}

// Makes the spec of a job whose reference claims to be a render of the job's own scene with `seed`.
JobSpec against_own_scene(Coordinator& coordinator, const std::string& seed) {
  JobSpec spec;
  spec.spp = 16;
  const std::string scene = report(coordinator, submit(coordinator, spec))["scene"];
  ExrPicture p{{40, 24}, {}, {{"lightshaft:scene", scene}, {"lightshaft:seed", seed}}};
  for (const char* c : {"R", "G", "B"}) {
    p.channels[c] = ExrFloat{std::vector<float>(960, .5F)};
    p.channels[std::string("stderr.") + c] = ExrFloat{std::vector<float>(960, 1e-6F)};
  }
  const auto exr = write_exr(p).value();
  spec.reference = sha256(std::span<const std::byte>(exr));
  EXPECT_TRUE(coordinator.blobs().put(*spec.reference, exr));
  return spec;
}

TEST(ServiceReference, ReferenceWithTheJobsSeedIsReportedWithoutAVerdict) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId same = submit(*coordinator, against_own_scene(*coordinator, "0")),
              other = submit(*coordinator, against_own_scene(*coordinator, "1"));
  EXPECT_TRUE(coordinator->job(same)->reference_same_seed);
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.finish(same));
  ASSERT_TRUE(farm.finish(other));

  const auto told = report(*coordinator, same), apart = report(*coordinator, other);

  EXPECT_EQ(told["reference"]["same_seed"], true);
  EXPECT_EQ(apart["reference"]["same_seed"], false);
  EXPECT_EQ(told["true_relmse"], apart["true_relmse"]);  // reported as for the other job
  EXPECT_NE(told["verdict_kind"], "bias_floor");
  EXPECT_EQ(coordinator->job(same)->convergence_status->words, told["verdict"]);
}

TEST(ServiceReference, IsNotNeededForMaps) {
  auto coordinator = open_at({});
  JobSpec spec;
  spec.spp = 4;
  const JobId job = submit(*coordinator, spec);
  EXPECT_TRUE(coordinator->error_png(job));  // works although nothing is rendered yet
  ASSERT_TRUE(finish(*coordinator, job));
  EXPECT_TRUE(coordinator->error_png(job));
  EXPECT_TRUE(coordinator->samples_png(job));
  EXPECT_FALSE(coordinator->samples_png({"j-none"}));
  EXPECT_EQ(report(*coordinator, job)["reference"], nullptr);
}

}  // namespace
}  // namespace ls::coordinator

#include <gtest/gtest.h>

#include "tests/support/fake_clock.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

constexpr Duration kKeep = std::chrono::hours(2);

struct Collect : ::testing::Test {
  TempFolder dir;
  std::shared_ptr<FakeClock> clock = std::make_shared<FakeClock>();

  std::unique_ptr<Coordinator> open() {
    Coordinator::Options options;
    options.data = dir.path();
    options.clock = clock;
    options.keep_unused = kKeep;
    return Coordinator::open(std::move(options)).value();
  }
  void let_time_pass(Coordinator& coordinator) {
    coordinator.collect();
    clock->advance(kKeep);
    coordinator.collect();
  }
  static Digest put(Coordinator& coordinator, std::string_view text) {
    EXPECT_TRUE(coordinator.blobs().put(sha256(text), std::as_bytes(std::span(text))));
    return sha256(text);
  }
};

TEST_F(Collect, FilesOfAJobAreRemovedAfterIt) {
  auto coordinator = open();
  const JobId job = coordinator->submit({"scene.xml", kSceneText, {}, {}}).value();
  const Digest stray = put(*coordinator, "a file of a bundle that was refused");

  let_time_pass(*coordinator);
  EXPECT_FALSE(coordinator->blobs().has(stray));
  EXPECT_EQ(coordinator->blobs().list(false).value().size(), 1u) << "the job's scene";

  coordinator.reset();
  coordinator = open();
  EXPECT_EQ(coordinator->job(job)->state, JobState::queued);

  ASSERT_TRUE(coordinator->cancel(job));
  let_time_pass(*coordinator);
  EXPECT_EQ(coordinator->blobs().list(false).value().size(), 1u) << "a cancelled job is still there";
  ASSERT_TRUE(coordinator->remove(job));
  let_time_pass(*coordinator);
  EXPECT_TRUE(coordinator->blobs().list(false).value().empty());
}

TEST_F(Collect, BlobReportedAsPresentStaysUntilTheSubmission) {
  auto coordinator = open();
  const Digest file = put(*coordinator, "grid");
  coordinator->collect();
  clock->advance(kKeep - std::chrono::seconds(1));

  ASSERT_TRUE(coordinator->blobs().has(file));  // the same request as in POST /blobs/missing
  clock->advance(std::chrono::seconds(1));
  coordinator->collect();

  EXPECT_TRUE(coordinator->blobs().has(file));
}

TEST_F(Collect, AbandonedUploadIsRemovedEvenWhereBlobsAreKeptForEver) {
  Coordinator::Options options;
  options.data = dir.path();
  options.clock = clock;
  options.keep_unused.reset();
  auto coordinator = Coordinator::open(std::move(options)).value();
  const Digest file = sha256("grid");
  ASSERT_TRUE(coordinator->blobs().resume_upload(file, 0).value()->append(std::as_bytes(std::span("gr", 2))));

  coordinator->collect();
  clock->advance(std::chrono::hours(24));
  coordinator->collect();

  EXPECT_EQ(coordinator->blobs().received(file), 0u);
}

TEST_F(Collect, AbandonedUploadIsRemoved) {
  auto coordinator = open();
  const Digest file = sha256("grid");
  ASSERT_TRUE(coordinator->blobs().resume_upload(file, 0).value()->append(std::as_bytes(std::span("gr", 2))));

  coordinator->collect();
  EXPECT_EQ(coordinator->blobs().received(file), 2u);
  clock->advance(kKeep);
  coordinator->collect();

  EXPECT_EQ(coordinator->blobs().received(file), 0u);
}

}  // namespace
}  // namespace ls::coordinator

// Jobs whose files cannot be written at their end: they are written as soon as that is possible, without an
// action of a user.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <new>

#include "coordinator/base/limits.h"
#include "coordinator/store/blobs/memory_blobs.h"
#include "tests/support/eventually.h"
#include "tests/support/fake_clock.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

using ::testing::HasSubstr;

struct Unwritten : ::testing::Test {
  TempFolder dir;
  std::shared_ptr<FakeClock> clock = std::make_shared<FakeClock>();
  std::unique_ptr<Coordinator> coordinator = open();
  JobId job = submit(*coordinator);

  std::unique_ptr<Coordinator> open() const {
    Coordinator::Options options;
    options.data = dir.path();
    options.clock = clock;
    options.audit_rate = 0;
    return Coordinator::open(std::move(options)).value();
  }
  std::filesystem::path file(const std::string& name) const { return dir.path() / "jobs" / job.value / name; }
  // A folder that is not empty has the file's name, so that it cannot be written.
  void put_in_the_way_of(const std::string& name) const {
    std::filesystem::create_directories(file(name) / "in the way");
  }
  std::string error() const { return coordinator->job(job)->error; }
  JobState state() const { return coordinator->job(job)->state; }
  void render_without_a_place_for_the_image() {
    put_in_the_way_of("image.exr");
    FakeFarm farm(*coordinator, 1);
    EXPECT_TRUE(farm.run([&] { return !error().empty(); }));
  }
  // Files are written in order: once another job is done, all that was asked before has been tried.
  void wait_for_the_writer() const { EXPECT_TRUE(finish(*coordinator, submit(*coordinator))); }
  void wait_and_look() const {
    clock->advance(limits::kWriteAgain);
    coordinator->tick();
  }
};

TEST_F(Unwritten, FinalImageIsWrittenOnceThereIsAPlaceForIt) {
  render_without_a_place_for_the_image();
  EXPECT_THAT(error(), HasSubstr("the final image cannot be written"));
  std::filesystem::remove_all(file("image.exr"));

  wait_and_look();

  EXPECT_TRUE(test::eventually([&] { return state() == JobState::done; }));
  EXPECT_EQ(error(), "");
  EXPECT_EQ(pixels(*coordinator, job), reference_pixels());
}

TEST_F(Unwritten, FinalImageIsTriedAgainUntilThereIsAPlaceForIt) {
  render_without_a_place_for_the_image();
  for (int tries = 0; tries < 3; ++tries) {
    wait_and_look();
    EXPECT_EQ(state(), JobState::running);
  }
  std::filesystem::remove_all(file("image.exr"));

  EXPECT_TRUE(test::eventually([&] {
    wait_and_look();
    return state() == JobState::done;
  }));
}

TEST_F(Unwritten, FinalImageIsNotTriedBeforeItsTime) {
  render_without_a_place_for_the_image();
  std::filesystem::remove_all(file("image.exr"));

  clock->advance(limits::kWriteAgain - std::chrono::milliseconds(1));
  coordinator->tick();

  wait_for_the_writer();
  EXPECT_EQ(state(), JobState::running);
  EXPECT_THAT(error(), HasSubstr("the final image cannot be written"));
}

TEST_F(Unwritten, ResumedJobIsWrittenAtOnceAndNotTwice) {
  render_without_a_place_for_the_image();
  std::filesystem::remove_all(file("image.exr"));

  ASSERT_TRUE(resume(*coordinator, job));
  ASSERT_TRUE(test::eventually([&] { return state() == JobState::done; }));
  std::filesystem::remove(file("image.exr"));
  wait_and_look();
  ASSERT_TRUE(extend(*coordinator, job, 32));
  ASSERT_TRUE(finish(*coordinator, job));

  EXPECT_EQ(pixels(*coordinator, job), reference_pixels(32));
}

TEST_F(Unwritten, RemovedJobIsNotWritten) {
  render_without_a_place_for_the_image();

  ASSERT_TRUE(coordinator->remove(job));
  wait_and_look();

  EXPECT_TRUE(test::eventually([&] { return !std::filesystem::exists(file("")); }));
}

// A store that has no memory to read blobs while `empty`. The names in cryptomattes are read from the scene.
class StoreWithoutMemory final : public MemoryBlobs {
 public:
  std::atomic<bool> empty{false};
  Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                      std::uint64_t length) const override {
    if (empty) throw std::bad_alloc();
    return MemoryBlobs::read(digest, offset, length);
  }
};

TEST_F(Unwritten, FinalImageForWhichMemoryRanOutIsWrittenLater) {
  TempFolder folder;
  const auto blobs = std::make_shared<StoreWithoutMemory>();
  Coordinator::Options options;
  options.data = folder.path();
  options.clock = clock;
  options.blobs = blobs;
  options.audit_rate = 0;
  const auto small = Coordinator::open(std::move(options)).value();
  JobSpec spec;
  spec.aov = {"crypto_object"};
  const JobId with_names = submit(*small, spec);
  FakeFarm farm(*small, 1);
  ASSERT_TRUE(farm.run([&] { return small->job(with_names)->units_done > 0; }));
  blobs->empty = true;
  ASSERT_TRUE(farm.run([&] { return !small->job(with_names)->error.empty(); }));
  EXPECT_THAT(small->job(with_names)->error, HasSubstr("not enough memory"));

  blobs->empty = false;
  clock->advance(limits::kWriteAgain);
  small->tick();

  EXPECT_TRUE(test::eventually([&] { return small->job(with_names)->state == JobState::done; }));
}

TEST_F(Unwritten, ImageOfACancelledJobIsWrittenOnceThereIsAPlaceForIt) {
  {
    FakeFarm farm(*coordinator, 1);
    farm.stop_after = 3;
    farm.finish(job);
  }
  put_in_the_way_of("film.snap");
  ASSERT_TRUE(coordinator->cancel(job));
  wait_for_the_writer();
  std::filesystem::remove_all(file("film.snap"));

  EXPECT_TRUE(test::eventually([&] {
    wait_and_look();
    return std::filesystem::is_regular_file(file("film.snap"));
  }));
}

}  // namespace
}  // namespace ls::coordinator

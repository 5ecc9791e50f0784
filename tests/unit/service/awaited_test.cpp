// Jobs whose files are damaged or missing: they wait without costing workers any attempts, and resume when
// the files are available again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "coordinator/store/blobs/disk_blobs.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::string_view kWood = "not a picture, which a fake worker does not mind";
const std::string kScene = R"(<scene version="3.0.0">
  <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="24"/></film>
    <sampler type="independent"><integer name="sample_count" value="4"/></sampler></sensor>
  <shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="wood.png"/></texture></bsdf></shape>
  <emitter type="constant"/>
</scene>)";

struct Awaited : ::testing::Test {
  TempFolder dir;
  std::shared_ptr<DiskBlobs> blobs = DiskBlobs::open(dir.path() / "blobs").value();
  std::unique_ptr<Coordinator> coordinator = open();
  const Digest wood = sha256(kWood);
  JobId job = submit_wood();

  std::unique_ptr<Coordinator> open() const {
    Coordinator::Options options;
    options.data = dir.path();
    options.blobs = blobs;
    options.audit_rate = 0;
    return Coordinator::open(std::move(options)).value();
  }
  Result<void> upload() const { return blobs->put(wood, std::as_bytes(std::span(kWood))); }
  JobId submit_wood() const {
    EXPECT_TRUE(upload());
    auto id = coordinator->submit({"desk.xml", kScene, {{"wood.png", wood}}, {}});
    EXPECT_TRUE(id) << (id ? "" : id.error().error.message + format_diagnostics(id.error().diagnostics));
    return id.value_or(JobId{});
  }
  void damage() const { std::ofstream(blobs->path(wood)) << "other bytes"; }
  // Does what a worker's call FetchBlob does.
  void fetch() const {
    if (const auto right = blobs->prove(wood); !right) coordinator->blob_missing(wood, right.error());
  }
  JobState state() const { return coordinator->job(job)->state; }
  bool goes_on() const {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    while (state() == JobState::paused && std::chrono::steady_clock::now() < end) {
      coordinator->tick();
      std::this_thread::yield();
    }
    return state() != JobState::paused;
  }
};

TEST_F(Awaited, JobWaitsForADamagedFileWithAnErrorThatSaysWhatToDo) {
  damage();

  fetch();

  EXPECT_EQ(state(), JobState::paused);
  EXPECT_THAT(coordinator->job(job)->error,
              AllOf(HasSubstr("wood.png"), HasSubstr(wood.hex()), HasSubstr("damaged"),
                    HasSubstr("upload the file again"), HasSubstr("lightshaft submit")));
}

TEST_F(Awaited, JobContinuesWhenItsFileReturns) {
  damage();
  fetch();

  ASSERT_TRUE(upload());

  ASSERT_TRUE(goes_on());
  EXPECT_THAT(coordinator->job(job)->error, Not(HasSubstr("waits for its file")));
  EXPECT_TRUE(finish(*coordinator, job));
}

TEST_F(Awaited, JobWaitsForAMissingFileAfterARestart) {
  ASSERT_TRUE(blobs->remove(wood));
  fetch();
  ASSERT_EQ(state(), JobState::paused);

  coordinator.reset();
  coordinator = open();

  EXPECT_EQ(state(), JobState::paused);
  EXPECT_THAT(coordinator->job(job)->error, HasSubstr("wood.png"));
  ASSERT_TRUE(upload());
  EXPECT_TRUE(goes_on());
}

TEST_F(Awaited, JobWaitsForAFileThatIsMissingAtTheStart) {
  coordinator.reset();
  ASSERT_TRUE(blobs->remove(wood));

  coordinator = open();

  EXPECT_EQ(state(), JobState::paused);
  ASSERT_TRUE(upload());
  EXPECT_TRUE(goes_on());
}

TEST_F(Awaited, FileThatReturnedWhileTheCoordinatorWasDownIsFound) {
  damage();
  fetch();
  coordinator.reset();
  ASSERT_TRUE(upload());

  coordinator = open();

  EXPECT_TRUE(goes_on());
}

TEST_F(Awaited, JobPausedByItsUserStaysPausedWhenItsFileReturns) {
  const JobId paused = job;
  damage();
  fetch();
  ASSERT_TRUE(pause(*coordinator, paused));
  job = submit_wood();  // uploads the file again
  coordinator->blob_missing(wood, {Errc::not_found, "there is no such blob"});
  ASSERT_EQ(state(), JobState::paused);

  ASSERT_TRUE(goes_on());

  EXPECT_EQ(coordinator->job(paused)->state, JobState::paused);
}

TEST_F(Awaited, JobThatDoesNotNeedTheFileContinues) {
  const JobId without = submit(*coordinator);
  damage();

  fetch();

  EXPECT_EQ(coordinator->job(without)->state, JobState::queued);
}

TEST_F(Awaited, DamagedSceneFileIsRefusedAtSubmission) {
  const std::string part = R"(<scene version="3.0.0"><emitter type="constant"/></scene>)";
  const std::string whole = R"(<scene version="3.0.0"><include filename="part.xml"/><shape type="sphere"/>
    <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film></sensor></scene>)";
  ASSERT_TRUE(blobs->put(sha256(part), std::as_bytes(std::span(part))));
  ASSERT_TRUE(coordinator->submit({"a.xml", whole, {{"part.xml", sha256(part)}}, {}}));
  std::ofstream(blobs->path(sha256(part))) << R"(<scene version="3.0.0"><emitter type="envmap"/></scene>)";

  const auto refused = coordinator->submit({"a.xml", whole, {{"part.xml", sha256(part)}}, {}});

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().error.message + format_diagnostics(refused.error().diagnostics),
              AllOf(HasSubstr(sha256(part).hex()), HasSubstr("damaged"), HasSubstr("upload the file again")));
}

}  // namespace
}  // namespace ls::coordinator

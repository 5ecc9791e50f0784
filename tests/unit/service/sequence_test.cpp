// Sequences (jobs with several frames) through the public interface.
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <set>

#include "coordinator/admission/admission.h"
#include "coordinator/views/views.h"
#include "formats/read.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

JobSpec frames(std::uint32_t first, std::uint32_t last, std::uint64_t spp = 4) {
  JobSpec spec;
  spec.frames = FrameRange{first, last, 1};
  spec.spp = spp;
  return spec;
}

// Returns the pixels of a single job with this seed, to compare with a frame that has the seed.
std::string pixels_with_seed(std::uint64_t seed, std::uint64_t spp = 4) {
  auto coordinator = open_at({});
  JobSpec spec;
  spec.seed = seed;
  spec.spp = spp;
  const JobId job = submit(*coordinator, spec);
  EXPECT_TRUE(finish(*coordinator, job));
  return pixels(*coordinator, job);
}

// Makes a request whose scene uses one mesh file per frame; only the files of the frames in `present` are
// uploaded.
SubmitRequest meshes(Coordinator& coordinator, const std::set<int>& present, JobSpec spec) {
  SubmitRequest request{"mesh.xml", with_mesh("mesh.###.ply"), {}, std::move(spec)};
  for (const int frame : present) {
    const std::string bytes = "mesh of frame " + std::to_string(frame);
    EXPECT_TRUE(coordinator.blobs().put(sha256(bytes), std::as_bytes(std::span(bytes))));
    request.assets[numbered("mesh.###.ply", static_cast<std::uint32_t>(frame))] = sha256(bytes);
  }
  return request;
}

TEST(FrameId, RoundTripsInOneForm) {
  const JobId whole{"j-f1234567"};
  const auto id = frame_of(frame_job(whole, 12));
  ASSERT_TRUE(id);
  EXPECT_EQ(id->sequence, whole);
  EXPECT_EQ(id->frame, 12u);
  for (const char* text : {"j-f1234567", "j-1-frame", "j-1-frame01", "-frame1", "j-1-frame1x", "j-1-frame-1",
                           "j-1-frame99999999", "j-1-frame99999999999999999999"})
    EXPECT_FALSE(frame_of(JobId{text})) << text;
}

TEST(Sequence, EndsAtTheFirstFrameWhoseReaderFails) {
  const auto coordinator = Coordinator::open({}).value();
  int read = 0;
  const SceneReader failing = [&](std::string_view, std::string_view, AssetSource&,
                                  const ReadOptions&) -> Result<ReadResult> {
    ++read;
    return fail(Errc::invalid_argument, "the scene s.xml cannot be read: its reader crashed");
  };
  JobSpec spec;
  spec.frames = FrameRange{1, 20, 1};
  const auto taken = admit_sequence({"s.xml", kSceneText, {}, spec}, coordinator->blobs(), failing);
  ASSERT_FALSE(taken);
  EXPECT_THAT(taken.error().error.message, HasSubstr("its reader crashed"));
  EXPECT_EQ(read, 1);
}

TEST(Sequence, FramesHaveThePixelsOfSeparateJobs) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId id = submit(*coordinator, frames(3, 5));
  ASSERT_TRUE(finish(*coordinator, id, 2));

  ASSERT_EQ(coordinator->jobs().size(), 1u);
  const JobView view = coordinator->job(id).value();
  EXPECT_EQ(view.state, JobState::done);
  EXPECT_EQ(view.progress, 1);
  EXPECT_EQ(view.spp_done, 4);
  EXPECT_TRUE(view.error_now);
  ASSERT_TRUE(view.frames);
  EXPECT_EQ(view.frames->done, 3u);
  ASSERT_EQ(view.frames->all.size(), 3u);
  const auto whole = report(*coordinator, id);
  std::set<std::string> distinct;
  Sha256 chain;
  for (std::size_t i = 0; i < 3; ++i) {
    const FrameView& frame = view.frames->all[i];
    EXPECT_EQ(frame.frame, 3 + i);
    const std::string expected = pixels_with_seed(frame.frame);
    EXPECT_EQ(pixels(*coordinator, frame.job), expected) << frame.frame;
    EXPECT_EQ(whole["frames"][i]["pixels_sha256"], expected);
    EXPECT_TRUE(coordinator->image_exr(frame.job));
    distinct.insert(expected);
    chain.update(std::as_bytes(std::span(Digest::parse(expected)->bytes)));
  }
  EXPECT_EQ(distinct.size(), 3u) << "frames with one noise";
  EXPECT_EQ(whole["pixels_sha256"], chain.finish().hex());
  EXPECT_EQ(whole["core_seconds"], 3 * 4 * kUnitSeconds);  // 2 tiles, 2 rounds; duplicate results count once
  EXPECT_NE(coordinator->job_log(id)->find("frame 3: submitted with 3 frames"), std::string::npos);
}

TEST(Sequence, IsSubmittedAgainWithAllItsFrames) {
  auto coordinator = open_at({});
  const JobId id = submit(*coordinator, frames(3, 4));
  JobSpec changes;
  changes.seed = 7;

  const JobId again = coordinator->submit_again(id, changes, "anna").value();
  ASSERT_TRUE(finish(*coordinator, again));

  const JobView view = coordinator->job(again).value();
  ASSERT_TRUE(view.frames);
  EXPECT_EQ(view.owner, "anna");
  EXPECT_EQ(view.frames->range, (FrameRange{3, 4, 1}));
  EXPECT_EQ(pixels(*coordinator, frame_job(again, 3)), pixels_with_seed(10));
  EXPECT_EQ(pixels(*coordinator, frame_job(again, 4)), pixels_with_seed(11));
}

TEST(Sequence, FramesAreLeasedInTheirOrder) {
  auto coordinator = open_at({});
  const JobId id = submit(*coordinator, frames(8, 11));
  std::vector<std::uint32_t> order;
  FakeFarm farm(*coordinator, 1);
  farm.tamper = [&](UnitResult r) {
    const std::uint32_t frame = frame_of(r.unit.job)->frame;
    if (order.empty() || order.back() != frame) order.push_back(frame);
    return std::vector{std::move(r)};
  };

  ASSERT_TRUE(farm.finish(id));

  EXPECT_EQ(order, (std::vector<std::uint32_t>{8, 9, 10, 11}));
}

TEST(Sequence, SurvivesAKillInTheMiddle) {
  TempFolder dir;
  JobId id;
  std::uint64_t before = 0;
  {
    auto coordinator = open_at(dir.path());
    id = submit(*coordinator, frames(1, 4));
    FakeFarm farm(*coordinator, 2);
    farm.stop_after = 10;  // each frame has 4 units: two frames are done, one has begun, one waits
    farm.run([] { return false; });
    before = coordinator->job(id)->units_done;
  }
  auto coordinator = open_at(dir.path());
  ASSERT_EQ(coordinator->jobs().size(), 1u);
  const JobView back = coordinator->job(id).value();
  EXPECT_GE(back.units_done, before);
  EXPECT_EQ(back.frames->all.size(), 4u);
  EXPECT_EQ(to_string(back.frames->range), "1-4");
  ASSERT_TRUE(finish(*coordinator, id));

  for (std::uint32_t frame = 1; frame <= 4; ++frame)
    EXPECT_EQ(pixels(*coordinator, frame_job(id, frame)), pixels_with_seed(frame)) << frame;
}

TEST(Sequence, IsPausedResumedCancelledAndRemovedAsAWhole) {
  TempFolder dir;
  {
    auto coordinator = open_at(dir.path());
    const JobId id = submit(*coordinator, frames(1, 3));
    const auto states = [&] {
      std::set<JobState> all;
      const auto job = coordinator->job(id);
      for (const auto& f : job->frames->all) all.insert(f.state);
      return all;
    };
    ASSERT_TRUE(pause(*coordinator, id));
    EXPECT_EQ(states(), std::set{JobState::paused});
    EXPECT_EQ(coordinator->job(id)->state, JobState::paused);
    ASSERT_TRUE(resume(*coordinator, id));
    ASSERT_TRUE(set_priority(*coordinator, id, 7));
    EXPECT_EQ(coordinator->job(frame_job(id, 3))->priority, 7);
    EXPECT_FALSE(set_priority(*coordinator, id, 2'000'000'000));
    ASSERT_TRUE(coordinator->cancel(frame_job(id, 2))) << "one frame alone";
    EXPECT_NE(coordinator->job(id)->state, JobState::cancelled);
    EXPECT_FALSE(coordinator->remove(frame_job(id, 2))) << "a sequence has no holes";

    ASSERT_TRUE(coordinator->remove(id)) << "which cancels what goes on";
    EXPECT_EQ(states(), std::set{JobState::cancelled});
    EXPECT_TRUE(coordinator->wait(id));
  }
  auto coordinator = open_at(dir.path());
  ASSERT_EQ(coordinator->jobs().size(), 1u);
  const JobId id = coordinator->jobs()[0].id;
  EXPECT_EQ(coordinator->job(id)->state, JobState::cancelled);
  EXPECT_EQ(coordinator->job(id)->priority, 7);
  EXPECT_EQ(resume(*coordinator, id).error().code, Errc::failed_precondition);

  std::mutex mutex;
  std::condition_variable heard;
  std::string last;
  const auto listening = coordinator->subscribe(0, [&](const StreamEvent& e) {
    const std::lock_guard lock(mutex);
    last = e.data;
    heard.notify_all();
  });
  ASSERT_TRUE(coordinator->remove(id));
  {
    std::unique_lock lock(mutex);
    EXPECT_TRUE(heard.wait_for(lock, std::chrono::minutes(2), [&] { return last == job_removed_json(id); }))
        << last;
  }

  EXPECT_TRUE(coordinator->jobs().empty());
  EXPECT_FALSE(coordinator->job(frame_job(id, 1)));
  coordinator.reset();
  EXPECT_TRUE(open_at(dir.path())->jobs().empty());
}

TEST(Sequence, ExtendedSequenceHasThePixelsOfASingleRender) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId id = submit(*coordinator, frames(1, 2, 4));
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.finish(id));

  ASSERT_TRUE(extend(*coordinator, id, 16));
  ASSERT_TRUE(farm.finish(id));

  for (std::uint32_t frame = 1; frame <= 2; ++frame)
    EXPECT_EQ(pixels(*coordinator, frame_job(id, frame)), pixels_with_seed(frame, 16));
  EXPECT_EQ(extend(*coordinator, id, 16).error().code, Errc::failed_precondition);
}

TEST(Sequence, IsNotExtendedInPartsIfAFrameHasMoreSamplesAlready) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId id = submit(*coordinator, frames(1, 3, 4));
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.finish(id));
  ASSERT_TRUE(extend(*coordinator, frame_job(id, 3), 32));
  ASSERT_TRUE(farm.finish(id));

  const auto refused = extend(*coordinator, id, 16);

  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("frame 3"), std::string::npos) << refused.error().message;
  for (std::uint32_t frame = 1; frame <= 2; ++frame) {
    EXPECT_EQ(coordinator->job(frame_job(id, frame))->state, JobState::done);
    EXPECT_EQ(coordinator->job(frame_job(id, frame))->spp, 4u);
  }
  ASSERT_TRUE(extend(*coordinator, id, 64));
  ASSERT_TRUE(farm.finish(id));
  for (std::uint32_t frame = 1; frame <= 3; ++frame)
    EXPECT_EQ(pixels(*coordinator, frame_job(id, frame)), pixels_with_seed(frame, 64));
}

TEST(Sequence, RequestsForOneImageNeedTheFrame) {
  auto coordinator = open_at({});
  const JobId id = submit(*coordinator, frames(2, 3));
  const auto error = coordinator->image_png(id).error();
  EXPECT_EQ(error.code, Errc::invalid_argument);
  EXPECT_NE(error.message.find("2-3"), std::string::npos) << error.message;
  const auto none = coordinator->tiles(frame_job(id, 9)).error();
  EXPECT_EQ(none.code, Errc::not_found);
  EXPECT_NE(none.message.find("no frame 9"), std::string::npos) << none.message;
  EXPECT_TRUE(coordinator->tiles(frame_job(id, 2)));
}

TEST(Sequence, EveryFrameReadsItsOwnFilesAndTheSharedOnesOnce) {
  auto coordinator = open_at({});
  const auto taken = admit_sequence(meshes(*coordinator, {1, 2, 3}, frames(1, 3)), coordinator->blobs(),
                                    scenes_in_this_process());
  ASSERT_TRUE(taken);
  ASSERT_EQ(taken->size(), 3u);
  EXPECT_EQ((*taken)[1].job.assets.at(0).name, "mesh.002.ply");
  EXPECT_EQ((*taken)[1].job.settings.seed, 2u);
  EXPECT_NE((*taken)[0].job.scene, (*taken)[1].job.scene);
  const auto alone =
      admit({"mesh.xml", with_mesh("mesh.002.ply"), {{"mesh.002.ply", (*taken)[1].job.assets[0].digest}}, {}},
            coordinator->blobs(), scenes_in_this_process());
  ASSERT_TRUE(alone);
  EXPECT_EQ(alone->job.scene, (*taken)[1].job.scene) << "a frame is the scene that names its file";
}

TEST(Sequence, FrameNumberMayMoveObjects) {
  auto coordinator = open_at({});
  std::string text = kSceneText;
  text.replace(text.find("<shape type=\"sphere\"/>"), 22,
               "<shape type=\"sphere\"><float name=\"radius\" value=\"$frame\"/></shape>");
  SubmitRequest request{"s.xml", text, {}, frames(1, 2)};
  const auto taken = admit_sequence(request, coordinator->blobs(), scenes_in_this_process());
  ASSERT_TRUE(taken) << taken.error().error.message;
  EXPECT_NE((*taken)[0].job.scene, (*taken)[1].job.scene);
  EXPECT_TRUE((*taken)[0].job.warnings.empty());

  request.scene_text = kSceneText;
  const auto still = admit_sequence(request, coordinator->blobs(), scenes_in_this_process());
  ASSERT_TRUE(still);
  ASSERT_EQ((*still)[0].job.warnings.size(), 1u);
  EXPECT_NE((*still)[0].job.warnings[0].find("the same scene"), std::string::npos);
}

TEST(Sequence, MissingFileIsRefusedWithItsFrame) {
  auto coordinator = open_at({});
  const auto refused = coordinator->submit(meshes(*coordinator, {1, 3, 5}, frames(1, 5)));
  ASSERT_FALSE(refused);
  const auto& found = refused.error().diagnostics;
  ASSERT_EQ(found.size(), 2u) << format_diagnostics(found);
  EXPECT_NE(found[0].text.find("frame 2: \"mesh.002.ply\""), std::string::npos) << found[0].text;
  EXPECT_NE(found[1].text.find("frame 4: \"mesh.004.ply\""), std::string::npos) << found[1].text;
  EXPECT_GT(found[0].place.line, 0);
  EXPECT_TRUE(coordinator->jobs().empty());

  const auto none = coordinator->submit(meshes(*coordinator, {}, frames(1, 9000)));
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().diagnostics.size(), 20u);

  const auto broken = coordinator->submit(
      {"s.xml", "<scene version=\"3.0.0\"><shape type=\"spere\"/></scene>", {}, frames(1, 9000)});
  ASSERT_FALSE(broken);
  for (const Diagnostic& d : broken.error().diagnostics)
    EXPECT_EQ(d.text.find("frame"), std::string::npos) << "every frame has it: " << d.text;
}

TEST(Sequence, TotalOfAllFramesIsLimited) {
  auto coordinator = open_at({});
  JobSpec spec = frames(1, 10'000);
  spec.size = FrameSize{8192, 8192};  // 65536 tiles each
  const auto tiles = coordinator->submit({"s.xml", kSceneText, {}, spec});
  ASSERT_FALSE(tiles);
  EXPECT_NE(tiles.error().error.message.find("tiles"), std::string::npos) << tiles.error().error.message;
  const auto text =
      coordinator->submit({"s.xml", std::string(100'000, ' ') + kSceneText, {}, frames(1, 10'000)});
  ASSERT_FALSE(text);
  EXPECT_NE(text.error().error.message.find("scene text"), std::string::npos) << text.error().error.message;
}

TEST(Sequence, EventsCoverTheSequenceAndItsFrames) {
  auto coordinator = open_at({});
  const JobId id = submit(*coordinator, frames(1, 2));
  std::mutex mutex;
  std::condition_variable told_more;
  std::map<std::string, int> told;
  nlohmann::json last;
  const auto handle = coordinator->subscribe(0, [&](const StreamEvent& e) {
    const std::lock_guard lock(mutex);
    if (e.type == "job") ++told[e.job];
    if (e.type == "job" && e.job == id.value) last = nlohmann::json::parse(e.data);
    told_more.notify_all();
  });
  ASSERT_TRUE(finish(*coordinator, id));

  std::unique_lock lock(mutex);
  ASSERT_TRUE(told_more.wait_for(lock, std::chrono::minutes(2),
                                 [&] { return last.is_object() && last["state"] == "done"; }));
  EXPECT_EQ(last["frames"]["done"], 2);
  EXPECT_FALSE(last["frames"].contains("list"));
  EXPECT_GT(told[frame_job(id, 1).value], 0);
  EXPECT_GT(told[frame_job(id, 2).value], 0);
}

}  // namespace
}  // namespace ls::coordinator

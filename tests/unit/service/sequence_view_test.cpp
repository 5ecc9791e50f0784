// The figures of a sequence, computed from those of its frames.
#include <gtest/gtest.h>

#include <cmath>

#include "coordinator/service/state/job_views.h"

namespace ls::coordinator {
namespace {

JobView frame(std::uint32_t number, JobState state) {
  JobView v;
  v.id = frame_job({"j-1"}, number);
  v.state = state;
  v.size = {10, 10};
  v.units_total = 10;
  return v;
}

std::vector<JobView> with(std::initializer_list<JobState> states) {
  std::vector<JobView> all;
  for (const JobState s : states) all.push_back(frame(static_cast<std::uint32_t>(all.size() + 1), s));
  return all;
}

JobView whole(const std::vector<JobView>& frames, double cores = 0) {
  return sequence_view({{"j-1"}, {1, static_cast<std::uint32_t>(frames.size()), 1}, {}, 12, cores, 1},
                       frames);
}

TEST(SequenceView, CombinesTheStatesOfItsFrames) {
  using S = JobState;
  struct Row {
    std::initializer_list<S> frames;
    S expected;
  };
  const Row rows[] = {
      {{S::queued, S::queued}, S::queued},     {{S::running, S::queued}, S::running},
      {{S::done, S::queued}, S::running},      {{S::done, S::paused}, S::paused},
      {{S::paused, S::queued}, S::queued},     {{S::running, S::paused}, S::running},
      {{S::done, S::done}, S::done},           {{S::done, S::failed}, S::failed},
      {{S::cancelled, S::failed}, S::failed},  {{S::done, S::cancelled}, S::cancelled},
      {{S::failed, S::running}, S::running},   {{S::failed, S::paused}, S::paused},
      {{S::cancelled, S::queued}, S::running},
  };
  for (const Row& row : rows) EXPECT_EQ(sequence_state(with(row.frames)), row.expected) << &row - rows;
}

TEST(SequenceView, PointsToTheMostInterestingFrame) {
  using S = JobState;
  EXPECT_EQ(whole(with({S::queued, S::queued})).frames->current, 1u);
  EXPECT_EQ(whole(with({S::done, S::running, S::running})).frames->current, 2u);
  auto ended = with({S::done, S::done, S::cancelled});
  ended[0].units_done = ended[1].units_done = 10;
  EXPECT_EQ(whole(ended).frames->current, 2u);
}

TEST(SequenceView, CombinesFramesByTheirPixels) {
  auto frames = with({JobState::done, JobState::running});
  frames[0].size = {10, 30};
  frames[0].spp_done = 16, frames[0].progress = 1, frames[0].units_done = 10, frames[0].core_seconds = 3;
  frames[0].health.add(HealthCause::infinite, 2, {1, 2, 3});
  frames[1].spp_done = 8, frames[1].progress = .5, frames[1].units_done = 4, frames[1].core_seconds = 1;

  const JobView v = whole(frames);

  EXPECT_EQ(v.spp_done, (3 * 16 + 8) / 4.);
  EXPECT_EQ(v.progress, (3 * 1 + .5) / 4);
  EXPECT_EQ(v.units_done, 14u);
  EXPECT_EQ(v.units_total, 20u);
  EXPECT_EQ(v.core_seconds, 4);
  EXPECT_EQ(v.health.nonfinite, 2u);
  EXPECT_EQ(v.elapsed_seconds, 12);
}

// Two frames of one size have relMSE 2 with the interval [1, 5], and 4 with [4, 8]. Their mean is 3. The
// errors are independent, so each end of the mean's interval is half the root of the sum of squares away:
// sqrt(3^2 + 4^2) / 2 = 5/2 above, sqrt(1^2 + 0^2) / 2 = 1/2 below.
TEST(SequenceView, ErrorIsTheMeanOfItsFramesWithTheIntervalOfIndependentEstimates) {
  auto frames = with({JobState::done, JobState::done, JobState::queued});
  frames[0].error_now = ErrorFigures{3, 2, 1, 5};
  frames[1].error_now = ErrorFigures{4, 4, 4, 8};

  const auto e = whole(frames).error_now;

  ASSERT_TRUE(e);
  EXPECT_DOUBLE_EQ(e->relmse, 3);
  EXPECT_DOUBLE_EQ(e->relmse_hi, 5.5);
  EXPECT_DOUBLE_EQ(e->relmse_lo, 2.5);
  EXPECT_DOUBLE_EQ(e->rmse, std::sqrt((9 + 16) / 2.));
  EXPECT_FALSE(whole(with({JobState::queued})).error_now);
}

TEST(SequenceView, IsUntrustedIfAFrameIs) {
  auto frames = with({JobState::done, JobState::done, JobState::queued});
  frames[0].convergence_status = ConvergenceStatus{ConvergenceStatus::Kind::converging, "as expected", true};
  EXPECT_TRUE(whole(frames).convergence_status->trusted);
  frames[0].few_hits = 2, frames[1].few_hits = 3;
  frames[1].convergence_status =
      ConvergenceStatus{ConvergenceStatus::Kind::heavy_tail, "don't trust yet", false};

  const JobView v = whole(frames);

  EXPECT_FALSE(v.convergence_status->trusted);
  EXPECT_EQ(v.convergence_status->kind, ConvergenceStatus::Kind::heavy_tail);
  EXPECT_TRUE(v.convergence_status->words.ends_with(": don't trust yet")) << v.convergence_status->words;
  EXPECT_EQ(v.few_hits, 5u);
}

TEST(SequenceView, PredictsThatWaitingFramesCostLikeOthers) {
  auto frames = with({JobState::done, JobState::running, JobState::queued, JobState::cancelled});
  frames[0].progress = 1, frames[0].units_done = 10, frames[0].core_seconds = 40;
  frames[1].progress = .5, frames[1].units_done = 5, frames[1].core_seconds = 20;
  frames[1].queued_core_seconds = 7;

  const JobView v = whole(frames, 4);

  // 60 core seconds were spent on 1.5 frames: 40 per frame. 1.5 frames are left, on 4 threads.
  EXPECT_DOUBLE_EQ(v.eta_seconds.value(), 15);
  EXPECT_DOUBLE_EQ(v.queued_core_seconds, 47);
  EXPECT_FALSE(whole(frames, 0).eta_seconds);
}

TEST(SequenceView, EtaUsesOnlyCoresThatItsLimitsAndUnitsKeepBusy) {
  auto frames = with({JobState::done, JobState::queued});
  frames[0].progress = 1, frames[0].units_done = 10, frames[0].core_seconds = 40;
  const auto eta = [&](double cores, int workers) {
    SequenceFacts facts{{"j-1"}, {1, 2, 1}, {}, 12, cores, workers};
    return sequence_view(facts, frames).eta_seconds.value();
  };

  EXPECT_DOUBLE_EQ(eta(8, 4), 5);
  EXPECT_DOUBLE_EQ(eta(1000, 4), 4) << "ten units are left";
  frames[0].max_workers = 1;  // the limits of a sequence are those of its first frame
  EXPECT_DOUBLE_EQ(eta(8, 4), 20);
  frames[0].max_units = 1;
  EXPECT_DOUBLE_EQ(eta(8, 4), 40);
}

// Frames that render in no time, but that each worker must load for a while.
TEST(SequenceView, EtaIncludesLoadingOfWaitingFrames) {
  auto frames =
      with({JobState::done, JobState::running, JobState::queued, JobState::queued, JobState::queued});
  frames[0].progress = 1, frames[0].units_done = 10, frames[0].core_seconds = .01;
  frames[0].time.load = .1, frames[0].time.build = .3;
  frames[1].progress = .5, frames[1].units_done = 5, frames[1].core_seconds = .005;
  frames[1].time.load = .1, frames[1].time.build = .3;
  const auto view = [&](double cores, int workers, double frame_seconds = 0) {
    SequenceFacts facts{{"j-1"}, {1, 5, 1}, {}, 12, cores, workers, frame_seconds};
    return sequence_view(facts, frames);
  };

  // 3.5 frames of .01 core seconds are left, and three of them are to be loaded, for .4 s each.
  EXPECT_DOUBLE_EQ(view(4, 1).eta_seconds.value(), .035 / 4 + 1.2);
  EXPECT_DOUBLE_EQ(view(8, 2).eta_seconds.value(), .035 / 8 + .6);
  // A worker that loads keeps its four threads from rendering.
  EXPECT_DOUBLE_EQ(view(8, 2).queued_core_seconds, 3 * (.01 + 4 * .4));
  EXPECT_DOUBLE_EQ(view(8, 2, 2).eta_seconds.value(), 7) << "frames have ended every 2 s";
  frames[0].max_workers = 1;
  EXPECT_DOUBLE_EQ(view(8, 2).eta_seconds.value(), .035 / 4 + 1.2);
}

TEST(SequenceView, NamesAFailedFrameBeforeAWaitingOne) {
  auto frames = with({JobState::queued, JobState::queued, JobState::failed});
  frames[0].error = "no worker is connected";
  EXPECT_EQ(whole(frames).error, "frame 1: no worker is connected");
  frames[2].error = "unit 3 crashed";
  EXPECT_EQ(whole(frames).error, "frame 3: unit 3 crashed");
}

TEST(SequenceView, NamesTheFirstFailedFrameEvenIfAnEarlierFrameIsUnfinished) {
  auto frames = with({JobState::running, JobState::queued, JobState::queued});
  frames[1].error = "job j-0, for which it waits, failed";
  EXPECT_EQ(whole(frames).error, "frame 2: job j-0, for which it waits, failed");
}

}  // namespace
}  // namespace ls::coordinator

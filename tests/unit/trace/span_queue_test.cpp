#include "util/trace/span_queue.h"

#include <gtest/gtest.h>

namespace ls::trace {
namespace {

TimePoint at(double s) { return TimePoint(from_seconds(s)); }

SpanQueue with(std::size_t spans) {
  SpanQueue queue;
  for (std::size_t i = 0; i < spans; ++i) queue.add(Span{.start_ns = static_cast<std::int64_t>(i)}, at(0));
  return queue;
}

TEST(SpanQueue, CollectsSpansForAMoment) {
  SpanQueue queue = with(2);

  EXPECT_TRUE(queue.due(at(kCollectSeconds / 2)).empty());
  EXPECT_EQ(queue.next_due(), at(kCollectSeconds));
  EXPECT_EQ(queue.due(at(kCollectSeconds)).size(), 2u);
  queue.taken(0);
  EXPECT_EQ(queue.next_due(), std::nullopt);
  EXPECT_EQ(queue.figures().sent, 2u);
}

TEST(SpanQueue, FullBatchIsSentAtOnce) {
  SpanQueue queue = with(kMaxBatch + 3);

  EXPECT_EQ(queue.due(at(0)).size(), kMaxBatch);
  EXPECT_EQ(queue.due(at(0)).front().start_ns, 0);
  queue.taken(0);
  EXPECT_TRUE(queue.due(at(0)).empty()) << "the rest collects";
}

TEST(SpanQueue, IsBoundedAndCountsDroppedSpans) {
  SpanQueue queue = with(kMaxWaiting + 5);

  EXPECT_EQ(queue.figures().left_out, 5u);
}

TEST(SpanQueue, RetriesWithGrowingPausesAndThenDropsTheBatch) {
  SpanQueue queue = with(2);
  double now = kCollectSeconds, pause = kFirstPauseSeconds;
  for (int i = 1; i < kMaxSendings; ++i, pause *= 2) {
    ASSERT_EQ(queue.due(at(now)).size(), 2u);
    queue.failed(at(now));
    EXPECT_TRUE(queue.due(at(now + pause * .99)).empty());
    now += pause;
  }
  ASSERT_EQ(queue.due(at(now)).size(), 2u);
  queue.failed(at(now));

  EXPECT_TRUE(queue.in_trouble());
  EXPECT_EQ(queue.figures().refused, 2u);
  queue.add({}, at(now));
  EXPECT_TRUE(queue.due(at(now + pause * .99)).empty()) << "a collector that is gone is not asked more often";
  EXPECT_EQ(queue.due(at(now + pause)).size(), 1u);
  queue.taken(0);
  EXPECT_FALSE(queue.in_trouble());
}

TEST(SpanQueue, DoesNotResendRefusedSpans) {
  SpanQueue queue = with(3);
  ASSERT_EQ(queue.due(at(2)).size(), 3u);
  queue.refused();

  EXPECT_EQ(queue.next_due(), std::nullopt);
  EXPECT_EQ(queue.figures().refused, 3u);
}

TEST(SpanQueue, RefusedBatchesDoNotCountAsAttemptsToSendTheNextOne) {
  SpanQueue queue;
  for (int i = 1; i < kMaxSendings; ++i) {
    queue.add({}, at(0));
    ASSERT_EQ(queue.due(at(2)).size(), 1u);
    queue.refused();
    EXPECT_TRUE(queue.in_trouble());
  }
  queue.add({}, at(2));
  ASSERT_EQ(queue.due(at(4)).size(), 1u);
  queue.failed(at(4));

  EXPECT_EQ(queue.figures().refused, kMaxSendings - 1u);
  EXPECT_EQ(queue.due(at(4 + kFirstPauseSeconds)).size(), 1u) << "it is sent again";
}

TEST(SpanQueue, IgnoresImpossibleRejectionCounts) {
  SpanQueue queue = with(3);
  ASSERT_EQ(queue.due(at(2)).size(), 3u);
  queue.taken(1'000'000);

  EXPECT_EQ(queue.figures().refused, 3u);
  EXPECT_EQ(queue.figures().sent, 0u);
}

TEST(SpanQueue, EverythingIsSentAtTheEnd) {
  SpanQueue queue = with(2);
  queue.hurry();

  EXPECT_EQ(queue.due(at(0)).size(), 2u);
}

}  // namespace
}  // namespace ls::trace

#include <gtest/gtest.h>

#include "coordinator/webhooks/webhook_outbox.h"

namespace ls::coordinator::webhooks {
namespace {

Delivery delivery(std::uint64_t number) { return {number, "id", "job.done", "{}"}; }
TimePoint at(double s) { return TimePoint{} + from_seconds(s); }

TEST(WebhookLine, DeliversInOrder) {
  Line line;
  line.add(delivery(1));
  line.add(delivery(2));

  ASSERT_NE(line.due(at(0)), nullptr);
  EXPECT_EQ(line.due(at(0))->number, 1u);
  EXPECT_EQ(line.taken()->number, 1u);
  EXPECT_EQ(line.due(at(0))->number, 2u);
  EXPECT_EQ(line.taken()->number, 2u);
  EXPECT_EQ(line.due(at(0)), nullptr);
  EXPECT_FALSE(line.next_due());
}

TEST(WebhookLine, WaitsLongerAfterEachFailureAndDelaysLaterEvents) {
  Line line;
  line.add(delivery(1));
  line.add(delivery(2));

  EXPECT_FALSE(line.failed(at(100)));

  EXPECT_EQ(line.due(at(100.9)), nullptr) << "one second is to be waited";
  EXPECT_EQ(line.next_due(), at(101));
  ASSERT_NE(line.due(at(101)), nullptr);
  EXPECT_EQ(line.due(at(101))->number, 1u) << "the first one stays first";
  EXPECT_FALSE(line.failed(at(101)));
  EXPECT_EQ(line.next_due(), at(103));
  line.taken();
  EXPECT_EQ(line.due(at(101))->number, 2u) << "the next one's patience is its own";
}

TEST(WebhookLine, WaitsFiveMinutesAtMost) {
  EXPECT_EQ(retry_seconds(1), 1);
  EXPECT_EQ(retry_seconds(2), 2);
  EXPECT_EQ(retry_seconds(9), 256);
  EXPECT_EQ(retry_seconds(10), 300);
  EXPECT_EQ(retry_seconds(1000), 300);
}

TEST(WebhookLine, GivesUpAfterTwentyAttempts) {
  Line line;
  line.add(delivery(1));
  line.add(delivery(2));
  double now = 0;
  for (int attempt = 1; attempt < kMaxAttempts; ++attempt) {
    ASSERT_NE(line.due(at(now)), nullptr);
    ASSERT_FALSE(line.failed(at(now))) << attempt;
    now += retry_seconds(attempt);
  }

  const auto over = line.failed(at(now));

  ASSERT_TRUE(over);
  EXPECT_EQ(over->number, 1u);
  EXPECT_EQ(line.due(at(now))->number, 2u);
}

TEST(WebhookLine, DropsTheOldestIfTooManyWait) {
  Line line;
  for (std::uint64_t n = 1; n <= kMaxWaiting; ++n) ASSERT_FALSE(line.add(delivery(n)));

  const auto over = line.add(delivery(kMaxWaiting + 1));

  ASSERT_TRUE(over);
  EXPECT_EQ(over->number, 1u);
  EXPECT_EQ(line.waiting(), kMaxWaiting);
}

}  // namespace
}  // namespace ls::coordinator::webhooks

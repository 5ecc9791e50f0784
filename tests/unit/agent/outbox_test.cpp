#include "worker/agent/result_outbox.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worker/agent/backoff.h"

namespace ls::worker {
namespace {

UnitResult result(TileIndex tile) {
  UnitResult r;
  r.unit = {JobId{"j"}, tile, 0};
  r.exr.resize(100);
  return r;
}
UnitFailure failure(TileIndex tile) {
  UnitFailure f;
  f.unit = {JobId{"j"}, tile, 0};
  return f;
}

TEST(Outbox, SendsEachOnceUntilTheConnectionIsLost) {
  Outbox outbox;
  outbox.add(result(0));

  EXPECT_EQ(outbox.take_unsent().size(), 1U);
  EXPECT_EQ(outbox.take_unsent().size(), 0U);
  outbox.connection_lost();
  outbox.add(result(1));
  EXPECT_THAT(outbox.take_unsent(), testing::ElementsAre(FromWorker{result(0)}, FromWorker{result(1)}));
}

TEST(Outbox, ForgetsWhatIsAcknowledgedAndItsBytes) {
  Outbox outbox;
  outbox.add(result(0));
  outbox.take_unsent();

  EXPECT_TRUE(outbox.acknowledge({JobId{"j"}, 0, 0}));
  EXPECT_FALSE(outbox.acknowledge({JobId{"j"}, 0, 0}));
  EXPECT_TRUE(outbox.empty());
  EXPECT_EQ(outbox.bytes(), 0U);
}

TEST(Outbox, AcknowledgesTheFailureBeforeTheResultOfTheSecondTry) {
  Outbox outbox;
  outbox.add(failure(0));
  outbox.take_unsent();
  outbox.add(result(0));

  outbox.acknowledge({JobId{"j"}, 0, 0});

  EXPECT_TRUE(outbox.has_result({JobId{"j"}, 0, 0}));
  EXPECT_THAT(outbox.take_unsent(), testing::ElementsAre(FromWorker{result(0)}));
}

TEST(Outbox, DropsAJobWithItsBytes) {
  Outbox outbox;
  outbox.add(result(0));
  outbox.add(failure(1));

  outbox.drop_job(JobId{"j"});

  EXPECT_EQ(outbox.bytes(), 0U);
  EXPECT_TRUE(outbox.take_unsent().empty());
}

TEST(Backoff, DoublesUpToItsLimitWithinItsJitterAndStartsAgain) {
  Backoff backoff(std::chrono::milliseconds(100), std::chrono::seconds(1), 42);
  for (const int whole_ms : {100, 200, 400, 800, 1000, 1000}) {
    const Duration pause = backoff.next();
    EXPECT_LE(pause, std::chrono::milliseconds(whole_ms));
    EXPECT_GE(pause, std::chrono::milliseconds(whole_ms) / 2);
  }
  for (int i = 0; i < 100; ++i) EXPECT_LE(backoff.next(), std::chrono::seconds(1));
  backoff.reset();
  EXPECT_LE(backoff.next(), std::chrono::milliseconds(100));
}

}  // namespace
}  // namespace ls::worker

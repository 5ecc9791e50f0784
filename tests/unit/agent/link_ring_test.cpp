#include "worker/agent/link_ring.h"

#include <gtest/gtest.h>

namespace ls::worker {
namespace {

struct FakeLink final : CoordinatorLink {
  std::shared_ptr<LinkObserver> observer;
  int connected = 0, closed = 0, sent = 0;
  Result<void> connect(const WorkerHello&, std::shared_ptr<LinkObserver> o) override {
    observer = std::move(o);
    ++connected;
    return {};
  }
  void send(FromWorker) override { ++sent; }
  void close() override { ++closed; }
  Result<void> fetch_blob(const BlobRequest&, const BlobSink&) override { return {}; }
};

struct FakeAgent final : LinkObserver {
  int received_ = 0, lost_ = 0;
  void received(ToWorker) override { ++received_; }
  void lost(Error) override { ++lost_; }
};

struct Ring : ::testing::Test {
  FakeLink *a = new FakeLink, *b = new FakeLink;
  std::shared_ptr<FakeAgent> agent = std::make_shared<FakeAgent>();
  LinkRing ring{make(a, b), 0};

  static std::vector<std::unique_ptr<CoordinatorLink>> make(FakeLink* a, FakeLink* b) {
    std::vector<std::unique_ptr<CoordinatorLink>> links;
    links.emplace_back(a);
    links.emplace_back(b);
    return links;
  }
  void connect() { EXPECT_TRUE(ring.connect({}, agent)); }
  static WorkerProgress busy() {
    WorkerProgress p;
    p.leases.push_back({LeaseId{"l1"}, 0});
    return p;
  }
};

TEST_F(Ring, ContinuesWithTheNextIfOneDoesNotWelcomeIt) {
  connect();
  EXPECT_EQ(a->connected, 1);
  a->observer->lost({Errc::unavailable, "refused"});
  connect();

  EXPECT_EQ(b->connected, 1);
  EXPECT_EQ(agent->lost_, 1);
}

TEST_F(Ring, RetriesTheSameCoordinatorAfterAGoodStreamAndThenTheNext) {
  connect();
  a->observer->received(Welcome{});
  a->observer->lost({Errc::unavailable, "killed"});
  connect();
  EXPECT_EQ(a->connected, 2);

  a->observer->lost({Errc::unavailable, "still away"});
  connect();
  EXPECT_EQ(b->connected, 1);
}

TEST_F(Ring, IdleWorkerMovesOnAfterItsReportsAndNotifiesTheAgentOnce) {
  connect();
  a->observer->received(Welcome{});
  for (int i = 0; i < kIdleReports; ++i) {
    EXPECT_EQ(agent->lost_, 0);
    ring.send(WorkerProgress{});
  }
  EXPECT_EQ(agent->lost_, 1);
  EXPECT_EQ(a->closed, 1);
  a->observer->lost({Errc::unavailable, "the stream's own end"});
  EXPECT_EQ(agent->lost_, 1);

  connect();
  EXPECT_EQ(b->connected, 1);
}

TEST_F(Ring, WorkerWithWorkOrUnacknowledgedResultsStays) {
  connect();
  a->observer->received(Welcome{});
  ring.send(UnitResult{});
  for (int i = 0; i < 5 * kIdleReports; ++i) ring.send(WorkerProgress{});
  EXPECT_EQ(agent->lost_, 0) << "a result waits";

  a->observer->received(ResultAck{});
  for (int i = 0; i < 5 * kIdleReports; ++i) {
    ring.send(WorkerProgress{});
    ring.send(busy());
  }
  EXPECT_EQ(agent->lost_, 0) << "there is work";

  for (int i = 1; i < kIdleReports; ++i) ring.send(WorkerProgress{});
  a->observer->received(AssignLease{});
  for (int i = 1; i < kIdleReports; ++i) ring.send(WorkerProgress{});
  EXPECT_EQ(agent->lost_, 0) << "work came";

  ring.send(WorkerDraining{});
  for (int i = 0; i < 5 * kIdleReports; ++i) ring.send(WorkerProgress{});
  EXPECT_EQ(agent->lost_, 0) << "it is going anyway";
}

}  // namespace
}  // namespace ls::worker

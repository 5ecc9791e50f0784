#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mutex>
#include <string>
#include <vector>

#include "cli/local/local_farm.h"
#include "coordinator/store/blobs/memory_blobs.h"

namespace ls::cli {
namespace {

struct Recorder final : worker::LinkObserver {
  void received(ToWorker message) override {
    const std::lock_guard lock(mutex);
    messages.push_back(std::move(message));
  }
  void lost(Error why) override {
    const std::lock_guard lock(mutex);
    losses.push_back(std::move(why));
  }
  std::mutex mutex;
  std::vector<ToWorker> messages;
  std::vector<Error> losses;
};

class LocalLinkTest : public testing::Test {
 protected:
  void SetUp() override {
    coordinator::Coordinator::Options options;
    options.blobs = blobs_;
    auto opened = coordinator::Coordinator::open(std::move(options));
    ASSERT_TRUE(opened);
    coordinator_ = std::move(*opened);
  }
  static WorkerHello hello() {
    WorkerHello h;
    h.name = "here";
    return h;
  }
  std::shared_ptr<coordinator::MemoryBlobs> blobs_ = std::make_shared<coordinator::MemoryBlobs>();
  std::unique_ptr<coordinator::Coordinator> coordinator_;
  std::shared_ptr<Recorder> observer_ = std::make_shared<Recorder>();
};

TEST_F(LocalLinkTest, IsWelcomedAndLeaves) {
  LocalLink link(*coordinator_);

  ASSERT_TRUE(link.connect(hello(), observer_));

  ASSERT_EQ(observer_->messages.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<Welcome>(observer_->messages[0]));
  ASSERT_EQ(coordinator_->workers().size(), 1u);
  EXPECT_EQ(coordinator_->workers()[0].state, "connected");
  link.close();
  EXPECT_EQ(coordinator_->workers()[0].state, "lost");
}

TEST_F(LocalLinkTest, ForwardsARefusal) {
  LocalLink link(*coordinator_);
  WorkerHello other = hello();
  other.protocol = kProtocolVersion + 1;

  EXPECT_EQ(link.connect(other, observer_).error().code, Errc::failed_precondition);
}

TEST_F(LocalLinkTest, DropsWhatIsSentWithoutAConnection) {
  int seen = 0;
  LocalLink link(*coordinator_, [&](const UnitResult&) { ++seen; });

  link.send(UnitResult{});

  EXPECT_EQ(seen, 0);
}

TEST_F(LocalLinkTest, PassesResultsToTheTapBeforeTheCoordinator) {
  std::vector<UnitKey> seen;
  LocalLink link(*coordinator_, [&](const UnitResult& r) { seen.push_back(r.unit); });
  ASSERT_TRUE(link.connect(hello(), observer_));
  UnitResult result;
  result.unit = {JobId{"j-none"}, 3, 4};

  link.send(result);

  EXPECT_EQ(seen, std::vector<UnitKey>{result.unit});
  link.close();
}

TEST_F(LocalLinkTest, FetchesBlobsFromAnOffset) {
  LocalLink link(*coordinator_);
  const std::string text(700'000, 'x');  // several chunks
  ASSERT_TRUE(coordinator_->blobs().put(sha256(text), std::as_bytes(std::span(text))));
  std::size_t got = 0;

  const auto fetched =
      link.fetch_blob({sha256(text), 5}, [&](std::span<const std::byte> bytes) -> Result<void> {
        got += bytes.size();
        return {};
      });

  EXPECT_TRUE(fetched);
  EXPECT_EQ(got, text.size() - 5);
  EXPECT_EQ(link.fetch_blob({sha256(text)}, [](auto) { return fail(Errc::resource_exhausted, "full"); })
                .error()
                .message,
            "full");
  EXPECT_FALSE(link.fetch_blob({sha256("absent")}, [](auto) -> Result<void> { return {}; }));
}

}  // namespace
}  // namespace ls::cli

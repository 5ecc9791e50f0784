// Which transfers of blobs to workers are taken, and which are ended.
#include "coordinator/rpc/fetch_table.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace ls::coordinator::rpc {
namespace {

using namespace std::chrono_literals;

class Transfers : public testing::Test {
 protected:
  static FetchTable::Limits limits() {
    FetchTable::Limits small;
    small.all = 8;
    small.of_connection = 4;
    small.crowded = 6;
    small.of_group = 5;
    return small;
  }
  bool taken(FetchTable::Id id, const std::string& peer, const std::string& address) {
    return table_.arrive(id, peer, address, now_).taken;
  }

  FetchTable table_{limits()};
  TimePoint now_{1h};
};

TEST_F(Transfers, TransfersPerConnectionAreLimited) {
  for (FetchTable::Id id = 1; id <= 4; ++id) EXPECT_TRUE(taken(id, "peer", "a"));
  EXPECT_FALSE(taken(5, "peer", "a"));
  EXPECT_TRUE(taken(6, "another", "a"));
  table_.gone(1);
  EXPECT_TRUE(taken(7, "peer", "a"));
}

TEST_F(Transfers, UnreadChunkEndsTheTransferAfterHalfAMinute) {
  ASSERT_TRUE(taken(1, "peer", "a"));
  ASSERT_TRUE(taken(2, "peer", "a"));
  ASSERT_TRUE(taken(3, "peer", "a"));
  table_.waits(1, now_);
  table_.waits(2, now_);
  now_ += 30s - 1ns;
  EXPECT_TRUE(table_.stalled(now_).empty());
  table_.taken(2);

  now_ += 1ns;

  EXPECT_EQ(table_.stalled(now_), std::vector<FetchTable::Id>{1})
      << "the third waits for the coordinator, which may have to fetch the blob itself";
}

TEST_F(Transfers, LongestWaitingTransferMakesRoom) {
  for (FetchTable::Id id = 1; id <= 8; ++id) {
    ASSERT_TRUE(taken(id, fmt::format("peer {}", id), fmt::format("address {}", id)));
    table_.waits(id, now_ + id * 1ms);
  }
  now_ += 1s;
  EXPECT_FALSE(taken(9, "peer 9", "address 9")) << "each may be taken soon";

  now_ += 1ms;
  const auto admission = table_.arrive(10, "peer 10", "address 10", now_);

  EXPECT_TRUE(admission.taken);
  EXPECT_EQ(admission.ended, FetchTable::Id{1});
  EXPECT_FALSE(taken(11, "peer 11", "address 11")) << "the next one has not waited for a second";
}

TEST_F(Transfers, OneAddressCannotTakeTheLastPlaces) {
  for (FetchTable::Id id = 1; id <= 6; ++id) EXPECT_TRUE(taken(id, fmt::format("peer {}", id), "greedy"));
  EXPECT_FALSE(taken(7, "peer 7", "greedy"));
  EXPECT_TRUE(taken(8, "peer 8", "another"));
  EXPECT_TRUE(taken(9, "peer 9", "another"));
}

}  // namespace
}  // namespace ls::coordinator::rpc

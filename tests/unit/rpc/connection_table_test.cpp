// Which connections to the workers' port are admitted, and which are closed.
#include "coordinator/rpc/connection_table.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace ls::coordinator::rpc {
namespace {

using namespace std::chrono_literals;

// A table with small limits, and connections that are named by numbers.
class Connections : public testing::Test {
 protected:
  static ConnectionTable::Limits limits() {
    ConnectionTable::Limits small;
    small.connections = 100;
    small.unmet = 8;
    small.unmet_of_group = 4;
    small.unmet_calls = 2;
    small.bytes = 1000;
    small.long_bytes = 5000;
    small.long_hellos = 3;
    small.long_hellos_of_group = 2;
    return small;
  }
  static std::string peer(ConnectionTable::Id id) { return fmt::format("peer {}", id); }
  ConnectionTable::Admission arrive(ConnectionTable::Id id, const std::string& address) {
    return table_.arrive(id, {peer(id), address}, now_);
  }
  bool taken(ConnectionTable::Id id, const std::string& address) { return !arrive(id, address).refused; }
  // A connection on which a call has begun, and the hello is on its way
  void begin_hello(ConnectionTable::Id id, const std::string& address) {
    ASSERT_TRUE(taken(id, address));
    ASSERT_TRUE(table_.call_began(peer(id), now_).guest);
  }
  void say_hello(ConnectionTable::Id id) {
    ASSERT_TRUE(table_.call_began(peer(id), now_).guest);
    table_.call_met(peer(id));
  }

  ConnectionTable table_{limits()};
  TimePoint now_{1h};
};

TEST_F(Connections, OneAddressHasAShareOfThePlacesBeforeTheHello) {
  for (ConnectionTable::Id id = 1; id <= 4; ++id) EXPECT_TRUE(taken(id, "a"));

  EXPECT_EQ(arrive(5, "a").refused, Closed::many_unmet);
  EXPECT_TRUE(taken(6, "b"));
}

TEST_F(Connections, AnyNumberOfWorkersOfOneAddressMayStayAfterTheirHello) {
  for (ConnectionTable::Id id = 1; id <= 100; ++id) {
    ASSERT_TRUE(taken(id, "behind one router")) << id;
    say_hello(id);
  }

  EXPECT_EQ(arrive(101, "behind one router").refused, Closed::full);
}

TEST_F(Connections, SilentConnectionIsClosedAfterFiveSeconds) {
  ASSERT_TRUE(taken(1, "a"));
  ASSERT_TRUE(taken(2, "a"));
  say_hello(2);
  now_ += 5s - 1ns;
  EXPECT_TRUE(table_.overdue(now_).empty());

  now_ += 1ns;

  EXPECT_EQ(table_.overdue(now_), std::vector<ConnectionTable::Id>{1});
  EXPECT_TRUE(table_.overdue(now_).empty()) << "once is enough";
  EXPECT_EQ(table_.closed(Closed::silent), 1u);
}

TEST_F(Connections, ConnectionIsUnmetAgainAfterItsWorkerLeaves) {
  ASSERT_TRUE(taken(1, "a"));
  say_hello(1);
  now_ += 1h;
  EXPECT_TRUE(table_.overdue(now_).empty());

  table_.call_ended(peer(1), true, now_);

  now_ += 5s;
  EXPECT_EQ(table_.overdue(now_), std::vector<ConnectionTable::Id>{1});
}

TEST_F(Connections, ConnectionIsKnownOnceOneCallShowedTheToken) {
  ASSERT_TRUE(taken(1, "a"));
  ASSERT_TRUE(table_.call_began(peer(1), now_).guest);
  ASSERT_TRUE(table_.call_began(peer(1), now_).guest);
  EXPECT_EQ(table_.call_met(peer(1)), ConnectionTable::Id{1});
  EXPECT_EQ(table_.call_met(peer(1)), std::nullopt) << "it was met before";

  table_.call_ended(peer(1), true, now_);

  EXPECT_TRUE(table_.unmet().empty());
}

// Places that are held for long go to new connections, so that an address that is used by strangers and
// workers, or all addresses together, cannot be held by the strangers.
TEST_F(Connections, OldestUnmetConnectionMakesRoom) {
  for (ConnectionTable::Id id = 1; id <= 4; ++id) ASSERT_TRUE(taken(id, "a"));
  now_ += 2s - 1ns;
  EXPECT_EQ(arrive(5, "a").refused, Closed::many_unmet) << "a worker may take so long to say hello";

  now_ += 1ns;
  const auto admission = arrive(6, "a");

  EXPECT_FALSE(admission.refused);
  EXPECT_EQ(admission.closed, ConnectionTable::Id{1});
  EXPECT_EQ(table_.closed(Closed::made_room), 1u);
}

TEST_F(Connections, AddressWithManyConnectionsMakesRoomForOthers) {
  for (ConnectionTable::Id id = 1; id <= 4; ++id) ASSERT_TRUE(taken(id, "a"));
  for (ConnectionTable::Id id = 5; id <= 8; ++id) ASSERT_TRUE(taken(id, "b"));

  const auto admission = arrive(9, "c");

  EXPECT_FALSE(admission.refused);
  EXPECT_EQ(admission.closed, ConnectionTable::Id{4}) << "the newest of the first that has the most";
  EXPECT_EQ(arrive(10, "c").closed, ConnectionTable::Id{8}) << "b has more than a now";
  EXPECT_EQ(arrive(11, "c").refused, Closed::many_unmet) << "a and b have 3, c has 2: places would go round";
}

TEST_F(Connections, ClosedConnectionsFreeTheirPlaces) {
  for (int round = 0; round < 100; ++round) {
    for (ConnectionTable::Id id = 1; id <= 4; ++id) ASSERT_TRUE(taken(id, "a")) << round;
    for (ConnectionTable::Id id = 1; id <= 4; ++id) table_.gone(id);
  }
  EXPECT_EQ(table_.size(), 0u);
}

TEST_F(Connections, TooManyCallsBeforeTheHelloCloseTheConnectionAndBlockItsAddress) {
  ASSERT_TRUE(taken(1, "a"));
  EXPECT_TRUE(table_.call_began(peer(1), now_).guest);
  EXPECT_TRUE(table_.call_began(peer(1), now_).guest);

  const auto third = table_.call_began(peer(1), now_);

  EXPECT_FALSE(third.guest);
  EXPECT_EQ(third.closed, ConnectionTable::Id{1});
  EXPECT_FALSE(table_.call_began(peer(1), now_).guest) << "nor any other call on it";
  EXPECT_EQ(arrive(2, "a").refused, Closed::shut_out);
  EXPECT_TRUE(taken(3, "b"));
  now_ += 30s;
  EXPECT_TRUE(taken(4, "a"));
}

TEST_F(Connections, MetConnectionIsNotClosedForManyCalls) {
  ASSERT_TRUE(taken(1, "a"));
  say_hello(1);
  EXPECT_TRUE(table_.call_began(peer(1), now_).guest);
  EXPECT_TRUE(table_.call_began(peer(1), now_).guest);

  const auto one_more = table_.call_began(peer(1), now_);

  EXPECT_FALSE(one_more.guest);
  EXPECT_FALSE(one_more.closed);
}

TEST_F(Connections, BytesBeforeACallAreLimited) {
  ASSERT_TRUE(taken(1, "a"));
  EXPECT_FALSE(table_.received(1, 1000, now_));

  EXPECT_TRUE(table_.received(1, 1001, now_));

  EXPECT_EQ(arrive(2, "a").refused, Closed::shut_out) << "it was a header without an end, not a hello";
}

TEST_F(Connections, EndlessHelloBlocksItsAddress) {
  begin_hello(1, "a");
  EXPECT_FALSE(table_.received(1, 1001, now_));
  now_ += 5s;

  EXPECT_EQ(table_.overdue(now_), std::vector<ConnectionTable::Id>{1});

  EXPECT_EQ(arrive(2, "a").refused, Closed::shut_out);
}

TEST_F(Connections, BytesBeforeAHelloAreLimited) {
  begin_hello(1, "a");
  EXPECT_FALSE(table_.received(1, 1000, now_));
  EXPECT_FALSE(table_.received(1, 5000, now_)) << "a long hello";

  EXPECT_TRUE(table_.received(1, 5001, now_));

  EXPECT_EQ(table_.closed(Closed::many_bytes), 1u);
  EXPECT_EQ(arrive(2, "a").refused, Closed::shut_out);
}

TEST_F(Connections, FewConnectionsAtATimeMaySendALongHello) {
  for (ConnectionTable::Id id = 1; id <= 3; ++id) begin_hello(id, "a");
  EXPECT_FALSE(table_.received(1, 1001, now_));
  EXPECT_FALSE(table_.received(2, 1001, now_));

  EXPECT_TRUE(table_.received(3, 1001, now_));

  begin_hello(4, "a");  // it may try again: it may be a worker
  table_.call_met(peer(1));
  EXPECT_FALSE(table_.received(4, 1001, now_)) << "the place of the first is free";
}

TEST_F(Connections, JoinedWorkerHasNoByteLimit) {
  ASSERT_TRUE(taken(1, "a"));
  say_hello(1);
  EXPECT_FALSE(table_.received(1, 1'000'000, now_));

  table_.call_ended(peer(1), true, now_);

  EXPECT_FALSE(table_.received(1, 1'000'000, now_)) << "these bytes came before";
}

TEST_F(Connections, ReturningPeerIsANewConnection) {
  ASSERT_FALSE(table_.arrive(1, {"peer", "a"}, now_).refused);
  ASSERT_TRUE(table_.call_began("peer", now_).guest);
  table_.call_met("peer");
  ASSERT_FALSE(table_.arrive(2, {"peer", "a"}, now_).refused);

  table_.call_ended("peer", true, now_);  // of the first
  table_.gone(1);

  EXPECT_EQ(table_.unmet(), std::set<ConnectionTable::Id>{2});
  EXPECT_TRUE(table_.call_began("peer", now_).guest);
}

TEST(ConnectionLimits, StrangersHaveAQuarterOfASmallPort) {
  const auto small = ConnectionTable::limits_for(32);
  EXPECT_EQ(small.connections, 32u);
  EXPECT_EQ(small.unmet, 8u);
  EXPECT_EQ(small.unmet_of_group, 4u);

  const auto large = ConnectionTable::limits_for(1'000'000);
  EXPECT_EQ(large.connections, ConnectionTable::Limits{}.connections);
  EXPECT_EQ(large.unmet, ConnectionTable::Limits{}.unmet);

  EXPECT_EQ(ConnectionTable::limits_for(1).unmet, 1u);
}

}  // namespace
}  // namespace ls::coordinator::rpc

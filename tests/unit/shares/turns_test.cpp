// Turns, shares and paces of callers: pure state machines.
#include "coordinator/base/turns.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "coordinator/base/gate.h"
#include "coordinator/http/net/pace.h"
#include "coordinator/http/net/shares.h"

namespace ls::http {
namespace {

using coordinator::Gate;
using coordinator::Turns;

// Asks for turns and notes in which order they come.
struct Queue {
  explicit Queue(Turns::Bounds bounds) : turns(bounds) {}
  Turns::Ticket ask(const std::string& caller, std::uint64_t bytes = 0) {
    return turns.ask(caller, bytes, [this, caller] { served.push_back(caller); });
  }
  Turns turns;
  std::vector<std::string> served;
};

TEST(Turns, QueueOfOneCallerDoesNotDelayAnother) {
  Queue queue({.places = 4, .places_each = 2});
  for (int i = 0; i < 100; ++i) queue.ask("mallory");

  queue.ask("bob");

  EXPECT_EQ(queue.served, (std::vector<std::string>{"mallory", "mallory", "bob"}));
  EXPECT_EQ(queue.turns.waiting(), 98u);
}

TEST(Turns, ServeTheLeastServedCaller) {
  Queue queue({.places = 2, .places_each = 2});
  const auto first = queue.ask("mallory");
  queue.ask("mallory");
  queue.ask("mallory");
  queue.ask("anna");
  queue.ask("bob");
  queue.served.clear();

  queue.turns.leave(first);

  EXPECT_EQ(queue.served, std::vector<std::string>{"anna"});
}

TEST(Turns, RotateAmongBusyCallers) {
  Turns turns({.places = 1, .places_each = 1});
  std::vector<std::string> served;
  std::vector<Turns::Ticket> tickets(8);
  std::size_t running = 0;
  for (std::size_t i = 0; i < tickets.size(); ++i) {
    const std::string caller = i < 6 ? "mallory" : "bob";
    tickets[i] = turns.ask(caller, 0, [&served, &running, caller, i] {
      served.push_back(caller);
      running = i;
    });
  }

  for (int i = 0; i < 4; ++i) turns.leave(tickets[running]);

  EXPECT_EQ(served, (std::vector<std::string>{"mallory", "bob", "mallory", "bob", "mallory"}));
}

TEST(Turns, CancelledRequestIsNotServed) {
  Queue queue({.places = 1, .places_each = 1});
  const auto first = queue.ask("anna");
  const auto second = queue.ask("bob");
  queue.turns.leave(second);

  queue.turns.leave(first);

  EXPECT_EQ(queue.served, std::vector<std::string>{"anna"});
  EXPECT_EQ(queue.turns.served() + queue.turns.waiting(), 0u);
}

TEST(Turns, MemoryIsSharedAndSmallRequestsNeverWaitForIt) {
  Queue queue({.places = 9, .places_each = 9, .bytes = 1000, .bytes_each = 500});
  const auto large = queue.ask("mallory", 400);
  queue.ask("mallory", 400);  // beyond the share
  queue.ask("anna", 500);
  queue.ask("bob", 300);  // beyond the sum
  queue.ask("carl", 15);
  ASSERT_EQ(queue.served, (std::vector<std::string>{"mallory", "anna", "carl"}));

  queue.turns.leave(large);

  EXPECT_EQ(queue.served, (std::vector<std::string>{"mallory", "anna", "carl", "bob"}));
}

TEST(Turns, OversizedRequestIsServedAlone) {
  Queue queue({.places = 9, .places_each = 9, .bytes = 1000, .bytes_each = 500});
  const auto small = queue.ask("anna", 100);
  queue.ask("bob", 5000);
  ASSERT_EQ(queue.served, std::vector<std::string>{"anna"});

  queue.turns.leave(small);

  EXPECT_EQ(queue.served, (std::vector<std::string>{"anna", "bob"}));
}

TEST(Turns, ThreadWaitsForItsTurn) {
  Gate gate({.places = 1, .places_each = 1});
  bool first_has_left = false, second_came = false;
  std::optional<Gate::Place> first(std::in_place, gate, "anna", 0);
  std::jthread second([&] {
    const Gate::Place place(gate, "bob", 0);
    second_came = first_has_left;
  });

  first_has_left = true;
  first.reset();
  second.join();

  EXPECT_TRUE(second_came);
}

TEST(Shares, CallerGetsAQuarterAndSmallRequestsAreFree) {
  Shares shares(1 << 20);
  Shares::Held a, b, c, d, small;

  EXPECT_TRUE(d.take(shares, "eve", 200'000));
  EXPECT_TRUE(a.take(shares, "mallory", 200'000));
  EXPECT_FALSE(b.take(shares, "mallory", 200'000));
  EXPECT_TRUE(c.take(shares, "bob", 200'000));
  EXPECT_TRUE(small.take(shares, "mallory", Shares::kSmall));
  a.give_back();
  EXPECT_TRUE(b.take(shares, "mallory", 200'000));
}

TEST(Shares, LargePieceLeavesOtherCallersTheirShares) {
  Shares shares(1 << 20);
  Shares::Held huge[4], more;

  for (const char* caller : {"a", "b", "c"}) EXPECT_TRUE(huge[caller[0] - 'a'].take(shares, caller, 1 << 30));
  EXPECT_FALSE(more.take(shares, "a", 100'000));
  EXPECT_TRUE(more.take(shares, "d", 100'000));
}

TEST(Pace, FastBytesEarnNoPause) {
  const SteadyClock::time_point began{};
  TransferPace pace(began, 15, 8192);

  pace.moved(32u << 20, began + steady_seconds(2));

  EXPECT_EQ(pace.deadline(), began + steady_seconds(17));
}

TEST(Pace, DripsDoNotExtendTheDeadline) {
  const SteadyClock::time_point began{};
  TransferPace pace(began, 15, 8192);

  for (int second = 1; second <= 14; ++second) pace.moved(1, began + steady_seconds(second));

  EXPECT_LT(pace.deadline(), began + steady_seconds(15.1));  // 14 bytes are 1.7 ms at 8192 a second
}

TEST(Pace, SteadySenderIsNeverCut) {
  const SteadyClock::time_point began{};
  TransferPace pace(began, 15, 8192);

  for (int second = 1; second <= 10'000; ++second) {
    const auto now = began + steady_seconds(second);
    ASSERT_GT(pace.deadline(), now) << second;
    pace.moved(8192, now);
  }
  pace.waited(steady_seconds(100));
  EXPECT_GT(pace.deadline(), began + steady_seconds(10'100));
}

}  // namespace
}  // namespace ls::http

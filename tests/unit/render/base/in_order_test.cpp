#include "worker/render/base/in_order.h"

#include <gtest/gtest.h>

#include <atomic>
#include <latch>
#include <numeric>
#include <stdexcept>
#include <vector>

namespace ls::render {
namespace {

TEST(InOrder, ConsumesAllResultsInOrder) {
  for (const int threads : {0, 1, 3, 8})
    for (const std::size_t count : {0u, 1u, 7u, 8u, 50u}) {
      std::vector<std::size_t> taken, expected(count);
      std::iota(expected.begin(), expected.end(), 0);
      for (std::size_t& x : expected) x *= x;
      in_order(
          threads, count, [](std::size_t i) { return i * i; },
          [&](std::size_t x) {
            taken.push_back(x);
            return true;
          });
      EXPECT_EQ(taken, expected) << threads << " threads";
    }
}

TEST(InOrder, EndsWhereTheConsumerStops) {
  for (const int threads : {1, 3, 8}) {
    std::atomic<std::size_t> made = 0;
    std::size_t taken = 0;
    in_order(
        threads, 100,
        [&](std::size_t i) {
          ++made;
          return i;
        },
        [&](std::size_t) { return ++taken < 10; });
    EXPECT_EQ(taken, 10u);
    EXPECT_LT(made, 10u + static_cast<std::size_t>(threads)) << "at most the rest of a wave is dropped";
  }
}

TEST(InOrder, ComputesSeveralAtOnce) {
  std::latch both(2);
  std::size_t sum = 0;
  in_order(
      2, 2,
      [&](std::size_t i) {
        both.arrive_and_wait();  // would wait forever if one were computed after the other
        return i;
      },
      [&](std::size_t i) {
        sum += i + 1;
        return true;
      });
  EXPECT_EQ(sum, 3u);
}

TEST(InOrder, RethrowsExceptions) {
  for (const int threads : {1, 4}) {
    std::size_t taken = 0;
    EXPECT_THROW(in_order(
                     threads, 10,
                     [](std::size_t i) {
                       if (i == 6) throw std::runtime_error("no memory");
                       return i;
                     },
                     [&](std::size_t) { return ++taken > 0; }),
                 std::runtime_error);
    EXPECT_LE(taken, 6u);
  }
}

}  // namespace
}  // namespace ls::render

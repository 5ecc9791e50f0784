#include "cli/instructions.h"

#include <gtest/gtest.h>

namespace ls::cli {
namespace {

TEST(InstructionCounter, CountsWhatThisThreadExecutesOrSaysWhyItCannot) {
  auto counter = InstructionCounter::open();
  if (!counter) {
    EXPECT_EQ(counter.error().code, Errc::unavailable);
    EXPECT_NE(counter.error().message.find("counter"), std::string::npos);
    return;
  }
  const auto before = counter->read();
  volatile int sink = 0;
  constexpr int kTurns = 100'000;
  for (int i = 0; i < kTurns; ++i) sink = i;
  const auto after = counter->read();

  ASSERT_TRUE(before && after);
  EXPECT_GE(*after - *before, std::uint64_t{2} * kTurns);  // a store and a jump each, at the least
  const InstructionCounter moved = std::move(*counter);
  EXPECT_GE(moved.read().value_or(0), *after);
}

}  // namespace
}  // namespace ls::cli

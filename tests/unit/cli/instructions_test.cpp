#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "cli/local/instructions.h"
#include "core/base/digest.h"

namespace ls::cli {
namespace {

using testing::HasSubstr;

TEST(InstructionCounter, CountsThisThreadsInstructionsOrSaysWhyItCannot) {
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
  EXPECT_GE(*after - *before, std::uint64_t{2} * kTurns);  // at least a store and a jump per turn
  const InstructionCounter moved = std::move(*counter);
  EXPECT_GE(moved.read().value_or(0), *after);
}

template <int kError>
int refusing() {
  errno = kError;
  return -1;
}

TEST(InstructionCounter, SaysWhatToDoOnMachinesWithoutACounterOrWithAHiddenOne) {
  for (int (*opener)() : {&refusing<EACCES>, &refusing<EPERM>}) {
    const auto hidden = InstructionCounter::open(opener);
    ASSERT_FALSE(hidden);
    EXPECT_EQ(hidden.error().code, Errc::unavailable);
    EXPECT_THAT(hidden.error().message, HasSubstr("kernel.perf_event_paranoid of 2 or less allows them"));
  }
  for (int (*opener)() : {&refusing<ENOENT>, &refusing<ENODEV>, &refusing<EOPNOTSUPP>}) {
    const auto missing = InstructionCounter::open(opener);
    ASSERT_FALSE(missing);
    EXPECT_THAT(missing.error().message, HasSubstr("this machine has no counter of instructions"));
  }
  EXPECT_THAT(InstructionCounter::open(&refusing<EMFILE>).error().message, HasSubstr("Too many open files"));
}

// Returns a counter that reads these numbers one after the other and then fails.
std::array<int, 2> shown{-1, -1};
InstructionCounter showing(std::initializer_list<std::uint64_t> counts) {
  EXPECT_EQ(pipe(shown.data()), 0);
  for (const std::uint64_t n : counts)
    EXPECT_EQ(write(shown[1], &n, sizeof n), static_cast<ssize_t>(sizeof n));
  close(shown[1]);
  return std::move(*InstructionCounter::open([] { return shown[0]; }));
}

Digest rendered(const std::string& name) { return sha256(name); }

TEST(MeasureVariants, DividesTheInstructionsBetweenTwoReadingsByThePaths) {
  const VariantBitsList all = measure_variants({"lean", "fat"}, 8, showing({100, 900, 1000, 2600}), rendered);

  ASSERT_EQ(all.all.size(), 2u);
  EXPECT_EQ(all.all[0].name, "lean");
  EXPECT_EQ(all.all[0].sums, rendered("lean"));
  EXPECT_EQ(all.all[0].instructions, 100.);
  EXPECT_EQ(all.all[1].instructions, 200.);
  EXPECT_EQ(all.uncounted, "");
}

TEST(MeasureVariants, SaysWhyInstructionCountsAreMissingAndStillComparesBits) {
  const VariantBitsList none =
      measure_variants({"lean", "fat"}, 8, InstructionCounter::open(&refusing<ENOENT>), rendered);
  EXPECT_THAT(none.uncounted, HasSubstr("no counter of instructions"));
  EXPECT_EQ(none.all[1].sums, rendered("fat"));
  EXPECT_EQ(none.all[1].instructions, std::nullopt);
}

TEST(MeasureVariants, LeavesOutCountsOfACounterThatFailsOrDoesNotMove) {
  const VariantBitsList failed = measure_variants({"lean", "fat"}, 8, showing({100, 900, 1000}), rendered);
  EXPECT_EQ(failed.all[0].instructions, 100.);
  EXPECT_EQ(failed.all[1].instructions, std::nullopt);
  EXPECT_THAT(failed.uncounted, HasSubstr("cannot be read"));

  const VariantBitsList still = measure_variants({"lean"}, 8, showing({100, 100}), rendered);
  EXPECT_EQ(still.all[0].instructions, std::nullopt);
  EXPECT_THAT(still.uncounted, HasSubstr("stands still"));
}

}  // namespace
}  // namespace ls::cli

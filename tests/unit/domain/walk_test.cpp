#include <cstdlib>

#include "tests/unit/domain/walk.h"

namespace ls::coordinator {
namespace {

// A step takes ten to fifty times as long under sanitizers. They look for other faults than wrong decisions,
// so fewer histories are enough.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr std::uint64_t kShort = 60, kLong = 2, kFoul = 2;
#else
constexpr std::uint64_t kShort = 2000, kLong = 30, kFoul = 40;
#endif

// For a long run: LIGHTSHAFT_WALKS=1000000 bin/domain_test --gtest_filter='RandomWalk.Thousands*'
std::uint64_t histories() {
  const char* asked = std::getenv("LIGHTSHAFT_WALKS");
  return asked ? std::strtoull(asked, nullptr, 10) : kShort;
}

TEST(RandomWalk, ThousandsOfHistoriesKeepEveryInvariant) {
  for (std::uint64_t seed = 1; seed <= histories(); ++seed) {
    const std::string wrong = Walk(seed).run(150);
    ASSERT_EQ(wrong, "") << "seed " << seed;
  }
}

TEST(RandomWalk, SomeLongHistoriesKeepEveryInvariant) {
  for (std::uint64_t seed = 10001; seed <= 10000 + kLong; ++seed) {
    const std::string wrong = Walk(seed).run(3000);
    ASSERT_EQ(wrong, "") << "seed " << seed;
  }
}

TEST(RandomWalk, UnderConstantFailuresEveryJobEndsOrSaysWhy) {
  for (std::uint64_t seed = 20001; seed <= 20000 + kFoul; ++seed) {
    const std::string wrong = Walk(seed).run_into_foul_weather(120);
    ASSERT_EQ(wrong, "") << "seed " << seed;
  }
}

}  // namespace
}  // namespace ls::coordinator

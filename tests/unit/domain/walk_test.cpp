#include "tests/unit/domain/walk.h"

namespace ls::coordinator {
namespace {

TEST(RandomWalk, ThousandsOfHistoriesKeepEveryInvariant) {
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
    const std::string wrong = Walk(seed).run(150);
    ASSERT_EQ(wrong, "") << "seed " << seed;
  }
}

TEST(RandomWalk, AFewLongHistoriesKeepEveryInvariant) {
  for (std::uint64_t seed = 10001; seed <= 10030; ++seed) {
    const std::string wrong = Walk(seed).run(3000);
    ASSERT_EQ(wrong, "") << "seed " << seed;
  }
}

}  // namespace
}  // namespace ls::coordinator

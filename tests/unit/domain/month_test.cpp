#include "tests/unit/domain/month.h"

namespace ls::coordinator {
namespace {

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr int kHours = 12;
#else
constexpr int kHours = 96;
#endif

// Thirty days: bench/month.cpp. The sizes are read every hour. Sizes of
// what is in flight scatter, by less than half of the largest value of many hours.
TEST(Month, FourDaysKeepEveryInvariantWithoutGrowingMemory) {
  Month month(1);
  // Largest sizes in the first and in the second half of the time
  std::map<std::string, std::pair<std::size_t, std::size_t>> most;
  for (int hour = 0; hour < kHours; ++hour) {
    ASSERT_EQ(month.hour(), "");
    for (const auto& [what, size] : month.sizes()) {
      std::size_t& half = hour < kHours / 2 ? most[what].first : most[what].second;
      half = std::max(half, size);
    }
  }
  most.erase("quarantined");  // one entry for each faulty worker: it stays quarantined forever
  for (const auto& [what, halves] : most) EXPECT_LE(halves.second, halves.first * 3 / 2 + 32) << what;
  const Month::Counts& c = month.counts();
  for (const std::uint64_t happened :
       {c.ended, c.units, c.again, c.workers, c.failures, c.restarts + c.takeovers, c.audits, c.user_acts})
    EXPECT_GT(happened, 0u);
  EXPECT_GT(c.ended + 60, c.submitted) << "jobs end";
}

}  // namespace
}  // namespace ls::coordinator

// A million units and a thousand workers: handle() must not iterate over all of them.
#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

TEST(Scale, SchedulesAMillionUnitsOnAThousandWorkers) {
  Rig rig;
  rig.cpu_seconds = 0.5;
  for (int w = 0; w < 1000; ++w) rig.join("w" + std::to_string(w), 16);
  JobPlan plan = plan_of("j", 2, 4096);
  plan.grid = {{4096, 3840}, 32};  // 128 x 120 tiles
  plan.spp = 64 * 60;              // 65 rounds: 998,400 units
  rig.submit(plan);

  std::uint64_t results = 0;
  while (rig.job().state == JobState::running) {
    for (auto& [id, units] : rig.held) {
      if (units.empty()) continue;
      const Rig::Held unit = units.front();
      units.pop_front();
      rig.result(id.value, unit);
      ++results;
    }
    rig.pass(100ms);
  }

  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_GE(results, 998400u);
  EXPECT_LE(results, 998400u * 101 / 100) << "hardly a copy";
}

}  // namespace
}  // namespace ls::coordinator

// Another coordinator may take a job over, on a machine whose mathematical library is another one: all that
// decides which samples a job has must be exact everywhere, so made of +, -, *, / and square roots, which
// IEEE 754 rounds in one way only.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "coordinator/domain/adaptive_stop.h"
#include "core/image/film/film.h"
#include "tests/unit/domain/stop_oracle.h"
#include "tests/unit/numeric_class/libraries.h"

namespace ls::coordinator {
namespace {

const TileGrid kGrid{{96, 64}, 32};

// Sums of samples that scatter about a mean, the more the higher the tile's number; made without a
// mathematical function.
Partial scattered(TileIndex tile, SampleRange samples) {
  Partial p{{sha256("scene"), sha256("settings"), sha256("class"), kGrid.rect(tile), samples}, {}, {}};
  std::mt19937_64 random(tile * 1000003ull + samples.s0);
  std::uniform_real_distribution<float> noise(-1, 1);
  p.sums.resize(static_cast<std::size_t>(p.header.tile.pixels()) * kPartialChannels);
  const auto count = static_cast<float>(samples.count()) / 2;
  for (float& sum : p.sums) {
    sum = count;
    for (std::uint64_t s = 0; s < samples.count() / 2; ++s)
      sum += noise(random) * static_cast<float>(tile + 1) / 4;
  }
  return p;
}

struct Decisions {
  std::vector<double> levels, predicted, errors;
  std::vector<AdaptiveStop::Verdict> verdicts;
  std::vector<RoundIndex> ends, predicted_last;
  bool operator==(const Decisions&) const = default;
};

// A whole job down to a target error.
Decisions run_job() {
  constexpr double kTarget = 2e-4;
  Decisions out;
  Film film(kGrid);
  AdaptiveStop rule(kGrid, 4096);
  std::vector<RoundIndex> seen(kGrid.count());
  const auto error = [&](TileIndex t, RoundIndex k) {
    const auto folded = film.fold(t, k, scattered(t, round_range(k)));
    if (!folded) throw std::logic_error(folded.error().message);
    out.errors.push_back(folded->relative.squares);
    rule.foresee(kTarget);
    for (TileIndex i = 0; i < kGrid.count(); ++i) out.predicted_last.push_back(rule.predicted_last(i));
    return folded->relative.squares;
  };
  for (;;) {
    while (rule.judge(kTarget) == AdaptiveStop::Verdict::unknown) feed_wanted(rule, seen, error);
    out.levels.push_back(rule.level());
    out.predicted.push_back(rule.predicted());
    out.verdicts.push_back(rule.judge(kTarget));
    if (out.verdicts.back() == AdaptiveStop::Verdict::yes || rule.exhausted()) break;
    rule.lower();
  }
  out.ends = rule.ends();
  return out;
}

TEST(StopDecisions, AreTheSameWithAnotherMathLibrary) {
  const Decisions here = run_job();
  ASSERT_EQ(here.verdicts.back(), AdaptiveStop::Verdict::yes);
  ASSERT_GT(here.levels.size(), 3u);
  ASSERT_GT(here.ends.back(), here.ends.front()) << "tiles of one kind prove little";

  test::g_perturbed = test::kEveryFunction;
  test::g_calls = 0;
  const Decisions there = run_job();
  test::g_perturbed = "";

  EXPECT_EQ(test::g_calls, 0u) << "of a mathematical function, while decisions were made";
  EXPECT_EQ(there, here);
}

}  // namespace
}  // namespace ls::coordinator

// The order in which a job's units are leased: first those that are certain to be needed, then speculative
// ones.
#include "coordinator/domain/unit_queue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace ls::coordinator {
namespace {

constexpr auto nobody = [](UnitCode) { return false; };

std::vector<UnitCode> all_of(UnitQueue& queue, const UnitTable& units) {
  std::vector<UnitCode> order;
  while (const auto code = queue.front(units, nobody)) {
    queue.pop(*code);
    order.push_back(*code);
  }
  return order;
}

TEST(UnitQueue, ServesRoundByRound) {
  const UnitTable units(3);
  UnitQueue queue(3, 2);
  EXPECT_EQ(queue.surely_waiting(), 6u);
  EXPECT_EQ(all_of(queue, units), (std::vector<UnitCode>{unit_code(0, 0), unit_code(0, 1), unit_code(0, 2),
                                                         unit_code(1, 0), unit_code(1, 1), unit_code(1, 2)}));
  EXPECT_EQ(queue.surely_waiting(), 0u);
}

TEST(UnitQueue, CertainUnitsGoFirstThenThoseThatGainMost) {
  const UnitTable units(3);
  UnitQueue queue(3, 10);
  // There are 64 samples after round 5, and each later round adds 64: the gains of tile 0 are 90 / (64 *
  // 128), 90 / (128 * 192)...
  queue.set_wanted(0, 6, 90);
  queue.set_wanted(1, 8, 0);
  queue.set_wanted(2, 6, 40);
  for (const TileIndex t : {0u, 1u, 2u}) queue.set_window(t, 9);
  EXPECT_EQ(queue.surely_waiting(), 6u + 8u + 6u);

  auto order = all_of(queue, units);

  ASSERT_EQ(order.size(), 27u);
  order.erase(order.begin(), order.begin() + 18);  // rounds 0 to 5
  EXPECT_EQ(order,
            (std::vector<UnitCode>{unit_code(6, 1), unit_code(7, 1),                   // wanted
                                   unit_code(6, 0), unit_code(6, 2), unit_code(7, 0),  // .0110 .0049 .0037
                                   unit_code(8, 0), unit_code(7, 2), unit_code(8, 2),  // .0018 .0016 .0008
                                   unit_code(8, 1)}));                                 // 0
}

TEST(UnitQueue, ReturnedUnitsGoFirstInTheirRound) {
  const UnitTable units(2);
  UnitQueue queue(2, 8);
  for (const TileIndex t : {0u, 1u}) queue.set_wanted(t, 6, 1);
  while (queue.front(units, nobody) != unit_code(7, 0)) queue.pop(*queue.front(units, nobody));
  queue.put_back(unit_code(6, 1));  // a speculative unit
  EXPECT_EQ(queue.front(units, nobody), unit_code(6, 1));
  queue.rewind(1, 5);  // a certain unit waits again
  EXPECT_EQ(queue.front(units, nobody), unit_code(5, 1));
  queue.pop(unit_code(5, 1));
  queue.put_back(unit_code(5, 1));
  queue.put_back(unit_code(3, 0));
  EXPECT_EQ(all_of(queue, units), (std::vector<UnitCode>{unit_code(3, 0), unit_code(5, 1), unit_code(6, 1),
                                                         unit_code(7, 0), unit_code(7, 1)}));
}

TEST(UnitQueue, FocusTilesGoFirstInEveryRound) {
  const UnitTable units(3);
  UnitQueue queue(3, 2);
  queue.pop(unit_code(0, 0));
  queue.put_back(unit_code(0, 0));
  queue.set_focus({2});
  EXPECT_EQ(queue.front(units, nobody), unit_code(0, 2));
  queue.pop(unit_code(0, 2));
  EXPECT_EQ(queue.front(units, nobody), unit_code(1, 2));
  queue.pop(unit_code(1, 2));
  queue.put_back(unit_code(0, 2));
  EXPECT_EQ(queue.surely_waiting(), 5u);
  auto rest = queue;
  EXPECT_EQ(all_of(rest, units), (std::vector<UnitCode>{unit_code(0, 2), unit_code(0, 0), unit_code(0, 1),
                                                        unit_code(1, 0), unit_code(1, 1)}));
  queue.set_focus({});
  EXPECT_EQ(all_of(queue, units), (std::vector<UnitCode>{unit_code(0, 0), unit_code(0, 2), unit_code(0, 1),
                                                         unit_code(1, 0), unit_code(1, 1)}));
}

// A focus does not move speculative units forward: they may turn out not to be needed.
TEST(UnitQueue, FocusDoesNotReorderSpeculativeUnits) {
  const UnitTable units(2);
  UnitQueue queue(2, 7);
  queue.set_wanted(0, 6, 2);
  queue.set_wanted(1, 6, 1);
  queue.set_focus({1});
  const auto order = all_of(queue, units);
  EXPECT_EQ(order.front(), unit_code(0, 1));
  EXPECT_EQ(order.at(6), unit_code(0, 0));
  EXPECT_EQ(order.at(12), unit_code(6, 0));
}

TEST(UnitQueue, UnknownErrorCountsAsLarge) {
  const UnitTable units(2);
  UnitQueue queue(2, 7);
  queue.set_wanted(0, 6, 1e30);
  queue.set_wanted(1, 6, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(all_of(queue, units).at(12), unit_code(6, 1));
}

// The same queue, but it looks through all units each time.
struct Oracle {
  std::vector<RoundIndex> next, end, window, before;
  std::vector<double> variance;
  std::set<UnitCode> returned;
  std::vector<bool> focus;
  bool all = true;

  bool wanted(UnitCode code) const { return all || round_of(code) < before[tile_of(code)]; }
  double gain(UnitCode code) const {
    const RoundIndex r = round_of(code);
    if (wanted(code)) return std::numeric_limits<double>::infinity();
    return variance[tile_of(code)] /
           (static_cast<double>(round_range(r - 1).s1) * static_cast<double>(round_range(r).s1));
  }
  int line_of(UnitCode code) const { return !wanted(code) ? 2 : focus[tile_of(code)] ? 0 : 1; }
  std::optional<UnitCode> front() const {
    std::optional<UnitCode> best;
    for (const int line : {0, 1, 2}) {
      for (const UnitCode code : returned)
        if (line_of(code) == line) return code;
      for (TileIndex t = 0; t < next.size(); ++t) {
        if (next[t] >= std::min(end[t], window[t])) continue;
        const UnitCode code = unit_code(next[t], t);
        if (line_of(code) != line) continue;
        if (!best || gain(code) > gain(*best) || (gain(code) == gain(*best) && code < *best)) best = code;
      }
      if (best) return best;
    }
    return best;
  }
  std::uint64_t surely() const {
    auto n = static_cast<std::uint64_t>(
        std::count_if(returned.begin(), returned.end(), [&](UnitCode c) { return wanted(c); }));
    for (TileIndex t = 0; t < next.size(); ++t) {
      const RoundIndex last = std::min({end[t], window[t], all ? end[t] : before[t]});
      n += last - std::min(last, next[t]);
    }
    return n;
  }
};

TEST(UnitQueue, MatchesAScanOfAllUnits) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    std::mt19937 rng(seed);
    const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(rng() % n); };
    const TileIndex tiles = 1 + below(7);
    const RoundIndex rounds = 20;
    const UnitTable units(tiles);
    UnitQueue queue(tiles, rounds);
    const std::vector<RoundIndex> none(tiles), most(tiles, rounds);
    Oracle oracle{none, most, most, most, std::vector<double>(tiles), {}, std::vector<bool>(tiles)};
    for (int step = 0; step < 3000; ++step) {
      const TileIndex t = below(tiles);
      const std::uint32_t what = below(40);
      if (what < 20) {
        const auto code = oracle.front();
        ASSERT_EQ(queue.front(units, nobody), code) << "seed " << seed << " step " << step;
        if (!code) continue;
        queue.pop(*code);
        if (oracle.returned.erase(*code) == 0) ++oracle.next[tile_of(*code)];
      } else if (what < 26) {
        if (oracle.next[t] == 0) continue;
        const UnitCode code = unit_code(below(oracle.next[t]), t);
        queue.put_back(code);
        if (round_of(code) < oracle.end[t]) oracle.returned.insert(code);
      } else if (what < 34) {
        oracle.all = false;
        oracle.before[t] = below(rounds) + 1;
        oracle.variance[t] = static_cast<double>(1u << below(10));
        queue.set_wanted(t, oracle.before[t], oracle.variance[t]);
      } else if (what < 36) {
        queue.set_window(t, oracle.window[t] = below(rounds) + 1);
      } else if (what < 38) {
        const RoundIndex from = below(rounds);
        queue.rewind(t, from);
        for (RoundIndex r = from; r < rounds; ++r) oracle.returned.erase(unit_code(r, t));
        oracle.next[t] = std::min(oracle.next[t], from);
      } else if (what == 38) {
        const RoundIndex end = below(rounds) + 1;
        queue.set_end(t, end);
        oracle.end[t] = end;
        for (RoundIndex r = end; r < rounds; ++r) oracle.returned.erase(unit_code(r, t));
      } else if (below(2) == 0) {
        std::vector<TileIndex> focus;
        for (TileIndex i = 0; i < tiles; ++i)
          if (oracle.focus[i] = below(2) == 0; oracle.focus[i]) focus.push_back(i);
        queue.set_focus(focus);
      } else if (below(5) == 0) {
        queue.want_all();
        oracle.all = true;
        oracle.before = most;
        std::fill(oracle.variance.begin(), oracle.variance.end(), 0);
      }
      ASSERT_EQ(queue.surely_waiting(), oracle.surely()) << "seed " << seed << " step " << step;
    }
  }
}

// However many speculative units came back, the search for a certain one does not look through them.
TEST(UnitQueue, FindsTheNextUnitWithoutScanningAll) {
  const UnitTable units(2);
  UnitQueue queue(2, 10'000);
  queue.set_wanted(0, 0, 1);
  queue.set_wanted(1, 10'000, 1);
  std::vector<UnitCode> out;
  while (queue.front(units, nobody)) {
    out.push_back(*queue.front(units, nobody));
    queue.pop(out.back());
  }
  for (const UnitCode code : out)
    if (code != unit_code(9'999, 1)) queue.put_back(code);
  int looked_at = 0;
  const auto none_of_tile_1 = [&](UnitCode code) {
    return ++looked_at, tile_of(code) == 1 && round_of(code) > 0;
  };
  EXPECT_EQ(queue.front(units, none_of_tile_1), unit_code(0, 1));
  EXPECT_EQ(looked_at, 1);
  queue.set_wanted(0, 1, 1);  // one more round is certain to be needed
  EXPECT_EQ(queue.front(units, none_of_tile_1), unit_code(0, 0));
  EXPECT_EQ(looked_at, 2);
}

// Entries that a million changes of the predicted order made outdated do not accumulate.
TEST(UnitQueue, DropsOutdatedEntries) {
  const UnitTable units(4);
  UnitQueue queue(4, 100);
  for (const RoundIndex before : {RoundIndex{50}, RoundIndex{0}})
    for (int i = 0; i < 100'000; ++i) queue.set_wanted(static_cast<TileIndex>(i % 4), before, i);
  EXPECT_LE(queue.entries(), 4u + 3 * 4u);
  EXPECT_EQ(all_of(queue, units).size(), 400u);
}

// A long random history, with and without speculative units and a focus. Each heap has at most two entries
// for each tile and the one that was just added.
TEST(UnitQueue, NumberOfEntriesStaysBelowTheNumberOfTiles) {
  constexpr TileIndex kTiles = 5;
  constexpr RoundIndex kRounds = 40;
  for (const bool speculative : {false, true}) {
    const UnitTable units(kTiles);
    UnitQueue queue(kTiles, kRounds);
    std::mt19937 random(1);
    const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
    std::vector<UnitCode> out;
    std::size_t most = 0;
    for (int i = 0; i < 200'000; ++i) {
      const TileIndex tile = below(kTiles);
      switch (below(7)) {
        case 0:
          queue.set_window(tile, below(kRounds + 1));
          break;
        case 1:
          if (speculative) queue.set_wanted(tile, below(kRounds), below(1000));
          break;
        case 2:
          queue.set_end(tile, queue.next(tile) + below(kRounds + 1 - std::min(kRounds, queue.next(tile))));
          break;
        case 3:
          std::erase_if(out, [&](UnitCode code) { return tile_of(code) == tile; });
          queue.rewind(tile, 0);
          break;
        case 4:
          if (below(100) == 0) queue.set_focus(below(2) == 0 ? std::vector<TileIndex>() : std::vector{tile});
          break;
        case 5:
          if (out.empty()) break;
          queue.put_back(out.back(), below(2) == 0);
          out.pop_back();
          break;
        default:
          if (const auto next = queue.front(units, nobody)) queue.pop(*next), out.push_back(*next);
      }
      most = std::max(most, queue.entries());
    }
    EXPECT_LE(most, 3 * (2 * kTiles + 1)) << (speculative ? "with" : "without") << " speculative units";
  }
}

}  // namespace
}  // namespace ls::coordinator

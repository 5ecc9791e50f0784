// The units of a job that wait for a worker. Each tile has its own end, since the tiles of an adaptive job
// (one with a target error) stop after different numbers of rounds. The waiting units of a tile are all
// rounds from `next` to its end, and earlier rounds that were leased (assigned to a worker) and came back
// without a result. Lower rounds go first, so that a complete picture is available early. In an adaptive job
// some rounds are speculative: the job may end without them. They go after all certain rounds, in the order
// in which the stop rule (adaptive_stop.h) would request them. Terms: docs/reference/glossary.md.
//
// A focus is a set of tiles whose certain units go before those of all other tiles. It changes only the order
// of units, not which units belong to the job and which of them are certain. The order of speculative units
// ignores the focus, since the first of them are the most likely to be needed.
//
// Every operation but set_focus() costs O(log tiles) at most, amortised; memory is at most 28 bytes per tile,
// 68 if there are speculative units, and 16 more if there is a focus.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <queue>
#include <set>
#include <vector>

#include "coordinator/domain/unit_table.h"

namespace ls::coordinator {

class UnitQueue {
 public:
  UnitQueue(TileIndex tiles, RoundIndex rounds)
      : next_(tiles),
        end_(tiles, rounds),
        window_(tiles, kNoWindow),
        planned_(std::uint64_t{rounds} * tiles),
        surely_(planned_) {
    for (TileIndex t = 0; t < tiles; ++t) offer(t);
  }

  TileIndex tiles() const { return static_cast<TileIndex>(next_.size()); }
  // Returns the number of rounds of the tile that belong to the job
  RoundIndex end(TileIndex tile) const { return end_[tile]; }
  RoundIndex longest() const { return *std::max_element(end_.begin(), end_.end()); }
  // True if the unit belongs to the job: its round is before its tile's end.
  bool plans(UnitCode code) const { return round_of(code) < end_[tile_of(code)]; }
  std::uint64_t planned() const { return planned_; }
  void set_end(TileIndex tile, RoundIndex rounds) {
    planned_ += rounds;
    planned_ -= end_[tile];
    const bool was_open = open(tile);
    counting(tile, [&] { end_[tile] = rounds; });
    forget_from(tile, rounds);
    if (!was_open) offer(tile);
  }
  // Rounds of the tile from number `window` on are not leased until a later call sets a higher `window`.
  void set_window(TileIndex tile, RoundIndex window) {
    const bool was_open = open(tile);
    counting(tile, [&] { window_[tile] = window; });
    if (!was_open) offer(tile);
  }
  // Declares the tile's rounds before `before` as certain to be needed. Later rounds are speculative: those
  // that remove more error per sample go first. This error is `variance` / (n m), where n and m are the
  // samples per pixel without and with the round. `variance` is the variance per sample of the group of tiles
  // that stop together with this tile; NaN: unknown.
  void set_wanted(TileIndex tile, RoundIndex before, double variance) {
    if (wanted_.empty()) wanted_.assign(next_.size(), {});
    const float weight =
        std::isnan(variance) ? std::numeric_limits<float>::infinity() : static_cast<float>(variance);
    if (wanted_[tile].before == before && wanted_[tile].weight == weight) return;
    const bool was_wanted = wanted(unit_code(next_[tile], tile));
    sort_returned(tile, wanted_[tile].before, before);
    counting(tile, [&] { wanted_[tile] = {before, weight}; });
    if (!was_wanted || !wanted(unit_code(next_[tile], tile))) offer(tile);
  }
  // Declares all rounds of all tiles as certain to be needed.
  void want_all() {
    if (wanted_.empty()) return;
    wanted_.clear();
    perhaps_ = {};
    for (const UnitCode code : returned_perhaps_) line_of(tile_of(code)).returned.insert(code);
    returned_perhaps_.clear();
    surely_ = 0;
    for (TileIndex t = 0; t < tiles(); ++t) {
      surely_ += surely(t);
      offer(t);
    }
  }
  // Sets the focus to these tiles; empty: there is no focus. Costs O(tiles).
  void set_focus(const std::vector<TileIndex>& focus) {
    std::vector<bool> chosen(focus.empty() ? 0 : next_.size());
    for (const TileIndex t : focus) chosen[t] = true;
    if (chosen == focus_) return;
    focus_ = std::move(chosen);
    Line all;
    for (Line& line : lines_) all.returned.merge(line.returned);
    lines_ = {};
    for (const UnitCode code : all.returned) line_of(tile_of(code)).returned.insert(code);
    for (TileIndex t = 0; t < tiles(); ++t)
      if (wanted(unit_code(next_[t], t))) offer(t);
  }
  bool wanted(UnitCode code) const { return round_of(code) < wanted_before(tile_of(code)); }
  // Returns how many waiting units are certain to be needed. Units whose result arrived before their turn may
  // be counted, too.
  std::uint64_t surely_waiting() const { return surely_ + surely_returned(); }

  // Returns the first round of the tile whose turn has not come yet: every earlier round has been leased at
  // least once, or has an accepted result. Rounds that came back before they were begun do not count, unless
  // a later round of the tile counts.
  RoundIndex next(TileIndex tile) const { return next_[tile]; }
  // Puts the tile's rounds from `round` on back into the queue.
  void rewind(TileIndex tile, RoundIndex round) {
    forget_from(tile, round);
    if (round >= next_[tile]) return;
    counting(tile, [&] { next_[tile] = round; });
    offer(tile);
  }

  // Returns the first waiting unit that may be leased; nullopt if there is none. Certain units of the focus
  // go first, then the other certain ones, then speculative ones. Within each of these three, units that were
  // leased and came back go first. excluded(unit) is called only for units that came back; if it returns
  // true, the unit is skipped.
  template <class Excluded>
  std::optional<UnitCode> front(const UnitTable& units, Excluded&& excluded) {
    const auto first_of = [&](const std::set<UnitCode>& returned) {
      const auto it = std::find_if_not(returned.begin(), returned.end(), excluded);
      return it == returned.end() ? std::nullopt : std::optional(*it);
    };
    for (Line& line : lines_) {
      if (const auto code = first_of(line.returned)) return code;
      while (const auto next = head(line)) {
        if (!units.accepted(*next)) return next;
        advance(tile_of(*next));
      }
    }
    if (const auto code = first_of(returned_perhaps_)) return code;
    while (const auto next = perhaps_head()) {
      if (!units.accepted(*next)) return next;
      advance(tile_of(*next));
    }
    return std::nullopt;
  }
  bool empty(const UnitTable& units) {
    return !front(units, [](UnitCode) { return false; });
  }
  // Removes the unit that front() returned.
  void pop(UnitCode code) {
    if (waits(code))
      advance(tile_of(code));
    else
      forget(code);
  }
  // Queues a unit again that was leased and came back without a result. `begun`: a worker may have begun to
  // render it. If not, and if this holds for the tile's later rounds too, the unit counts as never leased.
  void put_back(UnitCode code, bool begun = true) {
    const TileIndex tile = tile_of(code);
    if (!plans(code) || round_of(code) >= next_[tile]) return;
    (wanted(code) ? line_of(tile).returned : returned_perhaps_).insert(code);
    if (begun) begun_.insert(code);
    RoundIndex next = next_[tile];
    for (; next > 0; --next) {
      const UnitCode last = unit_code(next - 1, tile);
      if (!returned(last) || begun_.contains(last)) break;
      forget(last);
    }
    if (next == next_[tile]) return;
    counting(tile, [&] { next_[tile] = next; });
    offer(tile);
  }
  // Removes the unit if it was leased and came back, because its result has arrived after all.
  void forget(UnitCode code) {
    line_of(tile_of(code)).returned.erase(code);
    returned_perhaps_.erase(code);
    begun_.erase(code);
  }
  bool returned(UnitCode code) const {
    return line_of(tile_of(code)).returned.contains(code) || returned_perhaps_.contains(code);
  }
  std::size_t returned_count() const { return surely_returned() + returned_perhaps_.size(); }
  // Number of entries in the heaps, for measurements of memory use
  std::size_t entries() const { return lines_[0].heads.size() + lines_[1].heads.size() + perhaps_.size(); }

 private:
  static constexpr RoundIndex kNoWindow = std::numeric_limits<RoundIndex>::max();

  // The values that the latest set_wanted() gave for a tile; `weight` is the variance (infinite if unknown).
  // Not used while no tile has speculative units
  struct Wanted {
    RoundIndex before = kNoWindow;
    float weight = 0;
  };
  // Units that are certain to be needed. `returned`: units that were leased and came back, which go first.
  // `heads`: the next unit of each tile, in the order of rounds
  struct Line {
    std::priority_queue<UnitCode, std::vector<UnitCode>, std::greater<>> heads;
    std::set<UnitCode> returned;
  };
  // A speculative unit, with the error that it removes per sample
  struct Perhaps {
    float gain;
    UnitCode code;
    bool operator<(const Perhaps& o) const { return gain != o.gain ? gain < o.gain : code > o.code; }
  };

  bool open(TileIndex t) const { return next_[t] < std::min(end_[t], window_[t]); }
  bool waits(UnitCode code) const { return open(tile_of(code)) && round_of(code) == next_[tile_of(code)]; }
  RoundIndex wanted_before(TileIndex t) const { return wanted_.empty() ? kNoWindow : wanted_[t].before; }
  float gain(UnitCode code) const {
    const RoundIndex round = round_of(code);
    if (round == 0) return std::numeric_limits<float>::infinity();
    return static_cast<float>(
        static_cast<double>(wanted_[tile_of(code)].weight) /
        (static_cast<double>(round_range(round - 1).s1) * static_cast<double>(round_range(round).s1)));
  }
  std::uint64_t surely(TileIndex t) const {
    const RoundIndex before = std::min({end_[t], window_[t], wanted_before(t)});
    return before - std::min(before, next_[t]);
  }
  template <class Change>
  void counting(TileIndex t, Change&& change) {
    surely_ -= surely(t);
    change();
    surely_ += surely(t);
  }
  Line& line_of(TileIndex t) { return lines_[focus_.empty() || focus_[t] ? 0 : 1]; }
  const Line& line_of(TileIndex t) const { return lines_[focus_.empty() || focus_[t] ? 0 : 1]; }
  std::size_t surely_returned() const { return lines_[0].returned.size() + lines_[1].returned.size(); }
  // Adds the tile's next unit, if it may be leased, to the heap of certain or of speculative units. So the
  // heaps hold the next unit of every tile that has one to lease. They also hold outdated entries, which
  // head() and perhaps_head() drop at the top. A heap that has more than two entries per tile is rebuilt
  // without them, so the number of entries is bounded.
  void offer(TileIndex tile) {
    if (!open(tile)) return;
    const UnitCode code = unit_code(next_[tile], tile);
    if (!wanted(code)) {
      if (perhaps_.size() > 2 * next_.size()) return offer_all_perhaps();
      return perhaps_.push({gain(code), code});
    }
    Line& line = line_of(tile);
    line.heads.push(code);
    if (line.heads.size() <= 2 * next_.size()) return;
    std::vector<UnitCode> all;
    for (TileIndex t = 0; t < tiles(); ++t) {
      const UnitCode next = unit_code(next_[t], t);
      if (open(t) && wanted(next) && &line_of(t) == &line) all.push_back(next);
    }
    line.heads = std::priority_queue<UnitCode, std::vector<UnitCode>, std::greater<>>({}, std::move(all));
  }
  // Rebuilds perhaps_ without its outdated entries.
  void offer_all_perhaps() {
    std::vector<Perhaps> all;
    for (TileIndex t = 0; t < tiles(); ++t) {
      const UnitCode code = unit_code(next_[t], t);
      if (open(t) && !wanted(code)) all.push_back({gain(code), code});
    }
    perhaps_ = std::priority_queue<Perhaps>({}, std::move(all));
  }
  std::optional<UnitCode> head(Line& line) {
    auto& heads = line.heads;
    while (!heads.empty() && !(waits(heads.top()) && wanted(heads.top()))) heads.pop();
    return heads.empty() ? std::nullopt : std::optional(heads.top());
  }
  std::optional<UnitCode> perhaps_head() {
    const auto alive = [&](const Perhaps& p) {
      return waits(p.code) && !wanted(p.code) && p.gain == gain(p.code);
    };
    while (!perhaps_.empty() && !alive(perhaps_.top())) perhaps_.pop();
    return perhaps_.empty() ? std::nullopt : std::optional(perhaps_.top().code);
  }
  void advance(TileIndex tile) {
    counting(tile, [&] { ++next_[tile]; });
    offer(tile);
  }
  void forget_from(TileIndex tile, RoundIndex round) {
    if (returned_count() == 0) return;
    for (RoundIndex k = round; k < next_[tile]; ++k) forget(unit_code(k, tile));
  }
  // Called when the end of the tile's certain rounds changes from `from` to `to`. Of the units that came
  // back, those of the rounds between `from` and `to` become certain or speculative.
  void sort_returned(TileIndex tile, RoundIndex from, RoundIndex to) {
    if (returned_count() == 0) return;
    auto& surely = line_of(tile).returned;
    auto& there = from < to ? returned_perhaps_ : surely;
    auto& here = from < to ? surely : returned_perhaps_;
    for (RoundIndex k = std::min(from, to); k < std::min(std::max(from, to), next_[tile]); ++k)
      if (there.erase(unit_code(k, tile)) > 0) here.insert(unit_code(k, tile));
  }

  std::vector<RoundIndex> next_, end_, window_;
  std::uint64_t planned_, surely_;
  std::vector<bool> focus_;  // true for tiles of the focus, by tile; empty: there is no focus
  // Certain units. [0]: those of the tiles of the focus (of all tiles if there is no focus); [1]: those of
  // the other tiles
  std::array<Line, 2> lines_;
  std::priority_queue<Perhaps> perhaps_;
  std::vector<Wanted> wanted_;  // latest values of set_wanted(), by tile; empty: all units are certain
  std::set<UnitCode> returned_perhaps_;
  std::set<UnitCode> begun_;  // those of the returned units that a worker may have begun
};

}  // namespace ls::coordinator

// The units of a job that wait for a worker: everything from a cursor on, plus those that came back. Constant
// memory per job but for what came back.
#pragma once

#include <optional>
#include <set>

#include "coordinator/domain/unit_table.h"

namespace ls::coordinator {

class UnitQueue {
 public:
  UnitQueue(TileIndex tiles, UnitCode end) : tiles_(tiles), end_(end) {}

  // Units below `end` belong to the job; those of rounds from `window` on wait until it is moved.
  UnitCode end() const { return end_; }
  void set_end(UnitCode end) { end_ = end, returned_.erase(returned_.lower_bound(end), returned_.end()); }
  void set_window(RoundIndex window) { window_ = window; }
  std::uint64_t planned() const { return std::uint64_t{round_of(end_)} * tiles_ + tile_of(end_); }

  UnitCode cursor() const {
    return cursor_;
  }  // below it every unit has been handed out at least once, or accepted
  // Everything from `to` on waits again.
  void rewind(UnitCode to) {
    cursor_ = std::min(cursor_, to);
    returned_.erase(returned_.lower_bound(to), returned_.end());
  }

  // The first waiting unit for which `excluded` is false; exclusion applies to units that came back only.
  template <class Excluded>
  std::optional<UnitCode> front(const UnitTable& units, Excluded&& excluded) {
    for (const UnitCode code : returned_) {
      if (!excluded(code)) return code;
    }
    skip_accepted(units);
    if (cursor_ < end_ && round_of(cursor_) < window_) return cursor_;
    return std::nullopt;
  }
  bool empty(const UnitTable& units) {
    return !front(units, [](UnitCode) { return false; });
  }
  // Takes out what front() gave.
  void pop(UnitCode code) {
    if (code == cursor_)
      advance();
    else
      returned_.erase(code);
  }
  // A lent unit waits again.
  void put_back(UnitCode code) {
    if (code < end_ && code < cursor_) returned_.insert(code);
  }
  // A late result came for a unit that may be waiting.
  void forget(UnitCode code) { returned_.erase(code); }

  void skip_accepted(const UnitTable& units) {
    while (cursor_ < end_ && units.accepted(cursor_)) advance();
  }
  const std::set<UnitCode>& returned() const { return returned_; }

 private:
  void advance() {
    cursor_ = tile_of(cursor_) + 1 < tiles_ ? cursor_ + 1 : unit_code(round_of(cursor_) + 1, 0);
  }

  TileIndex tiles_;
  UnitCode cursor_ = 0;
  UnitCode end_;
  RoundIndex window_ = ~RoundIndex{0};
  std::set<UnitCode> returned_;
};

}  // namespace ls::coordinator

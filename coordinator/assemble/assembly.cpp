#include "coordinator/assemble/assembly.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <numeric>

#include "coordinator/base/limits.h"

namespace ls::coordinator {

void HealthTable::folded(TileIndex tile, RoundIndex round, const SampleRange& samples, const Health& health) {
  tails_.erase(tile);
  if (health.clean()) return;
  if (samples == round_range(round))
    full_[tile].merge(health);
  else
    tails_[tile] = health;
}

void HealthTable::discard(TileIndex tile) {
  full_.erase(tile);
  tails_.erase(tile);
}

Health HealthTable::total() const {
  Health all;
  for (const auto* of : {&full_, &tails_})
    for (const auto& [tile, health] : *of) all.merge(health);
  return all;
}

namespace {
std::string line(char kind, const std::pair<const TileIndex, Health>& tile) {
  return std::string{kind, ' '} + std::to_string(tile.first) + " " + canonical_json(tile.second) + "\n";
}
}  // namespace

// Returns the health (counts of invalid samples) of all tiles as text. It has a line "f TILE HEALTH" for each
// tile whose full rounds have invalid samples, and a line "t TILE HEALTH" for each tile whose truncated last
// round has any. HEALTH is JSON.
std::string HealthTable::save() const {
  std::string text;
  for (const auto& tile : full_) text += line('f', tile);
  for (const auto& tile : tails_) text += line('t', tile);
  return text;
}

std::string HealthTable::save_tile(TileIndex tile) const {
  const auto full = full_.find(tile), tail = tails_.find(tile);
  return (full == full_.end() ? "" : line('f', *full)) + (tail == tails_.end() ? "" : line('t', *tail));
}

std::optional<HealthTable> HealthTable::load(std::string_view text) {
  HealthTable table;
  while (!text.empty()) {
    const auto end = text.find('\n');
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    if (line.size() < 3 || (line[0] != 'f' && line[0] != 't') || line[1] != ' ') return std::nullopt;
    TileIndex tile = 0;
    const auto [stop, error] = std::from_chars(line.data() + 2, line.data() + line.size(), tile);
    if (error != std::errc() || stop == line.data() + line.size() || *stop != ' ') return std::nullopt;
    auto health = parse_health(line.substr(static_cast<std::size_t>(stop - line.data()) + 1));
    if (!health) return std::nullopt;
    (line[0] == 'f' ? table.full_ : table.tails_)[tile] = std::move(*health);
  }
  return table;
}

void UnitCosts::add(TileIndex tile, RoundIndex round, double core_seconds) {
  Tile& t = tiles_[tile];
  if (round < t.summed) {
    sum_ += core_seconds;
    return;
  }
  const std::size_t place = round - t.summed;
  if (place >= t.ahead.size()) t.ahead.resize(place + 1);
  t.ahead[place] += static_cast<float>(core_seconds);
}

double UnitCosts::until(std::span<const RoundIndex> rounds) {
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    Tile& t = tiles_[i];
    if (rounds[i] <= t.summed) continue;
    const auto end = t.ahead.begin() +
                     static_cast<std::ptrdiff_t>(std::min<std::size_t>(rounds[i] - t.summed, t.ahead.size()));
    sum_ = std::accumulate(t.ahead.begin(), end, sum_);
    t.ahead.erase(t.ahead.begin(), end);
    t.summed = rounds[i];
  }
  return sum_;
}

namespace {
std::size_t bytes_of(const WaitingPartial& w) {
  return w.partial ? w.partial->sums.size() * sizeof(float) : 0;
}
}  // namespace

void Assembly::hold(TileIndex tile, RoundIndex round, WaitingPartial waiting) {
  if (waiting.place && WaitingBytes::all() + bytes_of(waiting) > limits::kMaxPendingPartials)
    waiting.partial.reset();
  waiting_bytes_.add(bytes_of(waiting));
  auto& slot = waiting_[{tile, round}];
  waiting_bytes_.remove(bytes_of(slot));
  slot = std::move(waiting);
}

std::optional<WaitingPartial> Assembly::take(TileIndex tile, RoundIndex round, SampleRange samples) {
  const auto found = waiting_.find({tile, round});
  if (found == waiting_.end() || found->second.samples != samples) return std::nullopt;
  std::optional<WaitingPartial> taken(std::move(found->second));
  waiting_.erase(found);
  waiting_bytes_.remove(bytes_of(*taken));
  return taken;
}

template <class Unwanted>
void Assembly::forget_if(Unwanted&& unwanted) {
  std::erase_if(waiting_, [&](const auto& entry) {
    const bool gone = unwanted(entry.first.first, entry.first.second);
    if (gone) waiting_bytes_.remove(bytes_of(entry.second));
    return gone;
  });
}

void Assembly::forget_round(RoundIndex round) {
  forget_if([&](TileIndex, RoundIndex of) { return of == round; });
}

void Assembly::discard(TileIndex tile) {
  forget_if([&](TileIndex of, RoundIndex) { return of == tile; });
  film_.discard(tile);
  errors_.discard(tile);
  health_.discard(tile);
}

void Assembly::forget_waiting() {
  waiting_.clear();
  waiting_bytes_ = WaitingBytes();
}

Result<TileError> Assembly::fold(TileIndex tile, RoundIndex round, const WaitingPartial& waiting) {
  const auto error = film_.fold(tile, round, *waiting.partial, waiting.digest);
  if (!error) return error;
  errors_.folded(tile, round, *error);
  health_.folded(tile, round, waiting.samples, waiting.health);
  ++folds_since_snapshot;
  return error;
}

std::vector<RoundIndex> Assembly::rounds_for(std::uint64_t spp) const {
  std::vector<RoundIndex> rounds(film_.grid().count());
  for (TileIndex t = 0; t < rounds.size(); ++t) {
    const auto tail = film_.tail(t);
    const RoundIndex full = film_.full_rounds(t);
    rounds[t] = tail && *tail == cut_range(full, spp) ? full + 1 : full;
  }
  return rounds;
}

}  // namespace ls::coordinator

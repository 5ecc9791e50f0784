#include "coordinator/assemble/health_table.h"

#include <charconv>

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

// Returns one line for each tile that has full rounds, then one for each tile with a truncated last round
// (tail). A line is "f" or "t", the tile and its health.
std::string HealthTable::save() const {
  std::string text;
  for (const auto& [tile, health] : full_)
    text += "f " + std::to_string(tile) + " " + canonical_json(health) + "\n";
  for (const auto& [tile, health] : tails_)
    text += "t " + std::to_string(tile) + " " + canonical_json(health) + "\n";
  return text;
}

std::string HealthTable::save_tile(TileIndex tile) const {
  const auto line = [&](char kind, const std::map<TileIndex, Health>& of) {
    const auto found = of.find(tile);
    return found == of.end()
               ? std::string()
               : std::string{kind, ' '} + std::to_string(tile) + " " + canonical_json(found->second) + "\n";
  };
  return line('f', full_) + line('t', tails_);
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

}  // namespace ls::coordinator

#include "coordinator/assemble/health_book.h"

#include <charconv>

namespace ls::coordinator {

void HealthBook::folded(TileIndex tile, RoundIndex round, const SampleRange& samples, const Health& health) {
  tails_.erase(tile);
  if (health.clean()) return;
  if (samples == round_range(round))
    full_.merge(health);
  else
    tails_[tile] = health;
}

Health HealthBook::total() const {
  Health all = full_;
  for (const auto& [tile, health] : tails_) all.merge(health);
  return all;
}

// One line for the full rounds, then one for each tail: its tile and its health.
std::string HealthBook::save() const {
  std::string text = canonical_json(full_) + "\n";
  for (const auto& [tile, health] : tails_)
    text += std::to_string(tile) + " " + canonical_json(health) + "\n";
  return text;
}

std::optional<HealthBook> HealthBook::load(std::string_view text) {
  HealthBook book;
  for (bool first = true; !text.empty() || first; first = false) {
    const auto end = text.find('\n');
    if (end == std::string_view::npos) return std::nullopt;
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    TileIndex tile = 0;
    if (!first) {
      const auto [stop, error] = std::from_chars(line.data(), line.data() + line.size(), tile);
      if (error != std::errc() || stop == line.data() + line.size() || *stop != ' ') return std::nullopt;
      line.remove_prefix(static_cast<std::size_t>(stop - line.data()) + 1);
    }
    auto health = parse_health(line);
    if (!health) return std::nullopt;
    (first ? book.full_ : book.tails_[tile]) = std::move(*health);
  }
  return book;
}

}  // namespace ls::coordinator

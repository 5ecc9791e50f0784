#include "coordinator/assemble/round_errors.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace ls::coordinator {
namespace {

// `rounds` has pairs of a round and its value, with ascending rounds. Sets the value of `round`, and removes
// all later rounds.
template <class T>
void put_round(RoundIndex round, T value, std::vector<std::pair<RoundIndex, T>>& rounds) {
  while (!rounds.empty() && rounds.back().first >= round) rounds.pop_back();
  rounds.emplace_back(round, std::move(value));
}

// Drops the entries of one tile that no later checkpoint needs. `rounds` is ascending. A later checkpoint has
// at least `next` rounds of the tile, that is, the rounds before `next`. So it needs the latest entry before
// `next`, or a later one.
template <class T>
void drop_rounds_before(RoundIndex next, std::vector<std::pair<RoundIndex, T>>& rounds) {
  const auto later = std::ranges::find_if(rounds, [&](const auto& r) { return r.first >= next; });
  if (later - rounds.begin() > 1) rounds.erase(rounds.begin(), later - 1);
}

}  // namespace

void RoundErrors::folded(TileIndex tile, RoundIndex round, const TileError& error) {
  Tile& t = tiles_[tile];
  put_round(round, error, t.rounds);
  if (!keep_relative_) return;
  t.relative.resize(round + 1);
  t.relative[round] = error.relative.squares;
}

TileError RoundErrors::at(std::span<const RoundIndex> rounds) const {
  TileError sum;
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    const Tile& t = tiles_[i];
    const TileError* last = t.rounds.empty() ? nullptr : &t.rounds.front().second;
    for (const auto& [r, error] : t.rounds)
      if (r < rounds[i]) last = &error;
    if (last) sum.add(*last);
  }
  return sum;
}

bool RoundErrors::knows(std::span<const RoundIndex> rounds) const {
  for (std::size_t i = 0; i < tiles_.size(); ++i)
    if (rounds[i] > 0 && (tiles_[i].rounds.empty() || tiles_[i].rounds.front().first >= rounds[i]))
      return false;
  return true;
}

void RoundErrors::checkpoint_taken(std::span<const RoundIndex> rounds) {
  for (std::size_t i = 0; i < tiles_.size(); ++i) drop_rounds_before(rounds[i], tiles_[i].rounds);
}

std::vector<std::vector<double>> RoundErrors::relative() const {
  std::size_t rounds = 0;
  for (const Tile& t : tiles_) rounds = std::max(rounds, t.relative.size());
  std::vector<std::vector<double>> all(rounds, std::vector<double>(tiles_.size()));
  for (std::size_t i = 0; i < tiles_.size(); ++i)
    for (std::size_t r = 0; r < tiles_[i].relative.size(); ++r) all[r][i] = tiles_[i].relative[r];
  return all;
}

namespace {
static_assert(std::is_trivially_copyable_v<TileError>);

// Reads values from the front of `bytes`. holds() checks whether as many values as a count promises are
// there. Callers check each count with it before they allocate memory, so a damaged count does no harm.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  template <class T>
  bool get(T& value) {
    if (bytes_.size() < sizeof(T)) return false;
    std::memcpy(&value, bytes_.data(), sizeof(T));
    bytes_ = bytes_.subspan(sizeof(T));
    return true;
  }
  bool holds(std::uint64_t count, std::size_t size) const { return count <= bytes_.size() / size; }
  bool empty() const { return bytes_.empty(); }

 private:
  std::span<const std::byte> bytes_;
};
}  // namespace

// Returns the errors of one tile as bytes: u32 count, then {u32 round, TileError} of each kept round; u32
// count, then the relative error sums as doubles. Only builds with the same memory layout can read these
// bytes; a snapshot contains the name of its format, so that other builds reject it.
std::vector<std::byte> RoundErrors::save_tile(TileIndex tile) const {
  const Tile& t = tiles_[tile];
  std::vector<std::byte> out;
  append_value(out, static_cast<std::uint32_t>(t.rounds.size()));
  for (const auto& [round, error] : t.rounds) {
    append_value(out, round);
    append_value(out, error);
  }
  append_value(out, static_cast<std::uint32_t>(t.relative.size()));
  for (const double r : t.relative) append_value(out, r);
  return out;
}

namespace {
// Reads the errors of one tile from the front of `in`. False: the bytes are damaged.
template <class Rounds>
bool read_tile(Reader& in, Rounds& rounds, std::vector<double>& relative) {
  std::uint32_t count = 0;
  if (!in.get(count) || !in.holds(count, sizeof(RoundIndex) + sizeof(TileError))) return false;
  rounds.resize(count);
  for (auto& [round, error] : rounds)
    if (!in.get(round) || !in.get(error)) return false;
  if (!in.get(count) || !in.holds(count, sizeof(double))) return false;
  relative.resize(count);
  return std::all_of(relative.begin(), relative.end(), [&](double& r) { return in.get(r); });
}
}  // namespace

Result<void> RoundErrors::load_tile(TileIndex tile, std::span<const std::byte> bytes) {
  Reader in(bytes);
  if (tile >= tiles_.size() || !read_tile(in, tiles_[tile].rounds, tiles_[tile].relative) || !in.empty())
    return fail(Errc::invalid_argument, "saved error figures are damaged");
  return {};
}

ReferenceTiles::ReferenceTiles(const Film& film) : tiles_(film.grid().count()) {
  for (TileIndex t = 0; t < tiles_.size(); ++t) {
    tiles_[t].rect = film.grid().rect(t);
    if (const RoundIndex rounds = film.rounds_folded(t); rounds > 0) folded(t, rounds - 1, film);
  }
}

void ReferenceTiles::folded(TileIndex tile, RoundIndex round, const Film& film) {
  const TilePixels pixels = film.pixels(tile);
  Picture rgb = std::make_shared<const std::vector<float>>(pixels.mean.begin(), pixels.mean.end());
  put_round(round, std::move(rgb), tiles_[tile].rounds);
}

std::optional<std::vector<TilePicture>> ReferenceTiles::at(std::span<const RoundIndex> rounds) const {
  std::vector<TilePicture> out;
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    TilePicture found{tiles_[t].rect, nullptr};
    for (const auto& [round, rgb] : tiles_[t].rounds)
      if (round < rounds[t]) found.rgb = rgb;
    if (!found.rgb) return std::nullopt;
    out.push_back(std::move(found));
  }
  return out;
}

std::optional<std::vector<TilePicture>> ReferenceTiles::latest() const {
  return at(std::vector<RoundIndex>(tiles_.size(), std::numeric_limits<RoundIndex>::max()));
}

void ReferenceTiles::checkpoint_taken(std::span<const RoundIndex> rounds) {
  for (std::size_t t = 0; t < tiles_.size(); ++t) drop_rounds_before(rounds[t], tiles_[t].rounds);
}

std::vector<float> joined(const std::vector<TilePicture>& tiles, FrameSize frame) {
  const auto width = static_cast<std::size_t>(frame.width);
  std::vector<float> out(3 * width * static_cast<std::size_t>(frame.height));
  for (const TilePicture& tile : tiles) {
    const auto row = 3 * static_cast<std::size_t>(tile.rect.width());
    auto from = tile.rgb->begin();
    for (int y = tile.rect.y0; y < tile.rect.y1; ++y, from += static_cast<std::ptrdiff_t>(row))
      std::copy_n(from, row,
                  &out[3 * (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(tile.rect.x0))]);
  }
  return out;
}

}  // namespace ls::coordinator

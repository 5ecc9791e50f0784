#include "coordinator/assemble/round_errors.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace ls::coordinator {

void RoundErrors::folded(TileIndex tile, RoundIndex round, const TileError& error) {
  Tile& t = tiles_[tile];
  while (!t.rounds.empty() && t.rounds.back().first >= round) t.rounds.pop_back();
  t.rounds.emplace_back(round, error);
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

template <class T>
void put(std::vector<std::byte>& out, const T& value) {
  const std::size_t at = out.size();
  out.resize(at + sizeof value);
  std::memcpy(&out[at], &value, sizeof value);
}

// Reads values from `bytes`. It never allocates more memory than the size of `bytes`, whatever counts they
// contain.
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
// bytes. A snapshot contains the name of its format, and other builds ignore it.
std::vector<std::byte> RoundErrors::save_tile(TileIndex tile) const {
  const Tile& t = tiles_[tile];
  std::vector<std::byte> out;
  put(out, static_cast<std::uint32_t>(t.rounds.size()));
  for (const auto& [round, error] : t.rounds) {
    put(out, round);
    put(out, error);
  }
  put(out, static_cast<std::uint32_t>(t.relative.size()));
  for (const double r : t.relative) put(out, r);
  return out;
}

namespace {
// Reads the errors of one tile from the front of `in`, and removes them from `in`.
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

tl::unexpected<Error> damaged() { return fail(Errc::invalid_argument, "saved error figures are damaged"); }
}  // namespace

Result<void> RoundErrors::load_tile(TileIndex tile, std::span<const std::byte> bytes) {
  Reader in(bytes);
  if (tile >= tiles_.size() || !read_tile(in, tiles_[tile].rounds, tiles_[tile].relative) || !in.empty())
    return damaged();
  return {};
}

}  // namespace ls::coordinator

// Writes and reads a tile of the film as bytes, from which the coordinator restores the film after a restart.
// A round is a range of samples; the tail is a last round with fewer samples than its full range (film.h).
// The bytes are, little-endian:
// - "LSTILE05"; u32 index of the tile; u32 number of full rounds; 32 bytes: digest chain of the full rounds;
// - u64 s0, u64 s1: range of the tail's samples (0, 0: no tail); 32 bytes: digest of the tail;
// - f64 skew; f64 other_weights; 3 f64 plain.changes; 3 f64 relative.changes; 3 f64 areas.last; u64
// areas.fewest_before, which of one tile is areas.most_before, too: members of TileError. Only
// these members are stored, since they depend on the tile as it was before its last round. The others are
// computed again from the sums;
// - the full rounds: 6 colour planes and the planes of AOV sums as doubles, then the planes of identifiers as
// floats;
// - the tail, if there is one: the same planes, all as floats;
// - SHA-256 of all bytes before it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include "core/base/bytes.h"
#include "core/image/film/film.h"

namespace ls {
namespace {

constexpr std::string_view kTileMagic = "LSTILE05";

class Writer {
 public:
  explicit Writer(std::string_view magic) { put(std::as_bytes(std::span(magic))); }
  void put(std::span<const std::byte> raw) { bytes_.insert(bytes_.end(), raw.begin(), raw.end()); }
  template <class... T>
  void values(const T&... v) {
    (put(std::as_bytes(std::span(&v, 1))), ...);
  }
  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  std::vector<std::byte> close() {
    values(sha256(std::span<const std::byte>(bytes_)).bytes);
    return std::move(bytes_);
  }

 private:
  std::vector<std::byte> bytes_;
};

tl::unexpected<Error> damaged(std::string_view what) {
  return bad_argument(fmt::format("saved film: {}; render again from the partials", what));
}

// Checks the magic and the checksum, and returns a reader of the bytes in between.
Result<ByteReader> open_saved(std::span<const std::byte> bytes, std::string_view magic) {
  if (bytes.size() < magic.size() + 32) return damaged("cut off");
  if (!as_text(bytes).starts_with(magic))
    return damaged(fmt::format("does not begin with {} (another version?)", magic));
  const auto body = bytes.first(bytes.size() - 32);
  if (std::memcmp(sha256(body).bytes.data(), bytes.data() + body.size(), 32) != 0)
    return damaged("its checksum is wrong");
  return ByteReader(body.subspan(magic.size()));
}

template <class T>
bool read_finite(ByteReader& in, std::vector<T>& out, std::size_t count) {
  const auto raw = in.bytes(count * sizeof(T));
  if (!raw) return false;
  out.resize(count);
  if (count > 0) std::memcpy(out.data(), raw->data(), raw->size());
  return std::all_of(out.begin(), out.end(), [](T v) { return std::isfinite(v); });
}

bool sound(const ChangeSums& sums) {
  return sums.squares >= 0 && std::isfinite(sums.squares) && sums.products >= 0 &&
         std::isfinite(sums.products) && sums.square_products >= 0 && std::isfinite(sums.square_products);
}

}  // namespace

std::vector<std::byte> Film::tile_bytes(const Tile* tile, TileIndex index) {
  if (!tile) return {};
  Writer out(kTileMagic);
  out.reserve(256 + tile->sums.size() * sizeof(double) + tile->ids.size() * sizeof(float) +
              (tile->tail ? tile->tail->sums.size() * sizeof(float) : 0));
  const Tail tail = tile->tail.value_or(Tail{});
  out.values(index, tile->full_rounds, tile->chain.bytes, tail.samples.s0, tail.samples.s1, tail.digest.bytes,
             tile->error.skew, tile->error.other_weights, tile->error.plain.changes,
             tile->error.relative.changes, tile->error.areas.last, tile->error.areas.fewest_before);
  out.put(std::as_bytes(std::span(tile->sums)));
  out.put(std::as_bytes(std::span(tile->ids)));
  out.put(std::as_bytes(std::span(tail.sums)));
  return out.close();
}

Result<std::shared_ptr<const Film::Tile>> Film::parse_tile(TileIndex index,
                                                           std::span<const std::byte> bytes) const {
  auto opened = open_saved(bytes, kTileMagic);
  if (!opened) return tl::unexpected(opened.error());
  ByteReader& in = *opened;
  // Reads the next bytes into the given variables, one after the other. If the bytes end early, the remaining
  // variables become zero. This needs no error here, because reading the sums will then fail as well.
  const auto read = [&]<class... T>(T&... to) { ((to = in.take<T>().value_or(T{})), ...); };
  TileIndex stored = 0;
  auto tile = std::make_shared<Tile>();
  Tail tail;
  double skew = 0, other_weights = 0;
  ChangeSums plain, relative;
  ChannelSums last{};
  std::uint64_t before = 0;
  read(stored, tile->full_rounds, tile->chain.bytes, tail.samples.s0, tail.samples.s1, tail.digest.bytes,
       skew, other_weights, plain, relative, last, before);
  if (stored != index) return damaged(fmt::format("it is not tile {}", index));
  const bool has_tail = tail.samples.s1 != 0;
  const PixelRect rect = grid_.rect(index);
  const auto pixels = static_cast<std::size_t>(rect.pixels()), sums = pixels * planes_.sums,
             ids = pixels * planes_.ids;
  if (!std::isfinite(skew) || !std::isfinite(other_weights) || !sound(plain) || !sound(relative) ||
      !std::all_of(last.begin(), last.end(), [](double v) { return std::isfinite(v); }) ||
      !read_finite(in, tile->sums, sums) || !read_finite(in, tile->ids, ids) ||
      (has_tail && !read_finite(in, tail.sums, sums + ids)) || in.left() != 0)
    return damaged(fmt::format("tile {} has the wrong size or a value that is not finite", index));
  const SampleRange full = round_range(tile->full_rounds);
  if (has_tail && (tail.samples.s0 != full.s0 || tail.samples.s1 <= full.s0 || tail.samples.s1 >= full.s1))
    return damaged(fmt::format("tile {} has an impossible last round", index));
  if (!has_tail && tile->full_rounds == 0) return damaged(fmt::format("tile {} has no rounds", index));
  if (has_tail) tile->tail = std::move(tail);
  tile->error = estimate(*tile, nullptr, rect, grid_.meters);
  tile->error.subtract_skew(skew);
  tile->error.other_weights = other_weights;
  tile->error.plain.changes = plain;
  tile->error.relative.changes = relative;
  tile->error.areas.last = last;
  tile->error.areas.fewest_before = tile->error.areas.most_before = before;
  return tile;
}

std::vector<std::byte> Film::save_tile(TileIndex tile) const { return tile_bytes(tiles_[tile].get(), tile); }

std::function<std::vector<std::byte>()> Film::saver(TileIndex index) const {
  return [tile = tiles_[index], index] { return tile_bytes(tile.get(), index); };
}

Result<void> Film::load_tile(TileIndex index, std::span<const std::byte> bytes) {
  if (index >= tiles_.size())
    return bad_argument(fmt::format("tile {} does not exist; the film has {}", index, tiles_.size()));
  if (bytes.empty()) {
    discard(index);
    return {};
  }
  auto tile = parse_tile(index, bytes);
  if (!tile) return tl::unexpected(tile.error());
  tiles_[index] = std::move(*tile);
  return {};
}

}  // namespace ls

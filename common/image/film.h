// The film: per-pixel double sums of both halves (A: even sample indices, B: odd ones) of every tile, folded
// round by round in order. Its pixels are a function of the partials alone, not of when or in what order they
// came.
//
// A round that is shorter than its full range (the last one of a job) is a tile's *tail*: it is kept beside
// the sums, counts in everything that is read, and is replaced when a longer range of the same round comes.
// So an N-sample film that is continued to 2N has the bits of a 2N film rendered at once.
//
// AOVs are folded alike: sums in double, identifiers by the rule of id_slots.h.
//
// Not thread-safe: the caller locks. Copies are cheap (tiles are immutable and shared; a fold makes a new
// one): copy under the lock, read or write files outside it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/image/error_estimate.h"
#include "common/image/frame.h"
#include "common/image/partial.h"
#include "common/image/rounds.h"

namespace ls {

// One tile's pixels as they stand; interleaved R, G, B, row by row.
struct TilePixels {
  PixelRect rect;
  std::uint64_t spp = 0;
  std::vector<double> mean;            // (sumA + sumB) / (nA + nB); zero if spp is 0
  std::vector<double> standard_error;  // |A - B| / 2 of the half means
};

// One tile's AOVs as they stand.
struct TileAovs {
  PixelRect rect;
  std::uint64_t spp = 0;
  std::vector<double> sums;  // planes_of(aovs).sums, planar; zero if spp is 0
  std::vector<float> ids;    // kIdPlanes planes of each of planes_of(aovs).ids
};

class Film {
 public:
  explicit Film(TileGrid grid, AovSet aovs = {});

  const TileGrid& grid() const { return grid_; }
  AovSet aovs() const { return aovs_; }

  // Folds round `round` of tile `tile`. Rounds come in order 0, 1, 2, ... per tile; a cut round only as the
  // last.
  //   invalid_argument: the partial is not of this tile or round;
  //   failed_precondition: an earlier round is missing (the message says which is next);
  //   already_exists: this round, or more of it, is folded already. The film is unchanged by any error.
  // `digest` is unit_digest(partial), where the caller has it already.
  Result<TileError> fold(TileIndex tile, RoundIndex round, const Partial& partial);
  Result<TileError> fold(TileIndex tile, RoundIndex round, const Partial& partial, const Digest& digest);

  // Forgets a tile (a worker lied): it starts again from round 0.
  void discard(TileIndex tile) { tiles_[tile] = nullptr; }

  // ---- one tile ----
  RoundIndex full_rounds(TileIndex tile) const;  // complete rounds; also the index of the next round to fold
  RoundIndex rounds_folded(TileIndex tile) const;  // the same, and one more if there is a tail
  std::optional<SampleRange> tail(TileIndex tile) const;
  std::uint64_t spp(TileIndex tile) const;
  TileError error(
      TileIndex tile) const;  // as of the last fold; zeros (and its pixel count) if there was none
  // SHA-256 chain over the unit digests in round order: c = SHA-256(c || unit digest), beginning with 32 zero
  // bytes.
  Digest tile_digest(TileIndex tile) const;
  TilePixels pixels(TileIndex tile) const;
  TileAovs aov_pixels(TileIndex tile) const;
  // Of A and of B: R, G, B planes, as HalfMeans wants them; empty if there is no sample.
  std::array<std::vector<double>, 2> half_means(TileIndex tile) const;

  // ---- the image ----
  std::uint64_t samples() const;       // over all pixels
  std::uint64_t memory_bytes() const;  // of the sums and identifiers
  // Over all tiles that have a sample, in tile order: what is not there has no error that could be told.
  TileError error() const;
  std::uint64_t pixels_without_samples() const;

  // One row of tiles as a film of its own, with the same tiles: for what is made of an image band by band.
  Film row(int row) const;

  // ---- restart ----
  // Versioned, closed by a SHA-256; whole or one tile at a time (no bytes: nothing folded). Loading refuses
  // damaged or foreign bytes.
  std::vector<std::byte> save() const;
  static Result<Film> load(std::span<const std::byte> bytes);
  std::vector<std::byte> save_tile(TileIndex tile) const;
  // save_tile() of the tile as it is now, to be called later: it holds that one tile, where a copy of the
  // film would hold all that are folded meanwhile.
  std::function<std::vector<std::byte>()> saver(TileIndex tile) const;
  Result<void> load_tile(TileIndex tile, std::span<const std::byte> bytes);

  bool operator==(const Film& other) const;  // same grid, AOVs, and bits in every tile

 private:
  struct Tail {
    SampleRange samples;
    Digest digest;
    std::vector<float> sums;
    bool operator==(const Tail&) const = default;
  };
  struct Tile {
    RoundIndex full_rounds = 0;
    Digest chain;              // over the full rounds
    std::vector<double> sums;  // planes as in Partial, but for identifiers, of the full rounds
    std::vector<float> ids;    // those, likewise
    std::optional<Tail> tail;
    TileError error;                 // with the tail
    std::uint64_t full_spp() const;  // of the full rounds
    std::uint64_t spp() const;
    bool operator==(const Tile&) const = default;
  };
  // Sums with the tail, or of the full rounds alone; R, G, B planes of A and of B.
  static std::array<std::vector<double>, 2> halves(const Tile& tile, std::size_t pixels,
                                                   bool with_tail = true);
  static std::array<std::vector<double>, 2> means(const Tile& tile, std::size_t pixels,
                                                  bool with_tail = true);
  // `before`: its full rounds are what stood before the tile's last round; null: not known any more.
  static TileError estimate(const Tile& tile, const Tile* before, const PixelRect& rect);
  Result<void> accepts(TileIndex tile, RoundIndex round, const Partial& partial) const;
  static std::vector<std::byte> tile_bytes(const Tile* tile, TileIndex index);
  Result<std::shared_ptr<const Tile>> parse_tile(TileIndex tile, std::span<const std::byte> bytes) const;

  // How many planes are sums and identifiers, those of the colour among them.
  struct Planes {
    std::size_t sums, ids;
  };

  TileGrid grid_;
  AovSet aovs_;
  Planes planes_;
  std::vector<std::shared_ptr<const Tile>> tiles_;  // null: nothing folded yet
};

}  // namespace ls

// The film: per-pixel sums of every tile in double, separately for two halves (A: even sample indices, B: odd
// ones). Folding adds a partial (the pixel sums of one tile and one round, a range of samples) to them. The
// rounds of a tile are folded in order, so the film's pixels depend only on the partials, not on when or in
// which order they arrived.
//
// The last round of a job may have fewer samples than its full range. Such a round is a tile's *tail*: the
// film keeps it beside the sums and includes it in all results. When a longer version of the round arrives,
// it replaces the tail. So an N-sample film that is later continued to 2N samples has the same bits as a film
// rendered with 2N samples from the start.
//
// AOVs are folded likewise: sums in double, identifiers by the rule of identifiers.h.
//
// Not thread-safe: the caller locks. Copies are cheap, since they share the tiles; a tile never changes, and
// a fold makes a new one. So copy the film under the lock, and read or write files outside it.
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
#include "common/image/error/error_estimate.h"
#include "common/image/film/partial.h"
#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"

namespace ls {

// The current pixels of one tile: R, G, B of each pixel, row by row.
struct TilePixels {
  PixelRect rect;
  std::uint64_t spp = 0;
  std::vector<double> mean;            // (sumA + sumB) / (nA + nB); zero if spp is 0
  std::vector<double> standard_error;  // |A - B| / 2 of the half means
};

// The current AOVs of one tile.
struct TileAovs {
  PixelRect rect;
  std::uint64_t spp = 0;
  std::vector<double> sums;  // the planes of planes_of(aovs).sums; zero if spp is 0
  std::vector<float> ids;    // kIdPlanes planes for each of planes_of(aovs).ids
};

class Film {
 public:
  explicit Film(TileGrid grid, AovSet aovs = {});

  const TileGrid& grid() const { return grid_; }
  AovSet aovs() const { return aovs_; }

  // Folds `partial`: adds the pixel sums of one round of one tile to the film. The rounds of a tile must come
  // in the order 0, 1, 2, ... Only the last one may be truncated; a longer version of it replaces it.
  // invalid_argument: the partial is not of this tile or round; failed_precondition: an earlier round is
  // missing (the message names the next one); already_exists: the film has these samples of the round. On
  // error the film is unchanged. Callers that have computed unit_digest(partial) pass it as `digest`.
  Result<TileError> fold(TileIndex tile, RoundIndex round, const Partial& partial);
  Result<TileError> fold(TileIndex tile, RoundIndex round, const Partial& partial, const Digest& digest);

  // Removes all samples of a tile, because a worker sent wrong results. The tile starts again from round 0.
  void discard(TileIndex tile) { tiles_[tile] = nullptr; }

  // Figures of one tile.

  // The number of complete rounds in the sums, which is the index of the next round to fold.
  RoundIndex full_rounds(TileIndex tile) const;
  RoundIndex rounds_folded(TileIndex tile) const;  // full_rounds(), plus one if there is a tail
  std::optional<SampleRange> tail(TileIndex tile) const;
  std::uint64_t spp(TileIndex tile) const;
  // The error after the last fold. Before the first fold it has the number of pixels and is otherwise 0.
  TileError error(TileIndex tile) const;
  // Returns the digest of the chain of all folded rounds, the tail included. It starts as 32 zero bytes; each
  // round changes the digest c to SHA-256(c || unit digest).
  Digest tile_digest(TileIndex tile) const;
  TilePixels pixels(TileIndex tile) const;
  TileAovs aov_pixels(TileIndex tile) const;
  // Returns the half means of A and of B as R, G, B planes, for HalfMeans; empty if there are no samples.
  std::array<std::vector<double>, 2> half_means(TileIndex tile) const;

  // Figures of the image.
  std::uint64_t samples() const;       // number of samples of all pixels together
  std::uint64_t memory_bytes() const;  // memory taken by the sums and identifiers
  // Returns the sum of the errors of all tiles with samples, in tile order.
  TileError error() const;
  std::uint64_t pixels_without_samples() const;

  // Returns one row of tiles as a film that shares these tiles, for outputs that are made row by row.
  Film row(int row) const;

  // Saving and loading, for a restart of the coordinator.

  // Returns the tile as bytes, with a version and a SHA-256 at the end; nothing for a tile without samples.
  // load_tile() rejects bytes that are damaged, or of another tile or version.
  std::vector<std::byte> save_tile(TileIndex tile) const;
  // Takes a snapshot of the tile. The returned function may be called later, and returns what save_tile()
  // would return now. It keeps only this tile in memory, whereas a copy of the film would keep all tiles.
  std::function<std::vector<std::byte>()> saver(TileIndex tile) const;
  Result<void> load_tile(TileIndex tile, std::span<const std::byte> bytes);

  bool operator==(const Film& other) const;  // compares grid, AOVs, and the bits of every tile

 private:
  struct Tail {
    SampleRange samples;
    Digest digest;
    std::vector<float> sums;
    bool operator==(const Tail&) const = default;
  };
  struct Tile {
    RoundIndex full_rounds = 0;
    Digest chain;              // digest chain over the full rounds
    std::vector<double> sums;  // sums of the full rounds: planes as in Partial, without identifiers
    std::vector<float> ids;    // identifiers of the full rounds
    std::optional<Tail> tail;
    TileError error;                 // error of the full rounds and the tail
    std::uint64_t full_spp() const;  // samples per pixel of the full rounds
    std::uint64_t spp() const;
    bool operator==(const Tile&) const = default;
  };
  // Returns the sums of the full rounds, with or without the tail, as R, G, B planes of A and of B.
  static std::array<std::vector<double>, 2> halves(const Tile& tile, std::size_t pixels,
                                                   bool with_tail = true);
  static std::array<std::vector<double>, 2> means(const Tile& tile, std::size_t pixels,
                                                  bool with_tail = true);
  // Estimates the error of a tile. `before` is the same tile before its last round; null if that is not
  // available.
  static TileError estimate(const Tile& tile, const Tile* before, const PixelRect& rect);
  Result<void> accepts(TileIndex tile, RoundIndex round, const Partial& partial) const;
  static std::vector<std::byte> tile_bytes(const Tile* tile, TileIndex index);
  Result<std::shared_ptr<const Tile>> parse_tile(TileIndex tile, std::span<const std::byte> bytes) const;

  // Number of planes of sums (including colour) and of identifiers.
  struct Planes {
    std::size_t sums, ids;
  };

  TileGrid grid_;
  AovSet aovs_;
  Planes planes_;
  std::vector<std::shared_ptr<const Tile>> tiles_;  // null: no round of the tile is folded yet
};

}  // namespace ls

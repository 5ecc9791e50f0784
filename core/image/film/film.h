// The film: per-pixel sums of every tile in double, separately for two halves (A: even sample indices, B: odd
// ones). Workers send partials; a partial is the pixel sums of one tile and one round. To fold a partial is
// to add it to the film. The rounds of a tile are folded in order, so the film's pixels depend only on the
// partials, not on when or in which order they arrived.
//
// The last round of a job may have fewer samples than its full range. Such a round is a tile's *tail*: the
// film keeps it beside the sums and includes it in all results. When a longer version of the round arrives,
// it replaces the tail. So an N-sample film that is later continued to 2N samples has the same bits as a film
// rendered with 2N samples from the start.
//
// AOVs are folded likewise: most AOVs are sums in double (sum planes); AOVs of identifiers have kIdPlanes
// planes each (identifier planes), which are combined by the rule of identifiers.h.
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

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/light/light_mix.h"
#include "core/image/error/error_estimate.h"
#include "core/image/film/partial.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"

namespace ls {

// The current pixels of one tile: R, G, B of each pixel, row by row.
struct TilePixels {
  PixelRect rect;
  std::uint64_t spp = 0;
  std::vector<double> mean;            // mean of all samples; 0 if spp is 0
  std::vector<double> standard_error;  // |A - B| / 2, where A and B are the means of the two halves
};

// The current AOVs of one tile.
struct TileAovs {
  PixelRect rect;
  std::uint64_t spp = 0;
  // The planes of sums, in the order of planes_of(aovs), those of slices included; 0 if spp is 0.
  std::vector<double> sums;
  RoundIndex rounds = 0;  // number of rounds in these sums
  // The identifier planes: kIdPlanes for each AOV in planes_of(aovs).ids.
  std::vector<float> ids;
};

class Film {
 public:
  explicit Film(TileGrid grid, AovSet aovs = {});

  const TileGrid& grid() const { return grid_; }
  AovSet aovs() const { return aovs_; }

  // Folds `partial`: adds the pixel sums of one round of one tile to the film. The rounds of a tile must come
  // in the order 0, 1, 2, ... Only the last round may be truncated; when a longer version of it is folded,
  // that version replaces it. invalid_argument: the partial does not belong to this tile and round;
  // failed_precondition: an earlier round is missing (the message names the round that must come next);
  // already_exists: the film already has all samples of the partial. On error the film is unchanged. A caller
  // that already knows unit_digest(partial) can pass it as `digest`, to save computing it again.
  Result<TileError> fold(TileIndex tile, RoundIndex round, const Partial& partial);
  Result<TileError> fold(TileIndex tile, RoundIndex round, const Partial& partial, const Digest& digest);

  // Removes all samples of a tile, because a worker sent wrong results. The tile starts again from round 0.
  void discard(TileIndex tile) { tiles_[tile] = nullptr; }

  // Properties of one tile.

  // Returns the number of complete rounds in the sums. This is also the index of the next round to fold.
  RoundIndex full_rounds(TileIndex tile) const;
  RoundIndex rounds_folded(TileIndex tile) const;  // full_rounds(), plus one if there is a tail
  std::optional<SampleRange> tail(TileIndex tile) const;
  std::uint64_t spp(TileIndex tile) const;
  // Returns the error estimate as of the last fold. Before the first fold, its member `pixels` is set and all
  // others are 0.
  TileError error(TileIndex tile) const;
  // Returns a digest of all folded rounds, the tail included. It is a chain: it starts as 32 zero bytes, and
  // each round replaces the digest c by SHA-256 of c followed by unit_digest(partial).
  Digest tile_digest(TileIndex tile) const;
  TilePixels pixels(TileIndex tile) const;
  TileAovs aov_pixels(TileIndex tile) const;
  // Returns the mean of half A and the mean of half B of every pixel. Each is a list of values in the form of
  // HalfMeans: planes R, G, B. Both lists are empty if the tile has no samples.
  std::array<std::vector<double>, 2> half_means(TileIndex tile) const;

  // Properties of the whole image.
  std::uint64_t samples() const;       // total number of samples of all pixels
  std::uint64_t memory_bytes() const;  // memory for the pixel sums and identifiers of all tiles
  // Returns the sum of the errors of all tiles with samples, in tile order.
  TileError error() const;
  std::uint64_t pixels_without_samples() const;

  // Returns row number `row` of the tiles (0: the top) as a film of its own, which shares the tiles with this
  // film. Outputs that are written in bands use it.
  Film row(int row) const;

  // Returns the film with another colour: the sum over the light groups of their light times these factors,
  // one for each group. The AOVs of light groups and the slices of a deep image are left out; the digests of
  // tiles stay those of the samples. Without the AOV volume_light_groups, the factors `surface` apply to all
  // light. The film must have the AOV light_groups.
  Film mixed(std::span<const GroupFactors> factors) const;

  // Saving and loading of tiles, so that a job continues after a restart of the coordinator.

  // Returns the tile as bytes, which begin with a version and end with a SHA-256; no bytes if the tile has no
  // samples. load_tile() rejects bytes that are damaged, or of another tile or version.
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
    Digest chain;  // tile_digest() of the full rounds, without the tail
    // Colour planes and sum planes of the full rounds, in the order of Partial::sums.
    std::vector<double> sums;
    std::vector<float> ids;  // identifier planes of the full rounds
    std::optional<Tail> tail;
    TileError error;                 // error estimate from the full rounds and the tail
    std::uint64_t full_spp() const;  // samples per pixel of the full rounds
    std::uint64_t spp() const;
    bool operator==(const Tile&) const = default;
  };
  // Returns the colour sums of the two halves, A and B, each as planes R, G, B. They cover the full rounds
  // and, if `with_tail`, the tail. means() returns the same divided by the number of samples.
  static std::array<std::vector<double>, 2> halves(const Tile& tile, std::size_t pixels,
                                                   bool with_tail = true);
  static std::array<std::vector<double>, 2> means(const Tile& tile, std::size_t pixels,
                                                  bool with_tail = true);
  // Estimates the error of a tile. `before` is the same tile before its last round was folded; null: unknown.
  static TileError estimate(const Tile& tile, const Tile* before, const PixelRect& rect, bool meters);
  Result<void> accepts(TileIndex tile, RoundIndex round, const Partial& partial) const;
  static std::vector<std::byte> tile_bytes(const Tile* tile, TileIndex index);
  Result<std::shared_ptr<const Tile>> parse_tile(TileIndex tile, std::span<const std::byte> bytes) const;

  // Number of sum planes, including the six of colour, and number of identifier planes.
  struct Planes {
    std::size_t sums, ids;
  };

  TileGrid grid_;
  AovSet aovs_;
  Planes planes_;
  // One per tile of the grid; null: no round of the tile is folded yet.
  std::vector<std::shared_ptr<const Tile>> tiles_;
};

}  // namespace ls

// `lightshaft verify`: renders tiles of a finished image again and compares them with the image.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/job/sealed_image.h"
#include "worker/render/render.h"

namespace ls::cli {

struct VerifiedTile {
  TileIndex tile = 0;
  PixelRect rect;
  std::uint64_t spp = 0;
  // True if verification was interrupted before the tile was rendered: its result is unknown.
  bool stopped = false;
  TileError error;      // error of the tile, estimated from its samples
  std::string problem;  // empty: the digest and all layers match

  bool wrong() const { return !problem.empty(); }
};

// Returns `count` distinct tiles from 0 to `all` - 1, or all of them if there are fewer, in ascending order.
// The choice is a function of `seed`.
std::vector<TileIndex> random_tiles(TileIndex all, std::uint64_t count, std::uint64_t seed);

// Renders all rounds (ranges of samples) of the tile again. Compares the hash chain over the rounds' digests
// with the chain stored in the image, and the values in every layer with the image's. The world must have
// been built from the image's scene and settings.
VerifiedTile verify_tile(const render::World& world, const SealedImage& image, TileIndex tile,
                         const std::atomic<bool>& stop);

// Returns, as "header NAME", the headers in the image that contradict its settings or the names in the scene.
// If `tiles` has all tiles of the image, also returns headers that contradict the tiles' samples. Only the
// seal (the digests of all layers and headers) protects the other headers (seconds, health, ...).
std::vector<std::string> wrong_headers(const SealedImage& image, const CryptomatteManifests& names,
                                       const std::vector<VerifiedTile>& tiles);

}  // namespace ls::cli

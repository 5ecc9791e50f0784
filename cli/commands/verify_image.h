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
  bool stopped = false;  // interrupted before it was rendered: not verified
  TileError error;       // estimated from its samples
  std::string problem;   // empty: the digest and all layers match

  bool wrong() const { return !problem.empty(); }
};

// `count` distinct tiles, or all if there are fewer, in ascending order; a function of the seed.
std::vector<TileIndex> random_tiles(TileIndex all, std::uint64_t count, std::uint64_t seed);

// Renders all rounds of the tile and compares the chain over its units' digests with the one sealed in the
// image, and its values in every layer with those of the image. The world must be that of the image's scene
// and settings.
VerifiedTile verify_tile(const render::World& world, const SealedImage& image, TileIndex tile,
                         const std::atomic<bool>& stop);

// Headers that contradict the settings, the names of the scene or, if `tiles` has all of the image's, their
// samples: "header NAME". The others (seconds, health, ...) are protected by the seal only.
std::vector<std::string> wrong_headers(const SealedImage& image, const CryptomatteManifests& names,
                                       const std::vector<VerifiedTile>& tiles);

}  // namespace ls::cli

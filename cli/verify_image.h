// `lightshaft verify`: tiles of a finished image, rendered again and compared with what the image says of
// them.
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
  bool stopped = false;  // before it was rendered: nothing is known of it
  TileError error;       // as its samples tell it
  std::string problem;   // empty: digest and all layers are what they should be

  bool wrong() const { return !problem.empty(); }
};

// `count` different tiles out of all, or all if there are no more; a function of the seed, in order of
// number.
std::vector<TileIndex> random_tiles(TileIndex all, std::uint64_t count, std::uint64_t seed);

// Renders all rounds of the tile and compares: the chain over its units' digests with the one sealed in the
// image, and its values in every layer with those in the image. The world is that of the image's scene and
// settings.
VerifiedTile verify_tile(const render::World& world, const SealedImage& image, TileIndex tile,
                         const std::atomic<bool>& stop);

// Headers that say something else than the settings, the names of the scene and, where `tiles` are all there
// are, their samples give: "header NAME". The others (seconds, health, ...) only the seal holds.
std::vector<std::string> wrong_headers(const SealedImage& image, const MatteManifests& names,
                                       const std::vector<VerifiedTile>& tiles);

}  // namespace ls::cli

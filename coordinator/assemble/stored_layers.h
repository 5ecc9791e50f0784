// Makes mip levels (reduced versions) of the layers of images that are only on disk, in snapshots. Reading
// one layer of a tile costs as much as reading all its layers. So for each tile that is read, a small version
// of all its layers stays in memory and answers later requests. Thread-safe.
#pragma once

#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/assemble/snapshot.h"
#include "core/image/exr/pixel_layers.h"

namespace ls::coordinator {

// One image: its tiles on disk, and the small versions kept in memory.
class StoredLayers {
 public:
  // `light_groups` are the names of the light groups, as for pixel_layers().
  StoredLayers(SnapshotTiles tiles, TileGrid grid, AovSet aovs,
               std::span<const std::string> light_groups = {})
      : tiles_(std::move(tiles)), grid_(grid), aovs_(aovs), layers_(pixel_layers(aovs, light_groups)) {}

  // Returns the pixels of `rect` at mip level `level` of the layer, in the format of LayerMosaic::bytes().
  // `rect` is in pixels of that level.
  Result<std::vector<std::byte>> pixels(const PixelLayer& layer, int level, const PixelRect& rect);
  std::size_t bytes() const;  // bytes of the small versions in memory

 private:
  // The small version of a tile: the pixels of each layer at mip level kKeptLevel. It is empty if the tile
  // has no samples. Such a tile is left out of coarser levels, since its object identifiers (cryptomattes)
  // are all zero and would hide those of neighbouring tiles.
  using Small = std::vector<std::vector<std::byte>>;
  static constexpr int kKeptLevel = 2;
  Result<TileLayers> read(TileIndex tile) const;
  PixelRect small_rect(TileIndex tile) const;
  Result<std::shared_ptr<const Small>> small(TileIndex tile);

  const SnapshotTiles tiles_;
  const TileGrid grid_;
  const AovSet aovs_;
  const std::vector<PixelLayer> layers_;
  mutable std::mutex mutex_;
  std::map<TileIndex, std::shared_ptr<const Small>> small_;
  std::size_t bytes_ = 0;
};

// Caches the images requested most recently: at most kMostImages, and fewer if they use more than kMostBytes
// of memory together. The latest one is kept in any case.
class StoredImages {
 public:
  static constexpr std::size_t kMostImages = 4, kMostBytes = std::size_t{256} << 20;
  using Open = std::function<std::shared_ptr<StoredLayers>()>;
  // Returns the image of `key`. If it is not cached, open() makes it; null if open() returns null. The key
  // must identify the content of the file, not only the job: a job that is extended gets another file.
  std::shared_ptr<StoredLayers> image(const std::string& key, const Open& open);

 private:
  std::mutex mutex_;
  // Keys and images, most recently used first
  std::list<std::pair<std::string, std::shared_ptr<StoredLayers>>> kept_;
};

}  // namespace ls::coordinator

// Mip levels of images that are on disk only. Reading one layer of a tile costs as much as reading all its
// layers. So for each tile that is read, a small version of all its layers stays in memory and answers later
// requests. Thread-safe.
#pragma once

#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "common/image/exr/pixel_layers.h"
#include "coordinator/assemble/snapshot.h"

namespace ls::coordinator {

// One image: its tiles on disk, and the small versions kept in memory.
class StoredLayers {
 public:
  StoredLayers(SnapshotTiles tiles, TileGrid grid, AovSet aovs)
      : tiles_(std::move(tiles)), grid_(grid), aovs_(aovs), layers_(pixel_layers(aovs)) {}

  // Returns the rectangle of a mip level of the layer, as LayerMosaic::bytes() does.
  Result<std::vector<std::byte>> pixels(const PixelLayer& layer, int level, const PixelRect& rect);
  std::size_t bytes() const;  // bytes kept in memory

 private:
  // Pixels of each layer at mip level kKeptLevel. Empty if the tile has no samples: it must not take part in
  // coarser levels then, since an identifier of zero would hide those of its neighbours.
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

// Caches the images requested most recently: at most kMostImages, and the oldest of these are dropped while
// all together use more than kMostBytes of memory.
class StoredImages {
 public:
  static constexpr std::size_t kMostImages = 4, kMostBytes = std::size_t{256} << 20;
  using Open = std::function<std::shared_ptr<StoredLayers>()>;
  // Returns the image of `key`, which open() makes if it is not cached; null if open() returns null. A key
  // must also identify the content of the file: a job that is extended gets another file.
  std::shared_ptr<StoredLayers> image(const std::string& key, const Open& open);

 private:
  std::mutex mutex_;
  std::list<std::pair<std::string, std::shared_ptr<StoredLayers>>> kept_;  // most recently used first
};

}  // namespace ls::coordinator

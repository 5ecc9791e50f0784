#include "coordinator/assemble/stored_layers.h"

#include <algorithm>

#include "core/image/frame/frame.h"

namespace ls::coordinator {

Result<TileLayers> StoredLayers::read(TileIndex tile) const {
  Film film(grid_, aovs_);
  if (auto loaded = tiles_.load(tile, film); !loaded) return tl::unexpected(loaded.error());
  return TileLayers(film, tile, !aovs_.empty());
}

PixelRect StoredLayers::small_rect(TileIndex tile) const {
  const PixelRect r = grid_.rect(tile);
  const int up = (1 << kKeptLevel) - 1;
  return {r.x0 >> kKeptLevel, r.y0 >> kKeptLevel, (r.x1 + up) >> kKeptLevel, (r.y1 + up) >> kKeptLevel};
}

Result<std::shared_ptr<const StoredLayers::Small>> StoredLayers::small(TileIndex tile) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = small_.find(tile); found != small_.end()) return found->second;
  }
  const auto values = read(tile);
  if (!values) return tl::unexpected(values.error());
  auto made = std::make_shared<Small>();
  std::size_t bytes = 0;
  for (const PixelLayer& layer : layers_) {
    const auto pixels = values->values(layer);
    std::vector<std::byte>& kept = made->emplace_back();
    if (pixels.empty()) continue;
    LayerMosaic mosaic(layer, grid_.frame, kKeptLevel, small_rect(tile));
    mosaic.add(0, values->rect(), pixels);
    kept = mosaic.bytes();
    bytes += kept.size();
  }
  const std::lock_guard lock(mutex_);
  const auto [place, fresh] = small_.emplace(tile, std::move(made));
  if (fresh) bytes_ += bytes;
  return place->second;
}

Result<std::vector<std::byte>> StoredLayers::pixels(const PixelLayer& layer, int level,
                                                    const PixelRect& rect) {
  LayerMosaic mosaic(layer, grid_.frame, level, rect);
  const auto same = [&](const PixelLayer& other) { return other.name == layer.name; };
  const auto at =
      static_cast<std::size_t>(std::find_if(layers_.begin(), layers_.end(), same) - layers_.begin());
  // Mip levels from kKeptLevel on can be made from the small versions of tiles, which have level kKeptLevel.
  // But no pixel of that level may cover two tiles: a tile's side must be a multiple of 2^kKeptLevel pixels.
  const bool from_small = level >= kKeptLevel && grid_.tile % (1 << kKeptLevel) == 0;
  for (const TileIndex tile : tiles_over(grid_, rect_in_image(grid_.frame, level, rect))) {
    if (from_small) {
      const auto kept = small(tile);
      if (!kept) return tl::unexpected(kept.error());
      mosaic.add(kKeptLevel, small_rect(tile), layer_floats(layer, (**kept)[at]));
    } else {
      const auto values = read(tile);
      if (!values) return tl::unexpected(values.error());
      mosaic.add(0, values->rect(), values->values(layer));
    }
  }
  return mosaic.bytes();
}

std::size_t StoredLayers::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

std::shared_ptr<StoredLayers> StoredImages::image(const std::string& key, const Open& open) {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(kept_.begin(), kept_.end(), [&](const auto& one) { return one.first == key; });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
  } else {
    auto opened = open();
    if (!opened) return nullptr;
    kept_.emplace_front(key, std::move(opened));
  }
  std::size_t images = 0, bytes = 0;
  std::erase_if(kept_, [&](const auto& one) {
    bytes += one.second->bytes();
    return ++images > 1 && (images > kMostImages || bytes > kMostBytes);
  });
  return kept_.front().second;
}

}  // namespace ls::coordinator

#include "core/image/film/merge.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <tuple>

#include "core/image/frame/render_limits.h"

namespace ls {
namespace {

struct Entry {
  std::size_t source;
  SampleRange samples;
  Digest digest;
};
// Orders rectangles by position: row by row from the top, and from left to right in a row.
struct ByPlace {
  bool operator()(const PixelRect& a, const PixelRect& b) const {
    return std::tie(a.y0, a.x0, a.y1, a.x1) < std::tie(b.y0, b.x0, b.y1, b.x1);
  }
};
using Tiles = std::map<PixelRect, std::vector<Entry>, ByPlace>;

tl::unexpected<Error> refuse(std::string text) { return bad_argument("merge: " + std::move(text)); }

class Merger {
 public:
  explicit Merger(const std::vector<PartialSource>& sources) : sources_(sources) {}

  Result<Merged> run() {
    if (sources_.empty()) return refuse("no partials were given");
    for (std::size_t i = 0; i < sources_.size(); ++i)
      if (const auto ok = index(i); !ok) return tl::unexpected(ok.error());
    const auto grid = tiling();
    if (!grid) return tl::unexpected(grid.error());
    Merged out{Film(*grid, aovs_), first_->scene, first_->settings, first_->numeric_class};
    for (TileIndex t = 0; t < grid->count(); ++t) {
      const auto it = tiles_.find(grid->rect(t));
      if (it == tiles_.end())
        return refuse(fmt::format("no partial of tile {} {} was given", t, show(grid->rect(t))));
      if (const auto ok = fold(out.film, t, it->second); !ok) return tl::unexpected(ok.error());
    }
    out.duplicates = duplicates_;
    return out;
  }

 private:
  Result<PartialFile> read(std::size_t i) const {
    const auto bytes = sources_[i].read();
    if (!bytes) return tl::unexpected(bytes.error());
    auto file = decode_partial_file(*bytes);
    if (!file) return fail(file.error().code, fmt::format("{}: {}", sources_[i].name, file.error().message));
    return file;
  }

  // First pass, for partial number i: reads its file and checks that it belongs to the same image as the
  // partials before it. It keeps the header and the digest, but not the pixels.
  Result<void> index(std::size_t i) {
    const auto file = read(i);
    if (!file) return tl::unexpected(file.error());
    const UnitHeader& h = file->partial.header;
    if (!first_) {
      first_ = h;
      frame_ = file->frame;
      aovs_ = file->partial.aovs;
    }
    const auto other = [&](std::string_view what) {
      return refuse(fmt::format("{} is of another {} than {}", sources_[i].name, what, sources_[0].name));
    };
    if (h.scene != first_->scene) return other("scene");
    if (h.settings != first_->settings) return other("job's settings");
    if (h.numeric_class != first_->numeric_class)
      return other("numeric class (its machine or build computes otherwise)");
    if (file->frame != frame_) return other("frame size");
    if (file->partial.aovs != aovs_) return other("set of AOVs");
    tile_side_ = std::max({tile_side_, h.tile.width(), h.tile.height()});
    tiles_[h.tile].push_back({i, h.samples, unit_digest(file->partial)});
    return {};
  }

  // Returns the tiling of the frame. The side of its tiles is the largest width or height of any partial. It
  // is an error if the rectangle of a partial is not a tile of this tiling.
  Result<TileGrid> tiling() const {
    const TileGrid grid{frame_, tile_side_};
    const std::uint64_t tiles = std::uint64_t(grid.columns()) * std::uint64_t(grid.rows());
    if (tiles > kMaxTiles)
      return refuse(fmt::format("a frame of {} x {} in tiles of {} has {} tiles; at most {} are allowed",
                                frame_.width, frame_.height, grid.tile, tiles, kMaxTiles));
    for (const auto& [rect, entries] : tiles_) {
      const TileIndex t =
          static_cast<TileIndex>(rect.y0 / grid.tile) * static_cast<TileIndex>(grid.columns()) +
          static_cast<TileIndex>(rect.x0 / grid.tile);
      if (grid.rect(t) != rect)
        return refuse(fmt::format("{}: tile {} does not fit a tiling of {} x {} pixels by {}",
                                  name(entries[0]), show(rect), frame_.width, frame_.height, grid.tile));
    }
    return grid;
  }

  const std::string& name(const Entry& e) const { return sources_[e.source].name; }

  // Chooses which partials of a tile are folded; `entries` are all partials of the tile. Of the partials that
  // begin at the same sample, the one with the longest range is chosen. It is an error if two partials have
  // the same range of samples but different contents.
  Result<std::vector<Entry>> choose(std::vector<Entry> entries) {
    std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
      return std::tie(a.samples.s0, b.samples.s1) < std::tie(b.samples.s0, a.samples.s1);
    });
    std::vector<Entry> chosen;
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const Entry& e = entries[i];
      if (i > 0 && entries[i - 1].samples == e.samples) {
        if (entries[i - 1].digest != e.digest)
          return refuse(fmt::format("{} and {} are of the same unit but differ: one of them is wrong",
                                    name(entries[i - 1]), name(e)));
        ++duplicates_;
      }
      if (chosen.empty() || chosen.back().samples.s0 != e.samples.s0) chosen.push_back(e);
    }
    return chosen;
  }

  Result<void> fold(Film& film, TileIndex tile, const std::vector<Entry>& entries) {
    const auto chosen = choose(entries);
    if (!chosen) return tl::unexpected(chosen.error());
    const std::string where = fmt::format("tile {} {}", tile, show(film.grid().rect(tile)));
    std::uint64_t at = 0;
    for (RoundIndex k = 0; k < chosen->size(); ++k) {
      const Entry& e = (*chosen)[k];
      if (e.samples.s0 > at)
        return refuse(
            fmt::format("{}: samples [{}, {}) are missing before {}", where, at, e.samples.s0, name(e)));
      if (e.samples.s0 < at)
        return refuse(fmt::format("{}: samples [{}, {}) of {} overlap those before", where, e.samples.s0,
                                  e.samples.s1, name(e)));
      const auto file = read(e.source);
      if (!file) return tl::unexpected(file.error());
      if (unit_digest(file->partial) != e.digest)
        return refuse(fmt::format("{} changed while it was read", name(e)));
      if (const auto ok = film.fold(tile, k, file->partial, e.digest); !ok)
        return fail(ok.error().code, fmt::format("{}: {}", name(e), ok.error().message));
      at = e.samples.s1;
    }
    return {};
  }

  const std::vector<PartialSource>& sources_;
  std::optional<UnitHeader> first_;
  FrameSize frame_;
  AovSet aovs_;
  int tile_side_ = 0;
  Tiles tiles_;
  std::uint64_t duplicates_ = 0;
};

}  // namespace

Result<Merged> merge_partials(const std::vector<PartialSource>& sources) { return Merger(sources).run(); }

}  // namespace ls

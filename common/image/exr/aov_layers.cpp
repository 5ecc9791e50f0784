#include "common/image/exr/aov_layers.h"

#include <fmt/format.h>

#include <cmath>

#include "common/image/aov/cryptomatte.h"
#include "common/image/aov/id_slots.h"
#include "common/image/frame/each_pixel.h"

namespace ls {
namespace {

std::size_t pixels_of(FrameSize size) {
  return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
}

class Layers {
 public:
  explicit Layers(const Film& film)
      : film_(film), frame_(film.grid().frame), planes_(planes_of(film.aovs())) {
    sums_.assign(planes_.sums.size(), {});
    // Two kinds of planes have no layer of their own: the number of hits, and half B of a guide (an AOV for
    // the denoiser), whose planes follow those of half A. The layer of a guide is the sum of both halves.
    for (std::size_t p = 0; p < sums_.size(); ++p)
      if (p != planes_.hits && planes_.sums[p].half == 0) sums_[p].resize(pixels_of(frame_));
    ids_.assign(planes_.ids.size() * 2 * kCryptomatteRanks, std::vector<float>(pixels_of(frame_)));
  }

  void gather() {
    for (TileIndex t = 0; t < film_.grid().count(); ++t) {
      if (film_.spp(t) == 0) continue;
      const TileAovs tile = film_.aov_pixels(t);
      gather_means(tile);
      gather_ids(tile);
    }
  }

  std::uint64_t move_to(ExrPicture& picture, const CryptomatteManifests& manifests, bool float_output) {
    std::uint64_t clamped = 0;
    for (std::size_t p = 0; p < sums_.size(); ++p) {
      if (sums_[p].empty()) continue;
      const AovRow& row = row_of(planes_.sums[p].aov);
      const std::string name = fmt::format(
          "{}.{}", layer_of(row.aov), row.components[static_cast<std::size_t>(planes_.sums[p].component)]);
      if (row.half && !float_output) {
        clamped += clamp_to_half(sums_[p]);
        picture.channels[name] = ExrHalf{std::move(sums_[p])};
      } else {
        picture.channels[name] = ExrFloat{std::move(sums_[p])};
      }
    }
    for (std::size_t i = 0; i < planes_.ids.size(); ++i) {
      const std::string layer = layer_of(planes_.ids[i]);
      for (std::size_t c = 0; c < 2 * kCryptomatteRanks; ++c)
        picture.channels[fmt::format("{}{:02}.{}", layer, c / 4, "RGBA"[c % 4])] =
            ExrFloat{std::move(ids_[i * 2 * kCryptomatteRanks + c])};
      picture.strings.merge(cryptomatte_header(
          layer, planes_.ids[i] == Aov::shape_id ? manifests.shapes : manifests.materials));
    }
    return clamped;
  }

 private:
  void gather_means(const TileAovs& tile) {
    const auto n = static_cast<std::size_t>(tile.rect.pixels());
    const double* hits = planes_.hits == SIZE_MAX ? nullptr : &tile.sums[planes_.hits * n];
    for (std::size_t p = 0; p < sums_.size(); ++p) {
      if (sums_[p].empty()) continue;
      const AovRow& row = row_of(planes_.sums[p].aov);
      const bool by_hits = row.kind == AovKind::of_hits;
      const double* other =
          row.kind == AovKind::guide ? &tile.sums[(p + row.components.size()) * n] : nullptr;
      each_pixel(tile.rect, frame_, [&](std::size_t to, std::size_t from) {
        const double count = by_hits ? hits[from] : static_cast<double>(tile.spp);
        const double sum = tile.sums[p * n + from] + (other ? other[from] : 0);
        // The addition maps -0 to +0; all other values stay the same.
        if (count > 0) sums_[p][to] = static_cast<float>(sum / count) + 0.f;
      });
    }
  }
  void gather_ids(const TileAovs& tile) {
    const auto n = static_cast<std::size_t>(tile.rect.pixels());
    for (std::size_t i = 0; i < planes_.ids.size(); ++i)
      each_pixel(tile.rect, frame_, [&](std::size_t to, std::size_t from) {
        const IdSlots slots = load_slots(&tile.ids[i * kIdPlanes * n + from], n);
        for (std::size_t rank = 0; rank < kCryptomatteRanks; ++rank) {
          std::vector<float>* channel = &ids_[(i * kCryptomatteRanks + rank) * 2];
          channel[0][to] = slots.slots[rank].id;
          channel[1][to] = static_cast<float>(double{slots.slots[rank].n} / static_cast<double>(tile.spp));
        }
      });
  }

  const Film& film_;
  FrameSize frame_;
  AovPlanes planes_;
  std::vector<std::vector<float>> sums_, ids_;
};

}  // namespace

std::string layer_of(Aov aov) {
  if (aov == Aov::shape_id) return "crypto_object";
  if (aov == Aov::material_id) return "crypto_material";
  return std::string(row_of(aov).name);
}

std::uint64_t clamp_to_half(std::vector<float>& plane) {
  std::uint64_t clamped = 0;
  for (float& v : plane) {
    if (std::abs(v) <= kLargestHalf) continue;
    v = std::copysign(kLargestHalf, v);
    ++clamped;
  }
  return clamped;
}

std::uint64_t add_aov_layers(const Film& film, const CryptomatteManifests& manifests, bool float_output,
                             ExrPicture& picture) {
  if (film.aovs().empty()) return 0;
  Layers layers(film);
  layers.gather();
  return layers.move_to(picture, manifests, float_output);
}

}  // namespace ls

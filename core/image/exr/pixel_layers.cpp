#include "core/image/exr/pixel_layers.h"

#include <fmt/format.h>
#include <half.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/image/aov/identifiers.h"
#include "core/image/error/relative_weights.h"
#include "core/image/exr/caught_shadows.h"
#include "core/image/exr/final_image.h"

namespace ls {
namespace {

static_assert(std::endian::native == std::endian::little);

// number of identifiers shown per pixel: those with the largest coverage
constexpr std::size_t kShownRanks = 3;

PixelLayer layer_of_aov(Aov aov, std::string name) {
  const AovRow& row = row_of(aov);
  PixelLayer layer{
      .name = std::move(name), .channels = {}, .rule = BlockRule::mean, .half = true, .aov = aov};
  if (row.kind == AovKind::ids) {
    layer.rule = BlockRule::first;
    layer.half = false;  // a half float cannot represent the bits of an identifier
    for (std::size_t rank = 0; rank < kShownRanks; ++rank)
      for (const char* of : {"id", "coverage"}) layer.channels.push_back(fmt::format("{}{}", of, rank));
  } else {
    for (const char c : row.components) layer.channels.emplace_back(1, c);
  }
  return layer;
}

std::vector<float> relative_errors(const TilePixels& tile) {
  std::vector<float> out(tile.mean.size() / 3);
  for (std::size_t p = 0; p < out.size(); ++p) {
    double squared = 0;
    for (std::size_t c = 3 * p; c < 3 * p + 3; ++c) {
      const double d = tile.standard_error[c], m = tile.mean[c];
      squared += d * d / (m * m + kRelMseDenominator) / 3;
    }
    out[p] = static_cast<float>(std::sqrt(squared));
  }
  return out;
}

// Returns the means of a layer of an AOV or, if layer.difference, half the differences between the means of
// the two halves of the samples.
std::vector<float> means(const TileAovs& tile, const AovPlanes& planes, const PixelLayer& layer) {
  const AovRow& row = row_of(*layer.aov);
  const auto n = static_cast<std::size_t>(tile.rect.pixels()), channels = row.components.size();
  std::vector<float> out(n * channels);
  const double* hits = planes.hits == SIZE_MAX ? nullptr : &tile.sums[planes.hits * n];
  const CaughtShadows shadows(tile, planes);
  for (std::size_t plane = 0; plane < planes.sums.size(); ++plane) {
    const AovPlane& p = planes.sums[plane];
    if (p.hits || p.aov != row.aov || p.half != 0 || p.group != layer.group) continue;
    // An AOV with halves has its planes for half A of the samples, then those for half B, at an offset of
    // `channels` planes. The sums of the two halves are added or, for the difference, subtracted.
    const double* other = has_halves(row.kind) ? &tile.sums[(plane + channels) * n] : nullptr;
    for (std::size_t i = 0; i < n; ++i) {
      const double count = row.kind == AovKind::of_hits ? hits[i] : static_cast<double>(tile.spp);
      const double b = other ? other[i] : 0, sum = tile.sums[plane * n + i] + (layer.difference ? -b : b);
      out[i * channels + static_cast<std::size_t>(p.component)] =
          count > 0 ? static_cast<float>(sum / count) : 0.f;
      if (shadows.add_to(row.aov))
        out[i * channels + static_cast<std::size_t>(p.component)] +=
            static_cast<float>(layer.difference ? shadows.difference(i) : shadows.opacity(i));
    }
  }
  return out;
}

std::vector<float> identifiers(const TileAovs& tile, const AovPlanes& planes, Aov aov) {
  const auto n = static_cast<std::size_t>(tile.rect.pixels());
  const auto at =
      static_cast<std::size_t>(std::find(planes.ids.begin(), planes.ids.end(), aov) - planes.ids.begin());
  std::vector<float> out(n * 2 * kShownRanks);
  for (std::size_t i = 0; i < n; ++i) {
    const IdSlots slots = load_slots(&tile.ids[at * kIdPlanes * n + i], n);
    for (std::size_t rank = 0; rank < kShownRanks; ++rank) {
      out[(i * kShownRanks + rank) * 2] = slots.slots[rank].id;
      out[(i * kShownRanks + rank) * 2 + 1] = slots.slots[rank].n / static_cast<float>(tile.spp);
    }
  }
  return out;
}

std::vector<float> narrowed(const std::vector<double>& values) {
  std::vector<float> out(values.size());
  std::transform(values.begin(), values.end(), out.begin(), [](double v) { return static_cast<float>(v); });
  return out;
}

}  // namespace

std::string_view to_string(BlockRule rule) {
  static constexpr std::string_view kNames[] = {"mean", "error_of_mean", "root_mean_square", "first"};
  return kNames[static_cast<std::size_t>(rule)];
}

std::vector<PixelLayer> pixel_layers(AovSet aovs, std::span<const std::string> light_groups) {
  std::vector<PixelLayer> out = {
      {.name = "rgb", .channels = {"R", "G", "B"}, .aov = {}},
      {.name = "stderr", .channels = {"R", "G", "B"}, .rule = BlockRule::error_of_mean, .aov = {}},
      {.name = "error", .channels = {"Y"}, .rule = BlockRule::root_mean_square, .aov = {}},
      {.name = "spp", .channels = {"Y"}, .aov = {}}};
  for (const AovRow& row : aov_rows()) {
    if (!aovs.has(row.aov)) continue;
    if (row.kind != AovKind::groups) {
      out.push_back(layer_of_aov(row.aov, layer_of(row.aov)));
      continue;
    }
    for (std::size_t g = 0; g < aovs.groups(); ++g) {
      const std::string name = layer_of_group(row.aov, g, light_groups);
      for (const bool difference : {false, true}) {
        out.push_back(layer_of_aov(row.aov, name + std::string(difference ? kHalfDifference : "")));
        out.back().group = g;
        out.back().difference = difference;
      }
    }
  }
  return out;
}

Result<PixelLayer> pixel_layer(AovSet aovs, std::string_view name,
                               std::span<const std::string> light_groups) {
  std::string known;
  for (PixelLayer& layer : pixel_layers(aovs, light_groups)) {
    if (layer.name == name) return std::move(layer);
    known += (known.empty() ? "" : ", ") + layer.name;
  }
  return bad_argument(fmt::format("'layer' must be one of this image's: {}", known));
}

FrameSize level_size(FrameSize frame, int level) {
  const int round_up = (1 << level) - 1;
  return {(frame.width + round_up) >> level, (frame.height + round_up) >> level};
}

PixelRect rect_in_image(FrameSize frame, int level, const PixelRect& rect) {
  return {rect.x0 << level, rect.y0 << level, std::min(rect.x1 << level, frame.width),
          std::min(rect.y1 << level, frame.height)};
}

Result<void> check_layer_rect(FrameSize frame, int level, const PixelRect& rect) {
  if (level < 0 || level > kMaxLayerLevel)
    return bad_argument(fmt::format("'level' must be from 0 to {}", kMaxLayerLevel));
  const FrameSize size = level_size(frame, level);
  if (!lies_in(size, rect))
    return bad_argument(fmt::format("'rect' must be x0,y0,x1,y1 within 0,0,{},{}, the size of level {}",
                                    size.width, size.height, level));
  if (rect.width() > kMaxLayerSide || rect.height() > kMaxLayerSide ||
      rect.pixels() << (2 * level) > kMaxLayerPixels)
    return bad_argument(
        fmt::format("'rect' may have at most {0} pixels on a side and {1} pixels in all, at level {2}; "
                    "ask for parts of it",
                    kMaxLayerSide, kMaxLayerPixels >> (2 * level), level));
  return {};
}

TileLayers::TileLayers(const Film& film, TileIndex tile, bool aovs) : colour_(film.pixels(tile)) {
  if (!aovs) return;
  aovs_ = film.aov_pixels(tile);
  planes_ = planes_of(film.aovs());
}

std::vector<float> TileLayers::values(const PixelLayer& layer) const {
  if (colour_.spp == 0) return {};
  if (layer.aov) {
    const AovRow& row = row_of(*layer.aov);
    return row.kind == AovKind::ids ? identifiers(*aovs_, planes_, row.aov) : means(*aovs_, planes_, layer);
  }
  if (layer.name == "rgb") return narrowed(colour_.mean);
  if (layer.name == "stderr") return narrowed(colour_.standard_error);
  if (layer.name == "error") return relative_errors(colour_);
  return std::vector<float>(colour_.mean.size() / 3, static_cast<float>(colour_.spp));
}

LayerMosaic::LayerMosaic(PixelLayer layer, FrameSize frame, int level, PixelRect rect)
    : layer_(std::move(layer)), frame_(frame), level_(level), rect_(rect) {
  weights_.resize(static_cast<std::size_t>(rect.pixels()));
  sums_.resize(weights_.size() * layer_.channels.size());
}

void LayerMosaic::add(int level, const PixelRect& rect, std::span<const float> values) {
  if (values.empty()) return;
  const int shift = level_ - level;
  const std::size_t channels = layer_.channels.size();
  const PixelRect overlap = {std::max(rect.x0, rect_.x0 << shift), std::max(rect.y0, rect_.y0 << shift),
                             std::min(rect.x1, rect_.x1 << shift), std::min(rect.y1, rect_.y1 << shift)};
  for (int y = overlap.y0; y < overlap.y1; ++y) {
    for (int x = overlap.x0; x < overlap.x1; ++x) {
      const auto from = static_cast<std::size_t>(y - rect.y0) * static_cast<std::size_t>(rect.width()) +
                        static_cast<std::size_t>(x - rect.x0);
      const float* value = &values[from * channels];
      if (std::isnan(value[0])) continue;  // the added block has no samples
      const auto to =
          static_cast<std::size_t>((y >> shift) - rect_.y0) * static_cast<std::size_t>(rect_.width()) +
          static_cast<std::size_t>((x >> shift) - rect_.x0);
      if (layer_.rule == BlockRule::first && weights_[to] > 0) continue;
      // The weight of a block is its number of pixels in the image, which is smaller at the edge of the
      // image.
      const auto weight = static_cast<double>(rect_in_image(frame_, level, {x, y, x + 1, y + 1}).pixels());
      weights_[to] += weight;
      for (std::size_t c = 0; c < channels; ++c) {
        const double v = value[c];
        double& sum = sums_[to * channels + c];
        if (layer_.rule == BlockRule::error_of_mean)
          sum += weight * v * weight * v;
        else if (layer_.rule == BlockRule::root_mean_square)
          sum += weight * v * v;
        else if (layer_.rule == BlockRule::first)
          sum = v;
        else
          sum += weight * v;
      }
    }
  }
}

std::vector<std::byte> LayerMosaic::bytes() const {
  const std::size_t channels = layer_.channels.size();
  std::vector<float> out(sums_.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double weight = weights_[i / channels], sum = sums_[i];
    double value = sum;
    if (layer_.rule == BlockRule::mean) value = sum / weight;
    if (layer_.rule == BlockRule::error_of_mean) value = std::sqrt(sum) / weight;
    if (layer_.rule == BlockRule::root_mean_square) value = std::sqrt(sum / weight);
    if (layer_.rule != BlockRule::first && weight == 0) value = std::numeric_limits<double>::quiet_NaN();
    out[i] = static_cast<float>(value);
  }
  if (!layer_.half) {
    const auto raw = std::as_bytes(std::span(out));
    return {raw.begin(), raw.end()};
  }
  std::vector<std::byte> bytes(out.size() * sizeof(half));
  for (std::size_t i = 0; i < out.size(); ++i) {
    const half value(std::clamp(out[i], -kLargestHalf, kLargestHalf));  // clamp() returns NaN for NaN
    std::memcpy(&bytes[i * sizeof(half)], &value, sizeof value);
  }
  return bytes;
}

std::vector<float> layer_floats(const PixelLayer& layer, std::span<const std::byte> bytes) {
  if (!layer.half) {
    std::vector<float> out(bytes.size() / sizeof(float));
    std::memcpy(out.data(), bytes.data(), out.size() * sizeof(float));
    return out;
  }
  std::vector<float> out(bytes.size() / sizeof(half));
  for (std::size_t i = 0; i < out.size(); ++i) {
    half value;
    std::memcpy(&value, &bytes[i * sizeof(half)], sizeof value);
    out[i] = value;
  }
  return out;
}

}  // namespace ls

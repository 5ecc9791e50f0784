// The functions of Pictures that return pixels of one layer of an image as numbers (layers_json(), pixels()),
// and those that return small tone-mapped pictures (shown(), thumbnail_png()).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "coordinator/service/core.h"
#include "coordinator/service/image_writer.h"
#include "coordinator/service/pictures.h"
#include "core/image/exr/final_image.h"

namespace ls::coordinator {
namespace {

using nlohmann::json;

// Returns the names that the identifiers of a cryptomatte (a layer that identifies shapes or materials) stand
// for, read from the JSON text `manifest`. Null if the text is no JSON object, so that the names are unknown.
json names_of_identifiers(const std::string& manifest) {
  json names = json::parse(manifest, nullptr, false);
  return names.is_object() ? names : json();
}

// A row of tiles, as a film that contains only this row.
struct TileRow {
  int row = 0;
  Film film;
};

std::vector<std::byte> pixels_of_rows(const std::vector<TileRow>& rows, const TileGrid& grid,
                                      const PixelLayer& layer, const PixelsAsked& asked) {
  LayerMosaic mosaic(layer, grid.frame, asked.level, asked.rect);
  const PixelRect wanted = rect_in_image(grid.frame, asked.level, asked.rect);
  for (const auto& [row, film] : rows)
    for (int column = wanted.x0 / grid.tile; column * grid.tile < wanted.x1; ++column) {
      const TileLayers values(film, static_cast<TileIndex>(column), layer.aov.has_value());
      PixelRect rect = values.rect();
      rect.y0 += row * grid.tile;
      rect.y1 += row * grid.tile;
      mosaic.add(0, rect, values.values(layer));
    }
  return mosaic.bytes();
}

constexpr int kThumbnailSide = 160;  // a thumbnail has at most this many pixels on each side

// Returns the finest mip level at which neither side of the image has more than `most_side` pixels.
int level_for(FrameSize frame, int most_side) {
  int level = 0;
  while (std::max(level_size(frame, level).width, level_size(frame, level).height) > most_side) ++level;
  return level;
}

PixelRect whole(FrameSize size) { return {0, 0, size.width, size.height}; }

// The denoised image as a layer, in the format of the layer "rgb".
PixelLayer denoised_layer() {
  PixelLayer layer = pixel_layer({}, "rgb").value();
  layer.name = "denoised";
  return layer;
}

// A running job's denoised image is reused until its age is this many times the duration of denoising.
constexpr int kDenoisedAge = 4;

std::vector<std::uint8_t> tone_mapped(const PixelLayer& rgb, const LayerMosaic& mosaic, double stops,
                                      const ToCodes& to_codes) {
  const std::vector<float> values = layer_floats(rgb, mosaic.bytes());
  std::vector<double> scaled(values.size());
  std::transform(values.begin(), values.end(), scaled.begin(),
                 [scale = std::exp2(stops)](float v) { return v * scale; });
  std::vector<std::uint8_t> pixels = to_codes(scaled);
  for (std::size_t i = 0; i < values.size(); i += 3)
    if (std::isnan(values[i])) std::fill_n(&pixels[i], 3, std::uint8_t{0});  // no samples yet: black
  return pixels;
}

// Adds a rectangle of the denoised image, or nothing if there is none yet.
void add_denoised(LayerMosaic& mosaic, const Denoised* image, FrameSize frame, const PixelRect& rect) {
  if (image == nullptr) return;
  std::vector<float> values;
  values.reserve(static_cast<std::size_t>(rect.pixels()) * 3);
  for (int y = rect.y0; y < rect.y1; ++y) {
    const auto row = image->image.rgb.begin() + (std::ptrdiff_t{y} * frame.width + rect.x0) * 3;
    values.insert(values.end(), row, row + std::ptrdiff_t{rect.width()} * 3);
  }
  mosaic.add(0, rect, values);
}

}  // namespace

Result<std::string> Pictures::layers_json(const JobId& id) const {
  ReportFacts facts;
  {
    const auto core = core_.lock();
    const auto entry = core->jobs.usable(id);
    if (!entry) return tl::unexpected(entry.error());
    facts = facts_of(**entry, clock_.now());
  }
  const AovSet aovs = aovs_of(facts.job.settings);
  const LayerNames names = layer_names_of(facts.job, blobs_);
  json layers = json::array();
  std::vector<PixelLayer> all = pixel_layers(aovs, names.light_groups);
  if (facts.job.spec.denoise) all.insert(all.begin() + 1, denoised_layer());
  for (const PixelLayer& layer : all) {
    json row{{"name", layer.name},
             {"channels", layer.channels},
             {"format", layer.half ? "half" : "float"},
             {"blocks", to_string(layer.rule)}};
    if (layer.aov == Aov::shape_id) row["names"] = names_of_identifiers(names.shapes);
    if (layer.aov == Aov::material_id) row["names"] = names_of_identifiers(names.materials);
    layers.push_back(std::move(row));
  }
  const FrameSize size = facts.job.settings.size;
  return json{{"size", {size.width, size.height}},
              {"max_level", kMaxLayerLevel},
              {"max_side", kMaxLayerSide},
              {"max_pixels", kMaxLayerPixels},
              {"layers", std::move(layers)}}
      .dump(-1, ' ', false, json::error_handler_t::replace);
}

Result<std::vector<std::byte>> Pictures::pixels(const JobId& id, const PixelsAsked& asked) const {
  auto core = core_.lock();
  const auto entry = core->jobs.usable(id);
  if (!entry) return tl::unexpected(entry.error());
  const TileGrid grid = (*entry)->grid;
  const StoredJob& job = (*entry)->stored;
  const bool denoised = job.spec.denoise && asked.layer == denoised_layer().name;
  const auto layer = denoised ? denoised_layer()
                              : pixel_layer(aovs_of(job.settings), asked.layer, job.settings.light_groups);
  if (!layer) return tl::unexpected(layer.error());
  if (auto fits = check_layer_rect(grid.frame, asked.level, asked.rect); !fits)
    return tl::unexpected(fits.error());
  const PixelRect wanted = rect_in_image(grid.frame, asked.level, asked.rect);
  if (denoised) {
    core.unlock();
    const auto image = denoised_view(id);
    if (!image) return tl::unexpected(image.error());
    LayerMosaic mosaic(*layer, grid.frame, asked.level, asked.rect);
    add_denoised(mosaic, image->get(), grid.frame, wanted);
    return mosaic.bytes();
  }
  if ((*entry)->assembly) {
    // Copies only the rows of tiles that the rectangle touches, so that the film can free its other tiles
    // while these are read. The copy is cheap, because it shares the memory of its tiles with the film.
    std::vector<TileRow> rows;
    for (int row = wanted.y0 / grid.tile; row * grid.tile < wanted.y1; ++row)
      rows.push_back({row, (*entry)->assembly->film().row(row)});
    core.unlock();
    return pixels_of_rows(rows, grid, *layer, asked);
  }
  const StoredJob stored = job;
  core.unlock();
  const auto image = stored_images_.image(files_.image_version(stored), [&]() {
    auto tiles = files_.tiles_of_image(stored, grid);
    return tiles ? std::make_shared<StoredLayers>(std::move(*tiles), grid, aovs_of(stored.settings),
                                                  stored.settings.light_groups)
                 : std::shared_ptr<StoredLayers>();
  });
  if (image) return image->pixels(*layer, asked.level, asked.rect);
  // The job has no image yet: all pixels of the answer are without samples.
  return LayerMosaic(*layer, grid.frame, asked.level, asked.rect).bytes();
}

Result<std::shared_ptr<const Denoised>> Pictures::denoised_view(const JobId& id) const {
  const std::lock_guard lock(denoised_mutex_);
  auto core = core_.lock();
  const auto entry = core->jobs.usable(id);
  if (!entry) return tl::unexpected(entry.error());
  const bool running = (*entry)->assembly.has_value();
  const StoredJob job = (*entry)->stored;
  core.unlock();
  std::string key = running ? id.value : files_.image_version(job);
  const TimePoint start = clock_.now();
  if (denoised_.key == key && (!running || start - denoised_.made < kDenoisedAge * denoised_.cost))
    return denoised_.image;
  denoised_ = {};  // frees the memory of the previous image first
  auto now = picture(id);
  if (!now) return tl::unexpected(now.error());
  auto made = denoising_.of_job(now->film, now->facts);
  if (made && made->image.rgb.empty()) return fail(Errc::unavailable, made->figures.trouble);
  const TimePoint end = clock_.now();
  denoised_ = {std::move(key), end, end - start, std::move(made)};
  return denoised_.image;
}

// Returns a layer of the whole image at a mip level.
Result<LayerMosaic> Pictures::mosaic_of(const JobId& id, const PixelLayer& layer, int level) const {
  auto core = core_.lock();
  const auto entry = core->jobs.usable(id);
  if (!entry) return tl::unexpected(entry.error());
  const TileGrid grid = (*entry)->grid;
  const StoredJob job = (*entry)->stored;
  const std::optional<Film> film =
      (*entry)->assembly ? std::optional((*entry)->assembly->film()) : std::nullopt;
  core.unlock();
  LayerMosaic mosaic(layer, grid.frame, level, whole(level_size(grid.frame, level)));
  const auto add = [&](const Film& from, TileIndex tile) {
    const TileLayers values(from, tile, false);
    mosaic.add(0, values.rect(), values.values(layer));
  };
  if (film) {
    for (TileIndex tile = 0; tile < grid.count(); ++tile) add(*film, tile);
    return mosaic;
  }
  const auto tiles = files_.tiles_of_image(job, grid);
  for (TileIndex tile = 0; tiles && tile < grid.count(); ++tile) {
    Film one(grid, aovs_of(job.settings));
    if (auto loaded = tiles->load(tile, one); !loaded) return tl::unexpected(loaded.error());
    add(one, tile);
  }
  return mosaic;
}

Result<Pictures::Shown> Pictures::shown(const JobId& id, const Look& look, int most_side) const {
  const auto to_codes = codes_of(look.view);
  if (!to_codes) return tl::unexpected(to_codes.error());
  FrameSize frame;
  {
    const auto core = core_.lock();
    const auto entry = core->jobs.usable(id);
    if (!entry) return tl::unexpected(entry.error());
    frame = (*entry)->grid.frame;
  }
  const int level = level_for(frame, most_side);
  const PixelLayer rgb = pixel_layer({}, "rgb").value();
  if (look.denoised) {
    const auto image = denoised_view(id);
    if (!image) return tl::unexpected(image.error());
    LayerMosaic mosaic(rgb, frame, level, whole(level_size(frame, level)));
    add_denoised(mosaic, image->get(), frame, whole(frame));
    return Shown{level_size(frame, level), tone_mapped(rgb, mosaic, look.exposure, *to_codes)};
  }
  const auto mosaic = mosaic_of(id, rgb, level);
  if (!mosaic) return tl::unexpected(mosaic.error());
  return Shown{level_size(frame, level), tone_mapped(rgb, *mosaic, look.exposure, *to_codes)};
}

// The thumbnail of an image on disk is stored beside the image, since making it requires reading the whole
// image.
Result<std::vector<std::byte>> Pictures::thumbnail_png(const JobId& id) const {
  auto core = core_.lock();
  const auto entry = core->jobs.usable(id);
  if (!entry) return tl::unexpected(entry.error());
  const TileGrid grid = (*entry)->grid;
  const StoredJob job = (*entry)->stored;
  const bool on_disk = !(*entry)->assembly;
  core.unlock();
  std::filesystem::path kept;
  if (on_disk && files_.tiles_of_image(job, grid)) kept = files_.folder(id) / files_.thumbnail_name(job);
  if (!kept.empty())
    if (auto bytes = read_file(kept, std::uint64_t{1} << 20)) return std::move(*bytes);
  const auto small = shown(id, {}, kThumbnailSide);
  if (!small) return tl::unexpected(small.error());
  auto picture = write_png(small->size, small->rgb);
  // If this fails, the thumbnail is made again next time
  if (picture && !kept.empty()) (void)write_atomically(kept, *picture);
  return picture;
}

}  // namespace ls::coordinator

#include "core/image/exr/final_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/image/aov/deep_planes.h"
#include "core/image/aov/identifiers.h"
#include "core/image/exr/caught_shadows.h"
#include "core/image/exr/exr_file.h"

namespace ls {

namespace {

// Adding 0 turns -0 into +0 and changes no other value (in the rounding mode to nearest).
float pixel_value(double mean) { return static_cast<float>(mean) + 0.0f; }

// Returns the matrix from the film's colours to those of the space; nullopt: they are the same.
std::optional<ColourMatrix> matrix_to(ColourSpace space) {
  if (space == ColourSpace::rec709) return std::nullopt;
  return from_rec709(space);
}

// Converts the planes R, G, B.
void convert(const ColourMatrix& m, const std::array<std::vector<float>*, 3>& planes) {
  for (std::size_t i = 0; i < planes[0]->size(); ++i) {
    const Tristimulus c = m * Tristimulus{(*planes[0])[i], (*planes[1])[i], (*planes[2])[i]};
    for (std::size_t k = 0; k < 3; ++k) (*planes[k])[i] = pixel_value(c[k]);
  }
}

struct Gathered {
  std::vector<float> rgb[3], standard_error[3];
  std::vector<std::uint32_t> spp;
};

Gathered gather(const Film& film, const std::optional<ColourMatrix>& matrix) {
  const FrameSize frame = film.grid().frame;
  const std::size_t pixels = frame.pixels();
  Gathered out{{}, {}, std::vector<std::uint32_t>(pixels)};
  for (int c = 0; c < 3; ++c) out.rgb[c].resize(pixels), out.standard_error[c].resize(pixels);
  for (TileIndex t = 0; t < film.grid().count(); ++t) {
    if (film.spp(t) == 0) continue;
    const TilePixels tile = film.pixels(t);
    // Values of a UINT layer are at most 2^32 - 1. A job has at most kMaxSpp = 2^24 samples per pixel, so
    // nothing is lost.
    const auto spp = static_cast<std::uint32_t>(
        std::min<std::uint64_t>(tile.spp, std::numeric_limits<std::uint32_t>::max()));
    each_pixel(tile.rect, frame, [&](std::size_t to, std::size_t from) {
      for (std::size_t c = 0; c < 3; ++c) {
        out.rgb[c][to] = pixel_value(tile.mean[3 * from + c]);
        out.standard_error[c][to] = static_cast<float>(tile.standard_error[3 * from + c]);
      }
      out.spp[to] = spp;
    });
    if (!matrix) continue;
    // A standard error is half the difference of the two halves' colours (Film::pixels()), which the matrix
    // converts like a colour.
    const auto halves = film.half_means(t);
    const auto n = static_cast<std::size_t>(tile.rect.pixels());
    each_pixel(tile.rect, frame, [&](std::size_t to, std::size_t from) {
      Tristimulus difference;
      for (std::size_t c = 0; c < 3; ++c) difference[c] = halves[0][c * n + from] - halves[1][c * n + from];
      const Tristimulus converted = *matrix * difference;
      for (std::size_t c = 0; c < 3; ++c)
        out.standard_error[c][to] = static_cast<float>(.5 * std::abs(converted[c]));
    });
  }
  if (matrix) convert(*matrix, {&out.rgb[0], &out.rgb[1], &out.rgb[2]});
  return out;
}

constexpr int kCryptomatteRanks = 6;  // identifiers stored per pixel: those with the largest coverage

// Adds a layer of half floats or of floats. Returns the number of values that were clamped because their
// magnitude exceeded the largest half.
std::uint64_t add_layer(ExrPicture& picture, const std::string& name, std::vector<float> values,
                        bool halves) {
  if (!halves) {
    picture.channels[name] = ExrFloat{std::move(values)};
    return 0;
  }
  std::uint64_t clamped = 0;
  for (float& v : values) {
    if (std::abs(v) <= kLargestHalf) continue;
    v = std::copysign(kLargestHalf, v);
    ++clamped;
  }
  picture.channels[name] = ExrHalf{std::move(values)};
  return clamped;
}

class Layers {
 public:
  explicit Layers(const Film& film)
      : film_(film), frame_(film.grid().frame), planes_(planes_of(film.aovs())) {
    sums_.assign(planes_.sums.size(), {});
    // Two kinds of planes get no layer of their own. One is the plane that counts the samples that hit a
    // surface. The others are the planes of half B of an AOV with halves; they are added to the planes of
    // half A.
    for (std::size_t p = 0; p < sums_.size(); ++p)
      if (p != planes_.hits && planes_.sums[p].half == 0) sums_[p].resize(frame_.pixels());
    differences_.assign(planes_.sums.size(), {});
    for (std::size_t p = 0; p < sums_.size(); ++p)
      if (!sums_[p].empty() && keeps_difference(planes_.sums[p].aov)) differences_[p].resize(frame_.pixels());
    ids_.assign(planes_.ids.size() * 2 * kCryptomatteRanks, std::vector<float>(frame_.pixels()));
  }

  void gather() {
    for (TileIndex t = 0; t < film_.grid().count(); ++t) {
      if (film_.spp(t) == 0) continue;
      const TileAovs tile = film_.aov_pixels(t);
      gather_means(tile);
      gather_ids(tile);
    }
  }

  std::uint64_t move_to(ExrPicture& picture, const LayerNames& names, const ImageForm& form) {
    std::uint64_t clamped = 0;
    if (const auto matrix = matrix_to(form.colour_space)) convert_colours(*matrix);
    for (std::size_t p = 0; p < sums_.size(); ++p) {
      if (sums_[p].empty()) continue;
      const AovPlane& plane = planes_.sums[p];
      const AovRow& row = row_of(plane.aov);
      const char component = row.components[static_cast<std::size_t>(plane.component)];
      const bool halves = row.half && !form.float_output;
      if (row.kind == AovKind::groups) {
        const std::string layer = layer_of_group(row.aov, plane.group, names.light_groups);
        clamped += add_layer(picture, fmt::format("{}.{}", layer, component), std::move(sums_[p]), halves) +
                   add_layer(picture, fmt::format("{}{}.{}", layer, kHalfDifference, component),
                             std::move(differences_[p]), halves);
        continue;
      }
      // Alpha belongs to R, G and B, which have no layer's name either.
      const std::string name = row.aov == Aov::alpha ? std::string(1, component)
                                                     : fmt::format("{}.{}", layer_of(row.aov), component);
      clamped += add_layer(picture, name, std::move(sums_[p]), halves);
      if (row.aov != Aov::alpha) continue;
      for (float& d : differences_[p]) d = std::abs(d);
      picture.channels["stderr.A"] = ExrFloat{std::move(differences_[p])};
    }
    for (std::size_t i = 0; i < planes_.ids.size(); ++i) {
      const std::string layer = layer_of(planes_.ids[i]);
      for (std::size_t c = 0; c < 2 * kCryptomatteRanks; ++c)
        picture.channels[fmt::format("{}{:02}.{}", layer, c / 4, "RGBA"[c % 4])] =
            ExrFloat{std::move(ids_[i * 2 * kCryptomatteRanks + c])};
      picture.strings.merge(
          cryptomatte_header(layer, planes_.ids[i] == Aov::shape_id ? names.shapes : names.materials));
    }
    return clamped;
  }

 private:
  static bool keeps_difference(Aov aov) { return aov == Aov::alpha || row_of(aov).kind == AovKind::groups; }
  // Converts the planes of one colour, of a light group if it has groups, and those of its differences.
  void convert_colour(const ColourMatrix& matrix, Aov aov, std::size_t group) {
    for (auto* planes : {&sums_, &differences_}) {
      std::array<std::vector<float>*, 3> rgb{};
      for (std::size_t p = 0; p < planes->size(); ++p)
        if (const AovPlane& plane = planes_.sums[p];
            !(*planes)[p].empty() && plane.aov == aov && plane.group == group)
          rgb[static_cast<std::size_t>(plane.component)] = &(*planes)[p];
      if (rgb[0]) convert(matrix, rgb);
    }
  }
  void convert_colours(const ColourMatrix& matrix) {
    for (const AovRow& row : aov_rows()) {
      if (!film_.aovs().has(row.aov) || !is_colour(row.aov)) continue;
      const std::size_t groups = row.kind == AovKind::groups ? film_.aovs().groups() : 1;
      for (std::size_t g = 0; g < groups; ++g) convert_colour(matrix, row.aov, g);
    }
  }

  void gather_means(const TileAovs& tile) {
    const auto n = static_cast<std::size_t>(tile.rect.pixels());
    const double* hits = planes_.hits == SIZE_MAX ? nullptr : &tile.sums[planes_.hits * n];
    const CaughtShadows shadows(tile, planes_);
    for (std::size_t p = 0; p < sums_.size(); ++p) {
      if (sums_[p].empty()) continue;
      const AovRow& row = row_of(planes_.sums[p].aov);
      const bool by_hits = row.kind == AovKind::of_hits;
      const double* other = has_halves(row.kind) ? &tile.sums[(p + row.components.size()) * n] : nullptr;
      each_pixel(tile.rect, frame_, [&](std::size_t to, std::size_t from) {
        const double count = by_hits ? hits[from] : static_cast<double>(tile.spp);
        const double sum = tile.sums[p * n + from] + (other ? other[from] : 0);
        // Adding 0 turns -0 into +0 and changes no other value.
        if (count > 0) sums_[p][to] = static_cast<float>(sum / count) + 0.f;
        // Half the difference of the means of the two halves, as for the colour (Film::pixels())
        if (!differences_[p].empty())
          differences_[p][to] = static_cast<float>((tile.sums[p * n + from] - other[from]) / count) + 0.f;
        if (shadows.add_to(row.aov)) {
          sums_[p][to] += static_cast<float>(shadows.opacity(from));
          if (!differences_[p].empty()) differences_[p][to] += static_cast<float>(shadows.difference(from));
        }
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
  // Half the differences between the two halves of the samples; empty for planes that keep none
  std::vector<std::vector<float>> differences_;
};

std::string tile_digests(const Film& film) {
  std::string out;
  out.reserve(std::size_t{65} * film.grid().count());
  for (TileIndex t = 0; t < film.grid().count(); ++t) {
    if (t) out += ' ';
    out += film.tile_digest(t).hex();
  }
  return out;
}

}  // namespace

Digest pixels_sha256(const Film& film) {
  static_assert(std::endian::native == std::endian::little);
  const TileGrid& grid = film.grid();
  const auto width = static_cast<std::size_t>(grid.frame.width);
  Sha256 hash;
  std::vector<float> band;
  for (int row = 0; row < grid.rows(); ++row) {
    const auto first = static_cast<TileIndex>(row) * static_cast<TileIndex>(grid.columns());
    const PixelRect band_rect = grid.rect(first);
    band.assign(width * static_cast<std::size_t>(band_rect.height()) * 3, 0.0f);
    for (TileIndex t = first; t < first + static_cast<TileIndex>(grid.columns()); ++t) {
      const TilePixels tile = film.pixels(t);
      std::size_t from = 0;
      for (int y = 0; y < tile.rect.height(); ++y) {
        float* to = &band[(static_cast<std::size_t>(y) * width + static_cast<std::size_t>(tile.rect.x0)) * 3];
        for (int i = 0; i < 3 * tile.rect.width(); ++i) *to++ = pixel_value(tile.mean[from++]);
      }
    }
    hash.update(std::as_bytes(std::span(band)));
  }
  return hash.finish();
}

std::uint64_t values_above_half(const Film& film, ColourSpace space) {
  std::uint64_t above = 0;
  for (int row = 0; row < film.grid().rows(); ++row)
    for (const auto& plane : gather(film.row(row), matrix_to(space)).rgb)
      above += static_cast<std::uint64_t>(
          std::ranges::count_if(plane, [](float v) { return !(std::abs(v) <= kLargestHalf); }));
  return above;
}

std::string layer_of(Aov aov) {
  if (aov == Aov::shape_id) return "crypto_object";
  if (aov == Aov::material_id) return "crypto_material";
  return std::string(row_of(aov).name);
}

std::string layer_of_group(Aov aov, std::size_t group, std::span<const std::string> light_groups) {
  return fmt::format("RGB_{}{}", group < light_groups.size() ? light_groups[group] : fmt::format("{}", group),
                     aov == Aov::volume_light_groups ? ".volume" : "");
}

std::uint64_t add_aov_layers(const Film& film, const LayerNames& names, const ImageForm& form,
                             ExrPicture& picture) {
  if (film.aovs().empty()) return 0;
  Layers layers(film);
  layers.gather();
  return layers.move_to(picture, names, form);
}

ExrPicture final_layers(const Film& film, const LayerNames& names, const ImageForm& form,
                        std::uint64_t* clamped) {
  Gathered planes = gather(film, matrix_to(form.colour_space));
  ExrPicture picture{film.grid().frame, {}, {}};
  constexpr const char* kRgb[3] = {"R", "G", "B"};
  std::uint64_t above = 0;
  for (int c = 0; c < 3; ++c) {
    const std::string layer = fmt::format("stderr.{}", kRgb[c]);
    above += add_layer(picture, kRgb[c], std::move(planes.rgb[c]), !form.float_output);
    picture.channels[layer] = ExrFloat{std::move(planes.standard_error[c])};
  }
  picture.channels["spp"] = ExrUint{std::move(planes.spp)};
  above += add_aov_layers(film, names, form, picture);
  if (clamped) *clamped += above;
  return picture;
}

namespace {

std::string pair_text(double lo, double hi) { return fmt::format("{:.9g} {:.9g}", lo, hi); }

std::map<std::string, std::string> error_strings(const ImageError& error) {
  std::map<std::string, std::string> strings = {
      {"lightshaft:relmse", fmt::format("{:.9g}", error.relmse)},
      {"lightshaft:relmse_ci95", pair_text(error.relmse_lo, error.relmse_hi)},
      {"lightshaft:rmse", fmt::format("{:.9g}", error.rmse)},
      {"lightshaft:verdict", error.trusted ? "trusted" : error.verdict},
      {"lightshaft:few_hits", fmt::format("{}", error.few_hits)}};
  if (error.rmse_hi > 0 || error.rmse == 0)
    strings["lightshaft:rmse_ci95"] = pair_text(error.rmse_lo, error.rmse_hi);
  return strings;
}

}  // namespace

std::map<std::string, std::string> error_strings(const TileError& sums,
                                                 std::uint64_t pixels_without_samples) {
  std::map<std::string, std::string> strings;
  if (pixels_without_samples > 0)
    strings["lightshaft:pixels_without_samples"] = fmt::format("{}", pixels_without_samples);
  if (sums.samples > 0) strings.merge(error_strings(image_error(sums)));
  return strings;
}

namespace {

std::map<std::string, std::string> strings_of(const Film& film, const Provenance& from) {
  std::map<std::string, std::string> strings = {{"lightshaft:scene", from.scene.hex()},
                                                {"lightshaft:job", from.settings_json},
                                                {"lightshaft:build", from.build},
                                                {"lightshaft:class", from.numeric_class.hex()}};
  strings.merge(error_strings(film.error(), film.pixels_without_samples()));
  if (!from.error_of_mix)
    strings["lightshaft:tiles"] = tile_digests(film);
  else if (film.samples() > 0)
    for (auto& [name, text] : error_strings(*from.error_of_mix)) strings[name] = text;
  // The error over time (`convergence_status`) may show problems that the film alone does not show. Then its
  // text replaces the verdict "trusted".
  if (auto verdict = strings.find("lightshaft:verdict");
      verdict != strings.end() && verdict->second == "trusted" && from.convergence_status &&
      !from.convergence_status->trusted)
    verdict->second = from.convergence_status->words;
  if (!from.owner.empty()) strings["owner"] = from.owner;
  if (from.seed) strings["lightshaft:seed"] = fmt::format("{}", *from.seed);
  if (from.seconds) strings["lightshaft:seconds"] = fmt::format("{:.3f}", *from.seconds);
  if (!from.health.empty()) strings["lightshaft:health"] = from.health;
  if (from.core_seconds > 0) strings["lightshaft:core_seconds"] = fmt::format("{:.3f}", from.core_seconds);
  if (!from.stopped.empty()) strings["lightshaft:stopped"] = from.stopped;
  for (const auto& [name, value] : from.figures) strings["lightshaft:" + name] = fmt::format("{:.9g}", value);
  for (const auto& [name, words] : from.notes) strings["lightshaft:" + name] = words;
  return strings;
}

// Adds the layers of the denoised image in one row of tiles. Returns the number of clamped values.
std::uint64_t add_denoised(std::span<const float> denoised, const TileGrid& grid, int row,
                           const ImageForm& form, ExrPicture& band) {
  const auto width = static_cast<std::size_t>(grid.frame.width);
  const auto first = static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.tile) * width;
  const std::size_t pixels = static_cast<std::size_t>(band.size.height) * width;
  std::uint64_t clamped = 0;
  std::array<std::vector<float>, 3> planes;
  for (std::size_t c = 0; c < 3; ++c) {
    planes[c].resize(pixels);
    for (std::size_t i = 0; i < pixels; ++i)
      planes[c][i] = pixel_value(double{denoised[3 * (first + i) + c]});
  }
  if (const auto matrix = matrix_to(form.colour_space))
    convert(*matrix, {&planes[0], &planes[1], &planes[2]});
  for (std::size_t c = 0; c < 3; ++c)
    clamped +=
        add_layer(band, fmt::format("denoised.{}", "RGB"[c]), std::move(planes[c]), !form.float_output);
  return clamped;
}

class MemorySink final : public ByteSink {
 public:
  Result<void> write(std::uint64_t at, std::span<const std::byte> bytes) override {
    if (at + bytes.size() > this->bytes.size())
      this->bytes.resize(static_cast<std::size_t>(at) + bytes.size());
    std::copy(bytes.begin(), bytes.end(), this->bytes.begin() + static_cast<std::ptrdiff_t>(at));
    return {};
  }
  std::vector<std::byte> bytes;
};

// Returns the parts of an image that a lossy compression may change: those of colours.
std::set<std::string> parts_of_colours() {
  std::set<std::string> parts{kColourPart, "denoised"};
  for (const AovRow& row : aov_rows())
    if (is_colour(row.aov)) parts.insert(layer_of(row.aov));
  return parts;
}

}  // namespace

Result<std::uint64_t> write_final_exr(const Film& film, const Provenance& from, const ImageForm& form,
                                      ByteSink& sink, std::span<const float> denoised) {
  std::uint64_t clamped = 0;
  const auto band = [&](int row) {
    // each band may be requested in two passes, so the count of clamped values restarts at the first band
    if (row == 0) clamped = 0;
    ExrPicture layers = final_layers(film.row(row), from.names, form, &clamped);
    if (!denoised.empty()) clamped += add_denoised(denoised, film.grid(), row, form, layers);
    return layers;
  };
  auto strings = strings_of(film, from);
  if (form.colour_space != ColourSpace::rec709)
    strings[kColourSpaceName] = std::string(to_string(form.colour_space));
  const ExrBands bands{film.grid().frame,
                       std::move(strings),
                       band,
                       {chromaticities_of(form.colour_space), from.camera, from.frames_per_second},
                       form.compression,
                       form.parts,
                       parts_of_colours()};
  if (auto written = write_sealed_exr(bands, sink); !written) return tl::unexpected(written.error());
  return clamped;
}

DeepRows deep_rows(const Film& film, const ImageForm& form) {
  const FrameSize frame = film.grid().frame;
  const DeepSlices slices = film.aovs().deep();
  const DeepPlanes planes(slices);
  const std::size_t before = planes_of(film.aovs()).sums.size();
  const auto matrix = matrix_to(form.colour_space);
  std::vector<std::vector<DeepSample>> of_pixel(frame.pixels());
  DeepPixel pixel;
  pixel.edges.resize(planes.records());
  pixel.transmittance.resize(planes.records());
  if (slices.colours) pixel.light.resize(planes.records());
  for (TileIndex t = 0; t < film.grid().count(); ++t) {
    if (film.spp(t) == 0) continue;
    const TileAovs tile = film.aov_pixels(t);
    const auto n = static_cast<std::size_t>(tile.rect.pixels());
    const auto samples = static_cast<double>(tile.spp), rounds = static_cast<double>(tile.rounds);
    each_pixel(tile.rect, frame, [&](std::size_t to, std::size_t from) {
      const auto sum = [&](std::size_t plane) { return tile.sums[(before + plane) * n + from]; };
      for (std::size_t i = 0; i < planes.records(); ++i) {
        // Every round states the same edge. A sum of up to 2^29 equal floats is exact in double, and so is
        // its quotient.
        pixel.edges[i] = sum(planes.edge(i)) / rounds;
        pixel.transmittance[i] = sum(planes.transmittance(i)) / samples;
        if (!slices.colours) continue;
        for (std::size_t c = 0; c < 3; ++c) pixel.light[i][c] = sum(planes.light(i, c)) / samples;
        if (matrix) pixel.light[i] = *matrix * pixel.light[i];
      }
      of_pixel[to] = deep_samples(pixel, !form.float_output);
    });
  }
  DeepRows rows{frame, {}, {}};
  for (const std::vector<DeepSample>& samples : of_pixel) {
    rows.counts.push_back(static_cast<std::uint32_t>(samples.size()));
    rows.samples.insert(rows.samples.end(), samples.begin(), samples.end());
  }
  return rows;
}

Result<void> write_deep_image(const Film& film, const Provenance& from, const ImageForm& form,
                              ByteSink& sink) {
  const DeepSlices slices = film.aovs().deep();
  if (slices.count == 0)
    return fail(Errc::failed_precondition, "the image has no slices: render it with the setting deep");
  auto strings = strings_of(film, from);
  strings[kDeepSlicesName] = fmt::format("{}", slices.count);
  if (form.colour_space != ColourSpace::rec709)
    strings[kColourSpaceName] = std::string(to_string(form.colour_space));
  return write_sealed_deep_exr({film.grid().frame,
                                std::move(strings),
                                [&](int row) { return deep_rows(film.row(row), form); },
                                {chromaticities_of(form.colour_space), from.camera, from.frames_per_second},
                                slices.colours,
                                form.float_output},
                               sink);
}

Result<std::vector<std::byte>> deep_exr_of(const Film& film, const Provenance& from, const ImageForm& form) {
  MemorySink sink;
  if (auto written = write_deep_image(film, from, form, sink); !written)
    return tl::unexpected(written.error());
  return std::move(sink.bytes);
}

Result<FinalImage> final_exr(const Film& film, const Provenance& from, const ImageForm& form,
                             std::span<const float> denoised) {
  MemorySink sink;
  const auto clamped = write_final_exr(film, from, form, sink, denoised);
  if (!clamped) return tl::unexpected(clamped.error());
  return FinalImage{std::move(sink.bytes), *clamped};
}

}  // namespace ls

#include "core/image/film/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/image/aov/identifiers.h"

namespace ls {
namespace {

std::string show(const SampleRange& r) { return fmt::format("[{}, {})", r.s0, r.s1); }

Digest chained(const Digest& chain, const Digest& unit) {
  Sha256 hash;
  hash.update(std::as_bytes(std::span(chain.bytes)));
  hash.update(std::as_bytes(std::span(unit.bytes)));
  return hash.finish();
}

// Adds the identifiers of `from` to those of `to`. Both have kIdPlanes planes of `pixels` values for every
// AOV whose values are identifiers.
void add_ids(std::vector<float>& to, std::span<const float> from, std::size_t pixels) {
  for (std::size_t first = 0; first < to.size(); first += kIdPlanes * pixels)
    for (std::size_t i = first; i < first + pixels; ++i)
      store_slots(load_slots(&to[i], pixels) + load_slots(&from[i], pixels), &to[i], pixels);
}

}  // namespace

Film::Film(TileGrid grid, AovSet aovs) : grid_(grid), aovs_(aovs) {
  const AovPlanes planes = planes_of(aovs);
  planes_ = {kPartialChannels + planes.all_sums(), kIdPlanes * planes.ids.size()};
  CHECK(grid.frame.width > 0 && grid.frame.height > 0 && grid.tile > 0, "a film of {} x {} in tiles of {}",
        grid.frame.width, grid.frame.height, grid.tile);
  tiles_.resize(grid.count());
}

std::uint64_t Film::Tile::full_spp() const { return full_rounds ? round_range(full_rounds - 1).s1 : 0; }

std::uint64_t Film::Tile::spp() const { return tail ? tail->samples.s1 : full_spp(); }

Result<void> Film::accepts(TileIndex index, RoundIndex round, const Partial& partial) const {
  if (index >= tiles_.size())
    return bad_argument(fmt::format("tile {} does not exist; the film has {}", index, tiles_.size()));
  const PixelRect rect = grid_.rect(index);
  const SampleRange full = round_range(round), got = partial.header.samples;
  if (partial.aovs != aovs_)
    return bad_argument(fmt::format("the partial of tile {} has other AOVs than the film", index));
  if (partial.header.tile != rect ||
      partial.sums.size() != static_cast<std::size_t>(rect.pixels()) * (planes_.sums + planes_.ids))
    return bad_argument(fmt::format("the partial's rectangle or size is not that of tile {}", index));
  if (got.s0 != full.s0 || got.s1 <= got.s0 || got.s1 > full.s1 || got.s1 % 2 != 0)
    return bad_argument(fmt::format("tile {}: samples {} are not of round {}, which has {}", index, show(got),
                                    round, show(full)));
  const RoundIndex next = full_rounds(index);
  if (round > next)
    return fail(Errc::failed_precondition,
                fmt::format("tile {}: round {} cannot be folded before round {}", index, round, next));
  if (round < next)
    return fail(Errc::already_exists, fmt::format("tile {}: round {} is folded already", index, round));
  if (const auto cut = tail(index); cut && got.s1 <= cut->s1)
    return fail(Errc::already_exists,
                fmt::format("tile {}: samples {} of round {} are folded already", index, show(*cut), round));
  return {};
}

Result<TileError> Film::fold(TileIndex tile, RoundIndex round, const Partial& partial) {
  return fold(tile, round, partial, unit_digest(partial));
}

Result<TileError> Film::fold(TileIndex index, RoundIndex round, const Partial& partial,
                             const Digest& digest) {
  if (const auto ok = accepts(index, round, partial); !ok) return tl::unexpected(ok.error());
  const auto pixels = static_cast<std::size_t>(grid_.rect(index).pixels());
  auto next = std::make_shared<Tile>();
  const Tile* old = tiles_[index].get();
  if (old) {
    next->full_rounds = old->full_rounds;
    next->chain = old->chain;
    next->sums = old->sums;
    next->ids = old->ids;
  } else {
    next->sums.resize(planes_.sums * pixels);
    next->ids.resize(planes_.ids * pixels);
  }
  if (partial.header.samples == round_range(round)) {
    for (std::size_t i = 0; i < next->sums.size(); ++i) next->sums[i] += partial.sums[i];
    add_ids(next->ids, std::span(partial.sums).subspan(next->sums.size()), pixels);
    next->chain = chained(next->chain, digest);
    ++next->full_rounds;
  } else {
    next->tail = Tail{partial.header.samples, digest, partial.sums};
  }
  next->error = estimate(*next, old, grid_.rect(index), grid_.meters);
  const TileError error = next->error;
  tiles_[index] = std::move(next);
  return error;
}

std::array<std::vector<double>, 2> Film::halves(const Tile& tile, std::size_t pixels, bool with_tail) {
  const std::size_t n = kPartialChannels / 2 * pixels;
  std::array<std::vector<double>, 2> out;
  for (std::size_t h = 0; h < 2; ++h) {
    out[h].assign(tile.sums.begin() + static_cast<std::ptrdiff_t>(h * n),
                  tile.sums.begin() + static_cast<std::ptrdiff_t>((h + 1) * n));
    if (tile.tail && with_tail)
      for (std::size_t i = 0; i < n; ++i) out[h][i] += tile.tail->sums[h * n + i];
  }
  return out;
}

std::array<std::vector<double>, 2> Film::means(const Tile& tile, std::size_t pixels, bool with_tail) {
  auto out = halves(tile, pixels, with_tail);
  // Number of samples per pixel in each half. Both halves have the same number, since a film has an even
  // number of samples per pixel.
  const double samples = static_cast<double>((with_tail ? tile.spp() : tile.full_spp()) / 2);
  for (auto& half : out) {
    double* values = half.data();
    const std::size_t count = half.size();
    for (std::size_t i = 0; i < count; ++i) values[i] /= samples;
  }
  return out;
}

TileError Film::estimate(const Tile& tile, const Tile* before, const PixelRect& rect, bool meters) {
  const auto estimate_of = meters ? estimate_meter_error : estimate_error;
  const auto pixels = static_cast<std::size_t>(rect.pixels());
  const auto of = means(tile, pixels);
  const HalfMeans now{rect.width(), rect.height(), of[0], of[1]};
  if (!before || before->full_rounds == 0) return estimate_of(now, tile.spp(), nullptr);
  const auto earlier = means(*before, pixels, false);
  const EarlierMeans parts{{rect.width(), rect.height(), earlier[0], earlier[1]}, before->full_spp()};
  return estimate_of(now, tile.spp(), &parts);
}

std::array<std::vector<double>, 2> Film::half_means(TileIndex index) const {
  if (spp(index) == 0) return {};
  return means(*tiles_[index], static_cast<std::size_t>(grid_.rect(index).pixels()));
}

RoundIndex Film::full_rounds(TileIndex tile) const { return tiles_[tile] ? tiles_[tile]->full_rounds : 0; }

RoundIndex Film::rounds_folded(TileIndex tile) const { return full_rounds(tile) + (tail(tile) ? 1 : 0); }

std::optional<SampleRange> Film::tail(TileIndex tile) const {
  if (!tiles_[tile] || !tiles_[tile]->tail) return std::nullopt;
  return tiles_[tile]->tail->samples;
}

std::uint64_t Film::spp(TileIndex tile) const { return tiles_[tile] ? tiles_[tile]->spp() : 0; }

TileError Film::error(TileIndex tile) const {
  if (tiles_[tile]) return tiles_[tile]->error;
  return TileError{.pixels = static_cast<std::uint64_t>(grid_.rect(tile).pixels())};
}

Digest Film::tile_digest(TileIndex index) const {
  const Tile* tile = tiles_[index].get();
  if (!tile) return {};
  return tile->tail ? chained(tile->chain, tile->tail->digest) : tile->chain;
}

TilePixels Film::pixels(TileIndex index) const {
  TilePixels out{.rect = grid_.rect(index), .spp = spp(index)};
  const auto n = static_cast<std::size_t>(out.rect.pixels());
  out.mean.resize(3 * n);
  out.standard_error.resize(3 * n);
  if (!out.spp) return out;
  const auto sums = halves(*tiles_[index], n);
  const auto samples = static_cast<double>(out.spp), half = static_cast<double>(out.spp / 2);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t p = 0; p < n; ++p) {
      const double a = sums[0][c * n + p], b = sums[1][c * n + p];
      out.mean[3 * p + c] = (a + b) / samples;
      out.standard_error[3 * p + c] = 0.5 * std::abs(a / half - b / half);
    }
  }
  return out;
}

TileAovs Film::aov_pixels(TileIndex index) const {
  TileAovs out{.rect = grid_.rect(index), .spp = spp(index), .rounds = rounds_folded(index)};
  const auto n = static_cast<std::size_t>(out.rect.pixels()), colour = kPartialChannels * n;
  out.sums.resize(planes_.sums * n - colour);
  out.ids.resize(planes_.ids * n);
  if (!out.spp) return out;
  const Tile& tile = *tiles_[index];
  std::copy(tile.sums.begin() + static_cast<std::ptrdiff_t>(colour), tile.sums.end(), out.sums.begin());
  out.ids = tile.ids;
  if (!tile.tail) return out;
  for (std::size_t i = 0; i < out.sums.size(); ++i) out.sums[i] += tile.tail->sums[colour + i];
  add_ids(out.ids, std::span(tile.tail->sums).subspan(tile.sums.size()), n);
  return out;
}

std::uint64_t Film::pixels_without_samples() const {
  std::uint64_t sum = 0;
  for (TileIndex i = 0; i < tiles_.size(); ++i)
    if (!tiles_[i]) sum += static_cast<std::uint64_t>(grid_.rect(i).pixels());
  return sum;
}

std::uint64_t Film::samples() const {
  std::uint64_t sum = 0;
  for (TileIndex i = 0; i < tiles_.size(); ++i)
    if (tiles_[i]) sum += tiles_[i]->spp() * static_cast<std::uint64_t>(grid_.rect(i).pixels());
  return sum;
}

std::uint64_t Film::memory_bytes() const {
  std::uint64_t sum = 0;
  for (const auto& tile : tiles_)
    if (tile)
      sum += tile->sums.size() * sizeof(double) + tile->ids.size() * sizeof(float) +
             (tile->tail ? tile->tail->sums.size() * sizeof(float) : 0);
  return sum;
}

TileError Film::error() const {
  TileError sum;
  for (TileIndex i = 0; i < tiles_.size(); ++i)
    if (tiles_[i]) sum.add(tiles_[i]->error);
  return sum;
}

Film Film::row(int row) const {
  const auto columns = static_cast<std::size_t>(grid_.columns());
  const std::size_t first = static_cast<std::size_t>(row) * columns;
  Film band({{grid_.frame.width, grid_.rect(static_cast<TileIndex>(first)).height()}, grid_.tile}, aovs_);
  std::copy_n(tiles_.begin() + static_cast<std::ptrdiff_t>(first), columns, band.tiles_.begin());
  return band;
}

Film Film::mixed(std::span<const GroupFactors> factors) const {
  CHECK(aovs_.has(Aov::light_groups) && factors.size() == aovs_.groups(), "a mix of {} groups out of {}",
        factors.size(), aovs_.groups());
  const AovPlanes from = planes_of(aovs_);
  AovSet rest;
  for (const AovRow& row : aov_rows())
    if (aovs_.has(row.aov) && row.kind != AovKind::groups) rest = rest.with(row.aov);
  // Returns the mixed colour planes, and the planes that stay as they are, of sums in the form of Tile::sums.
  const auto mix = [&](const auto& sums, std::size_t pixels) {
    using Value = typename std::decay_t<decltype(sums)>::value_type;
    std::vector<double> colour(kPartialChannels * pixels);
    std::vector<Value> kept;
    for (std::size_t p = 0; p < from.sums.size(); ++p) {
      const AovPlane& plane = from.sums[p];
      const auto begin = sums.begin() + static_cast<std::ptrdiff_t>((kPartialChannels + p) * pixels);
      if (plane.hits || row_of(plane.aov).kind != AovKind::groups) {
        kept.insert(kept.end(), begin, begin + static_cast<std::ptrdiff_t>(pixels));
        continue;
      }
      const auto c = static_cast<std::size_t>(plane.component);
      const GroupFactors& f = factors[plane.group];
      // The plane of a group has the light of its media, too.
      const double factor = plane.aov == Aov::light_groups ? f.surface[c] : f.volume[c] - f.surface[c];
      double* to = &colour[(3 * static_cast<std::size_t>(plane.half) + c) * pixels];
      for (std::size_t i = 0; i < pixels; ++i)
        to[i] += factor * double{begin[static_cast<std::ptrdiff_t>(i)]};
    }
    std::vector<Value> out(colour.begin(), colour.end());
    out.insert(out.end(), kept.begin(), kept.end());
    return out;
  };
  Film out(grid_, rest);
  for (TileIndex t = 0; t < tiles_.size(); ++t) {
    if (!tiles_[t]) continue;
    const auto pixels = static_cast<std::size_t>(grid_.rect(t).pixels());
    auto next = std::make_shared<Tile>();
    next->full_rounds = tiles_[t]->full_rounds;
    next->chain = tiles_[t]->chain;
    next->sums = mix(tiles_[t]->sums, pixels);
    next->ids = tiles_[t]->ids;
    if (const auto& tail = tiles_[t]->tail) {
      auto sums = mix(tail->sums, pixels);
      sums.insert(sums.end(), tail->sums.begin() + static_cast<std::ptrdiff_t>(planes_.sums * pixels),
                  tail->sums.end());
      next->tail = Tail{tail->samples, tail->digest, std::move(sums)};
    }
    next->error = estimate(*next, nullptr, grid_.rect(t), grid_.meters);
    out.tiles_[t] = std::move(next);
  }
  return out;
}

bool Film::operator==(const Film& other) const {
  if (grid_ != other.grid_ || aovs_ != other.aovs_) return false;
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    const Tile *a = tiles_[i].get(), *b = other.tiles_[i].get();
    if (a != b && (!a || !b || !(*a == *b))) return false;
  }
  return true;
}

}  // namespace ls

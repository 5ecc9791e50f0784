#include "worker/render/lights/emissive_grids.h"

#include <algorithm>
#include <cmath>

#include "worker/render/media/emission.h"

namespace ls::render {
namespace {

// The emission of a cell is the mean of that at points this many voxels apart along each axis.
constexpr int kVoxelsPerPoint = 2;
// The most points along each axis of a cell. Cells of stored values that are not very large have no more.
constexpr int kMostPoints = 8;
// A cell that may emit is chosen at least as often as if it gave off this share of the mean of such cells, as
// its points may miss what emits in it.
constexpr double kLeastShare = 1. / 64;
// The number of 32-bit words, which a choice divides among the cells.
constexpr double kAllWords = 0x1p32;

// Returns the grid whose cells tell where the medium emits, or null if there is none.
const Grid* guide_of(const Medium& m) {
  if (m.emission_kind == EmissionKind::none) return nullptr;
  if (m.emitter[0]) return m.emitter[0];
  return m.emission_kind == EmissionKind::per_length ? nullptr : m.density;
}

// A macro cell as a box in the grid's index coordinates
struct CellBox {
  V3d lo, size;
  double volume() const { return size.x * size.y * size.z; }
};
CellBox box_of(const Grid& grid, std::size_t number) {
  const std::array<int, 3> cells = grid.cells();
  const auto nx = static_cast<std::size_t>(cells[0]), ny = static_cast<std::size_t>(cells[1]);
  const std::size_t at[3] = {number % nx, number / nx % ny, number / (nx * ny)};
  CellBox box;
  for (int k = 0; k < 3; ++k) {
    box.lo[k] = double{grid.domain_lo()[k]} + static_cast<double>(at[k]) * grid.cell_size();
    box.size[k] =
        std::clamp(double{grid.domain_hi()[k]} - box.lo[k], 0., static_cast<double>(grid.cell_size()));
  }
  return box;
}

double mean_emission(const Medium& m, const Grid& grid, const Affine& to_world, const CellBox& box) {
  const int n = std::min(grid.cell_size() / kVoxelsPerPoint, kMostPoints);
  double sum = 0;
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const V3d q = box.lo + box.size * V3d((x + .5) / n, (y + .5) / n, (z + .5) / n);
        const C3 e = emission_at(m, V3(to_world.point(q)));
        sum += (double{e.x} + double{e.y} + double{e.z}) / 3;
      }
  return sum / (static_cast<double>(n) * n * n);
}

}  // namespace

EmissiveGrids::EmissiveGrids(std::span<const Medium> media) {
  std::vector<std::vector<double>> powers;
  double total = 0, volume_of_all = 0;
  for (std::size_t index = 0; index < media.size(); ++index) {
    const Medium& m = media[index];
    const Grid* const grid = guide_of(m);
    if (!grid || !grid->world_to_index().invertible()) continue;
    Source s{&m, static_cast<std::uint32_t>(index), grid, grid->world_to_index().inverse(), {}, {}};
    const std::array<int, 3> cells = grid->cells();
    const auto count = static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1]) *
                       static_cast<std::size_t>(cells[2]);
    s.densities.assign(count, 0);
    std::vector<double> power(count, 0);
    const double per_index = std::abs(s.to_world.determinant());
    for (std::size_t i = 0; i < count; ++i) {
      // Only the first channel's values are bounded by the cell.
      if (m.emitter[1] == m.emitter[0] && !may_emit(m, grid->cell(i).hi)) continue;
      const CellBox box = box_of(*grid, i);
      s.densities[i] = box.volume() * per_index;
      volume_of_all += s.densities[i];
      total += power[i] = mean_emission(m, *grid, s.to_world, box) * s.densities[i];
    }
    sources_.push_back(std::move(s));
    powers.push_back(std::move(power));
  }
  const double least = total / volume_of_all * kLeastShare;
  if (!(total > 0 && least > 0) || !std::isfinite(total + volume_of_all)) {
    sources_.clear();
    return;
  }
  total = 0;
  for (std::size_t k = 0; k < sources_.size(); ++k)
    for (std::size_t i = 0; i < powers[k].size(); ++i)
      total += powers[k][i] = std::max(powers[k][i], least * sources_[k].densities[i]);
  std::uint64_t count = 0;
  for (const auto& power : powers)
    count += static_cast<std::uint64_t>(std::ranges::count_if(power, [](double p) { return p > 0; }));
  // One word for each cell, as all that may emit must be found, and the others in proportion
  const double to_share = kAllWords - static_cast<double>(count);
  if (!(to_share > 0)) {
    sources_.clear();
    return;
  }
  found_.assign(media.size(), false);
  double before = 0;
  std::uint64_t word = 0, cells = 0;
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    Source& s = sources_[k];
    found_[s.index] = true;
    s.first = first_words_.size();
    for (std::size_t i = 0; i < s.densities.size(); ++i) {
      if (!(powers[k][i] > 0)) {
        s.densities[i] = 0;
        continue;
      }
      before += powers[k][i];
      const auto next = ++cells + static_cast<std::uint64_t>(std::round(before / total * to_share));
      s.densities[i] = static_cast<double>(next - word) / kAllWords / s.densities[i];
      s.cells.push_back(static_cast<std::uint32_t>(i));
      first_words_.push_back(static_cast<std::uint32_t>(word));
      word = next;
    }
  }
}

std::optional<EmissiveGrids::Point> EmissiveGrids::sample(const V3& x, const Group& numbers,
                                                          RandomStream& stream) const {
  const auto chosen = static_cast<std::size_t>(
      std::upper_bound(first_words_.begin(), first_words_.end(), numbers.bits[0]) - first_words_.begin() - 1);
  std::size_t k = sources_.size() - 1;
  while (sources_[k].first > chosen || sources_[k].cells.empty()) --k;
  const Source& s = sources_[k];
  const CellBox box = box_of(*s.grid, s.cells[chosen - s.first]);
  const V3d towards =
      s.to_world.point(box.lo + box.size * V3d(numbers.u(1), numbers.u(2), numbers.u(3))) - V3d(x);
  const double length = std::sqrt(towards.dot(towards));
  if (!(length > 0 && std::isfinite(length))) return std::nullopt;
  Point found;
  found.w = normalize(V3(towards * (1 / length)));
  const Sums all = sums(x, found.w);
  found.pdf = static_cast<float>(all.by_angle);
  if (!(found.pdf > 0 && all.by_length > 0) || !std::isfinite(found.pdf)) return std::nullopt;
  double left = double{stream.uniform()} * all.by_length;
  for (const Source& on_ray : sources_)
    for (CellWalk walk(*on_ray.grid, x, found.w, 0, kInfinity); walk.next();) {
      const double t0 = walk.begin(), length_in_cell = double{walk.end()} - t0;
      const double density = on_ray.densities[walk.number(*on_ray.grid)], part = density * length_in_cell;
      if (!(part > 0)) continue;
      if (left >= part) {
        left -= part;
        continue;
      }
      const double t = walk.entry() + t0 + left / density;
      found.distance = static_cast<float>(t);
      found.pdf_of_distance = static_cast<float>(density / all.by_length);
      found.medium = on_ray.index;
      found.emission = emission_at(*on_ray.medium, x + found.w * found.distance);
      return found;
    }
  return std::nullopt;  // by rounding of the sum
}

EmissiveGrids::Sums EmissiveGrids::sums(const V3& x, const V3& w) const {
  Sums sums;
  for (const Source& s : sources_)
    for (CellWalk walk(*s.grid, x, w, 0, kInfinity); walk.next();) {
      const double density = s.densities[walk.number(*s.grid)];
      if (!(density > 0)) continue;
      const double t0 = walk.entry() + double{walk.begin()}, t1 = walk.entry() + double{walk.end()};
      const double part = density * (double{walk.end()} - double{walk.begin()});
      sums.by_length += part;
      sums.by_angle += part * (t1 * t1 + t1 * t0 + t0 * t0) / 3;
    }
  return sums;
}

std::uint64_t EmissiveGrids::bytes() const {
  std::uint64_t bytes = first_words_.size() * sizeof(first_words_[0]);
  for (const Source& s : sources_)
    bytes += s.densities.size() * sizeof(s.densities[0]) + s.cells.size() * sizeof(s.cells[0]);
  return bytes;
}

}  // namespace ls::render

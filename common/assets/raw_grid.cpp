#include "common/assets/raw_grid.h"

#include <fmt/format.h>

#include <cmath>

#include "common/assets/bytes.h"

namespace ls {
namespace {

constexpr std::size_t kHeader = 36;

tl::unexpected<Error> bad_grid(std::string_view name, const std::string& text) {
  return fail(Errc::invalid_argument, fmt::format("'{}': {}", name, text));
}

// Reads the header; the result has no values yet.
Result<GridData> read_grid_header(std::string_view name, ByteReader& r, std::size_t size) {
  if (size < kHeader)
    return bad_grid(
        name, fmt::format("the file has {} bytes, fewer than the {} of a .bin grid's header", size, kHeader));
  GridData g;
  g.channels = 1;
  std::uint64_t count = 1;
  for (std::uint32_t* side : {&g.nx, &g.ny, &g.nz}) {
    const auto n = *r.take<std::int32_t>();
    if (n < 2 || static_cast<std::uint32_t>(n) > kMaxGridSide)
      return bad_grid(name,
                      fmt::format("has {} nodes along an axis; 2 to {} are allowed. A .bin grid begins with "
                                  "three int32, little endian",
                                  n, kMaxGridSide));
    count *= * side = static_cast<std::uint32_t>(n);
  }
  for (auto* corner : {&g.bbox_min, &g.bbox_max})
    for (float& x : *corner) x = *r.take<float>();
  for (std::size_t a = 0; a < 3; ++a)
    if (!std::isfinite(g.bbox_min[a]) || !std::isfinite(g.bbox_max[a]) || !(g.bbox_min[a] < g.bbox_max[a]))
      return bad_grid(name, fmt::format("the bounding box is empty or not finite along axis {}: {} to {}", a,
                                        g.bbox_min[a], g.bbox_max[a]));
  if (count > kMaxGridValues)
    return fail(Errc::resource_exhausted,
                fmt::format("'{}': {} values, more than the limit of {}", name, count, kMaxGridValues));
  if (r.left() != count * sizeof(float))
    return bad_grid(name, fmt::format("{} x {} x {} nodes need {} bytes after the header, but {} are there",
                                      g.nx, g.ny, g.nz, count * sizeof(float), r.left()));
  return g;
}

}  // namespace

Result<GridData> decode_raw_grid(std::string_view name, std::span<const std::byte> file, GridOrder order) {
  ByteReader r(file);
  auto grid = read_grid_header(name, r, file.size());
  if (!grid) return grid;
  GridData& g = *grid;
  const std::size_t nx = g.nx, ny = g.ny, nz = g.nz;
  g.values.resize(nx * ny * nz);
  const bool x_fastest = order == GridOrder::x_fastest;
  for (std::size_t i = 0; i < g.values.size(); ++i) {
    const std::size_t x = x_fastest ? i % nx : i / nz / ny, y = x_fastest ? i / nx % ny : i / nz % ny,
                      z = x_fastest ? i / nx / ny : i % nz;
    float v = *r.take<float>();
    if (!std::isfinite(v))
      return bad_grid(name, fmt::format("the node ({}, {}, {}) is {}; repair the grid", x, y, z,
                                        std::isnan(v) ? "not a number" : "infinite"));
    if (v < 0) {
      v = 0;
      ++g.negatives;
    }
    g.values[(z * ny + y) * nx + x] = v;
  }
  return grid;
}

Result<GridData> load_raw_grid(const std::filesystem::path& path, std::string_view name, GridOrder order) {
  const auto bytes = read_asset(path, name);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_raw_grid(name, *bytes, order);
}

}  // namespace ls

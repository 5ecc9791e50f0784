#include "core/assets/grid_files.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <cmath>

#include "core/base/bytes.h"

namespace ls {
namespace {

enum VolType : std::int32_t { kFloat32 = 1, kFloat16 = 2, kUint8 = 3 };

std::size_t bytes_of(std::int32_t type) {
  return type == kFloat32 ? 4 : type == kFloat16 ? 2 : type == kUint8 ? 1 : 0;
}

float value(ByteReader& r, std::int32_t type) {  // the caller has checked that enough bytes are left
  if (type == kFloat32) return *r.take<float>();
  if (type == kUint8) return static_cast<float>(*r.take<std::uint8_t>()) / 255;
  Imath::half h;
  h.setBits(*r.take<std::uint16_t>());
  return h;
}

tl::unexpected<Error> bad_grid(std::string_view name, const std::string& text) {
  return bad_argument(fmt::format("'{}': {}", name, text));
}

Result<void> read_box(std::string_view name, ByteReader& r, GridData& g) {
  for (auto* corner : {&g.bbox_min, &g.bbox_max})
    for (float& x : *corner) x = *r.take<float>();
  for (std::size_t a = 0; a < 3; ++a)
    if (!std::isfinite(g.bbox_min[a]) || !std::isfinite(g.bbox_max[a]) || !(g.bbox_min[a] < g.bbox_max[a]))
      return bad_grid(name, fmt::format("the bounding box is empty or not finite along axis {}: {} to {}", a,
                                        g.bbox_min[a], g.bbox_max[a]));
  return {};
}

Result<void> check_count(std::string_view name, std::uint64_t count) {
  if (count <= kMaxGridBytes / sizeof(float)) return {};
  return fail(
      Errc::resource_exhausted,
      fmt::format("'{}': its {} values take {} MiB of memory, more than the limit of {} MiB; "
                  "make its voxels larger, or convert it to a .vdb, in which empty space takes no memory",
                  name, count, count * sizeof(float) >> 20, kMaxGridBytes >> 20));
}

// Returns the error for the value `v`, which is not finite. (x, y, z) is its voxel or node.
tl::unexpected<Error> bad_value(std::string_view name, const char* what, std::uint64_t x, std::uint64_t y,
                                std::uint64_t z, float v) {
  return bad_grid(name, fmt::format("the {} ({}, {}, {}) is {}; repair the grid", what, x, y, z,
                                    std::isnan(v) ? "not a number" : "infinite"));
}

// Replaces a negative value by 0, and counts it.
float density(float v, GridData& g) {
  if (!(v < 0)) return v;
  ++g.negatives;
  return 0;
}

struct VolHeader {
  GridData grid;  // dimensions and channels; the values are not read yet
  std::int32_t type = 0;
  std::uint64_t count = 0;
};

Result<VolHeader> read_vol_header(std::string_view name, ByteReader& r, std::size_t size) {
  constexpr std::size_t kHeader = 48;
  if (size < kHeader)
    return bad_grid(name, fmt::format("{} bytes are too few for a .vol header of {}", size, kHeader));
  const auto magic = *r.take<std::array<char, 3>>();
  const int version = *r.take<std::uint8_t>();
  if (magic != std::array{'V', 'O', 'L'})
    return bad_grid(name, "does not begin with \"VOL\": not a Mitsuba grid");
  if (version != 3)
    return bad_grid(name, fmt::format("is version {} of the .vol format; only 3 is known", version));
  VolHeader h;
  h.type = *r.take<std::int32_t>();
  if (bytes_of(h.type) == 0)
    return bad_grid(
        name,
        fmt::format("has value type {} at byte 4; known are 1 (float32), 2 (float16), 3 (uint8)", h.type));
  std::uint32_t* const sides[] = {&h.grid.nx, &h.grid.ny, &h.grid.nz};
  h.count = 1;
  for (std::uint32_t* side : sides) {
    const auto n = *r.take<std::int32_t>();
    if (n < 1 || static_cast<std::uint32_t>(n) > kMaxGridSide)
      return bad_grid(name, fmt::format("has {} voxels along an axis; 1 to {} are allowed", n, kMaxGridSide));
    h.count *= * side = static_cast<std::uint32_t>(n);
  }
  const auto channels = *r.take<std::int32_t>();
  if (channels != 1 && channels != 3)
    return bad_grid(name, fmt::format("has {} channels; 1 or 3 are allowed", channels));
  h.grid.channels = static_cast<std::uint32_t>(channels);
  h.count *= h.grid.channels;
  if (const auto read = read_box(name, r, h.grid); !read) return tl::unexpected(read.error());
  if (const auto few = check_count(name, h.count); !few) return tl::unexpected(few.error());
  return h;
}

constexpr std::size_t kRawHeader = 36;

// Reads the header, and returns a grid without values.
Result<GridData> read_raw_header(std::string_view name, ByteReader& r, std::size_t size) {
  if (size < kRawHeader)
    return bad_grid(name, fmt::format("the file has {} bytes, fewer than the {} of a .bin grid's header",
                                      size, kRawHeader));
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
  if (const auto read = read_box(name, r, g); !read) return tl::unexpected(read.error());
  if (const auto few = check_count(name, count); !few) return tl::unexpected(few.error());
  if (r.left() != count * sizeof(float))
    return bad_grid(name, fmt::format("{} x {} x {} nodes need {} bytes after the header, but {} are there",
                                      g.nx, g.ny, g.nz, count * sizeof(float), r.left()));
  return g;
}

}  // namespace

Result<GridData> decode_vol(std::string_view name, std::span<const std::byte> file) {
  ByteReader r(file);
  auto header = read_vol_header(name, r, file.size());
  if (!header) return tl::unexpected(header.error());
  GridData& g = header->grid;
  const std::uint64_t want = header->count * bytes_of(header->type);
  if (r.left() != want)
    return bad_grid(
        name,
        fmt::format("{} x {} x {} voxels of {} channel(s) need {} bytes after the header, but {} are there",
                    g.nx, g.ny, g.nz, g.channels, want, r.left()));
  g.values.resize(header->count);
  for (std::uint64_t i = 0; i < header->count; ++i) {
    const float v = value(r, header->type);
    if (const std::uint64_t voxel = i / g.channels; !std::isfinite(v))
      return bad_value(name, "voxel", voxel % g.nx, voxel / g.nx % g.ny, voxel / g.nx / g.ny, v);
    g.values[i] = density(v, g);
  }
  return std::move(g);
}

Result<GridData> load_vol(const std::filesystem::path& path, std::string_view name) {
  const auto bytes = read_asset(path, name);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_vol(name, *bytes);
}

Result<GridData> decode_raw_grid(std::string_view name, std::span<const std::byte> file, GridOrder order) {
  ByteReader r(file);
  auto grid = read_raw_header(name, r, file.size());
  if (!grid) return grid;
  GridData& g = *grid;
  const std::size_t nx = g.nx, ny = g.ny, nz = g.nz;
  g.values.resize(nx * ny * nz);
  const bool x_fastest = order == GridOrder::x_fastest;
  for (std::size_t i = 0; i < g.values.size(); ++i) {
    const std::size_t x = x_fastest ? i % nx : i / nz / ny, y = x_fastest ? i / nx % ny : i / nz % ny,
                      z = x_fastest ? i / nx / ny : i % nz;
    const float v = *r.take<float>();
    if (!std::isfinite(v)) return bad_value(name, "node", x, y, z, v);
    g.values[(z * ny + y) * nx + x] = density(v, g);
  }
  return grid;
}

Result<GridData> load_raw_grid(const std::filesystem::path& path, std::string_view name, GridOrder order) {
  const auto bytes = read_asset(path, name);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_raw_grid(name, *bytes, order);
}

}  // namespace ls

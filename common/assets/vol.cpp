#include "common/assets/vol.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <cmath>

#include "common/assets/bytes.h"

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

tl::unexpected<Error> bad_vol(std::string_view name, const std::string& text) {
  return fail(Errc::invalid_argument, fmt::format("'{}': {}", name, text));
}

struct Header {
  GridData grid;  // dimensions and channels, without values
  std::int32_t type = 0;
  std::uint64_t count = 0;
};

Result<Header> read_vol_header(std::string_view name, ByteReader& r, std::size_t size) {
  constexpr std::size_t kHeader = 48;
  if (size < kHeader)
    return bad_vol(name, fmt::format("{} bytes are too few for a .vol header of {}", size, kHeader));
  const auto magic = *r.take<std::array<char, 3>>();
  const int version = *r.take<std::uint8_t>();
  if (magic != std::array{'V', 'O', 'L'})
    return bad_vol(name, "does not begin with \"VOL\": not a Mitsuba grid");
  if (version != 3)
    return bad_vol(name, fmt::format("is version {} of the .vol format; only 3 is known", version));
  Header h;
  h.type = *r.take<std::int32_t>();
  if (bytes_of(h.type) == 0)
    return bad_vol(
        name,
        fmt::format("has value type {} at byte 4; known are 1 (float32), 2 (float16), 3 (uint8)", h.type));
  std::uint32_t* const sides[] = {&h.grid.nx, &h.grid.ny, &h.grid.nz};
  h.count = 1;
  for (std::uint32_t* side : sides) {
    const auto n = *r.take<std::int32_t>();
    if (n < 1 || static_cast<std::uint32_t>(n) > kMaxGridSide)
      return bad_vol(name, fmt::format("has {} voxels along an axis; 1 to {} are allowed", n, kMaxGridSide));
    h.count *= * side = static_cast<std::uint32_t>(n);
  }
  const auto channels = *r.take<std::int32_t>();
  if (channels != 1 && channels != 3)
    return bad_vol(name, fmt::format("has {} channels; 1 or 3 are allowed", channels));
  h.grid.channels = static_cast<std::uint32_t>(channels);
  h.count *= h.grid.channels;
  for (auto* corner : {&h.grid.bbox_min, &h.grid.bbox_max})
    for (float& x : *corner) x = *r.take<float>();
  for (int a = 0; a < 3; ++a)
    if (!std::isfinite(h.grid.bbox_min[a]) || !std::isfinite(h.grid.bbox_max[a]) ||
        !(h.grid.bbox_min[a] < h.grid.bbox_max[a]))
      return bad_vol(name, fmt::format("the bounding box is empty or not finite along axis {}: {} to {}", a,
                                       h.grid.bbox_min[a], h.grid.bbox_max[a]));
  if (h.count > kMaxGridValues)
    return fail(Errc::resource_exhausted,
                fmt::format("'{}': {} values, more than the limit of {}", name, h.count, kMaxGridValues));
  return h;
}

}  // namespace

Result<GridData> decode_vol(std::string_view name, std::span<const std::byte> file) {
  ByteReader r(file);
  auto header = read_vol_header(name, r, file.size());
  if (!header) return tl::unexpected(header.error());
  GridData& g = header->grid;
  const std::uint64_t want = header->count * bytes_of(header->type);
  if (r.left() != want)
    return bad_vol(
        name,
        fmt::format("{} x {} x {} voxels of {} channel(s) need {} bytes after the header, but {} are there",
                    g.nx, g.ny, g.nz, g.channels, want, r.left()));
  g.values.resize(header->count);
  for (std::uint64_t i = 0; i < header->count; ++i) {
    float v = value(r, header->type);
    if (!std::isfinite(v)) {
      const std::uint64_t voxel = i / g.channels;
      return bad_vol(name, fmt::format("the voxel ({}, {}, {}) is {}; repair the grid", voxel % g.nx,
                                       voxel / g.nx % g.ny, voxel / g.nx / g.ny,
                                       std::isnan(v) ? "not a number" : "infinite"));
    }
    if (v < 0) {
      v = 0;
      ++g.negatives;
    }
    g.values[i] = v;
  }
  return std::move(g);
}

Result<GridData> load_vol(const std::filesystem::path& path, std::string_view name) {
  const auto bytes = read_asset(path, name);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_vol(name, *bytes);
}

}  // namespace ls

#include "worker/render/media/vdb_reply.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

namespace ls::render {
namespace {

bool sound(const LsVdbGrid& grid, std::uint64_t count) {
  const auto usable = [](float v) { return std::isfinite(v) && v >= 0; };
  const auto finite = [](double v) { return std::isfinite(v); };
  return std::all_of(grid.index_to_scene, grid.index_to_scene + 16, finite) &&
         std::all_of(grid.values, grid.values + count, usable);
}

}  // namespace

tl::unexpected<Error> vdb_nonsense() {
  return fail(Errc::invalid_argument, "not a readable OpenVDB or NanoVDB file: reading it gave nonsense");
}

Result<LsVdbGrid> validated_grid(std::span<const std::byte> reply, std::uint64_t max_values) {
  if (reply.size() < kVdbValuesAt) return vdb_nonsense();
  VdbReply said;
  std::memcpy(&said, reply.data(), sizeof said);
  said.error[sizeof said.error - 1] = 0;
  if (said.magic != kVdbMagic || (said.code != 0 && said.error[0] == 0)) return vdb_nonsense();
  if (said.code != 0)
    return fail(said.code == 2 ? Errc::resource_exhausted : Errc::invalid_argument, std::string(said.error));
  LsVdbGrid grid = said.grid;
  // LsVdbGrid::values points to non-const floats, so the const_cast is needed. The file is mapped read-only,
  // and the values are never written.
  grid.values = reinterpret_cast<float*>(const_cast<std::byte*>(reply.data()) + kVdbValuesAt);
  const std::uint64_t count = values_of(grid);
  if (count == 0 || count > max_values || count > (reply.size() - kVdbValuesAt) / sizeof(float) ||
      !sound(grid, count))
    return vdb_nonsense();
  return grid;
}

}  // namespace ls::render

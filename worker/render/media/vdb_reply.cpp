#include "worker/render/media/vdb_reply.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

namespace ls::render {
namespace {

bool sound(const VdbShape& shape) {
  for (const std::int32_t n : shape.size)
    if (n < 1 || n > kMaxVdbSide) return false;
  for (const std::int32_t n : shape.lead)
    if (n < 0 || n >= kNodeSide) return false;
  return (shape.channels == 1 || shape.channels == 3) &&
         std::all_of(shape.index_to_scene, shape.index_to_scene + 16,
                     [](double v) { return std::isfinite(v); });
}

// Reads the part of a reply that follows its head.
class Rest {
 public:
  explicit Rest(std::span<const std::byte> bytes) : bytes_(bytes) {}

  // Takes the next `count` elements; nullopt if there are not so many.
  template <class T>
  std::optional<std::span<const T>> take(std::uint64_t count) {
    if (count > bytes_.size() / sizeof(T)) return std::nullopt;
    const std::span taken(reinterpret_cast<const T*>(bytes_.data()), count);
    bytes_ = bytes_.subspan(std::min((count * sizeof(T) + 3) / 4 * 4, bytes_.size()));
    return taken;
  }

 private:
  std::span<const std::byte> bytes_;
};

std::optional<BrickTables> bricks(const VdbShape& shape, const VdbReply::Counts& counts, Rest& rest) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 32;  // what numbers of 32 bits can tell apart
  if (counts.nodes > kMost || counts.bricks > kMost) return std::nullopt;
  const auto table = rest.take<std::uint32_t>(table_entries(shape.size_of_box(), shape.lead_of_box()));
  if (!table) return std::nullopt;
  const auto nodes = rest.take<std::uint32_t>(counts.nodes * kNodeEntries);
  if (!nodes) return std::nullopt;
  const std::uint64_t values = counts.bricks * kBrickValues;
  if (counts.halves > 1) return std::nullopt;
  const auto floats = rest.take<float>(counts.halves ? 0 : values);
  const auto halves = rest.take<std::uint16_t>(counts.halves ? values : 0);
  if (!floats || !halves) return std::nullopt;
  const BrickTables tables{*table, *nodes, *floats, *halves};
  const auto usable = [](auto v) { return std::isfinite(as_float(v)) && as_float(v) >= 0; };
  if (!Bricks::sound(shape.size_of_box(), shape.lead_of_box(), tables) ||
      !std::ranges::all_of(tables.floats, usable) || !std::ranges::all_of(tables.halves, usable))
    return std::nullopt;
  return tables;
}

}  // namespace

tl::unexpected<Error> vdb_nonsense() {
  return fail(Errc::invalid_argument, "not a readable OpenVDB or NanoVDB file: reading it gave nonsense");
}

Result<VdbView> validated_grid(std::span<const std::byte> reply, std::uint64_t max_bytes) {
  if (reply.size() < kVdbBricksAt) return vdb_nonsense();
  VdbReply said;
  std::memcpy(&said, reply.data(), sizeof said);
  said.error[sizeof said.error - 1] = 0;
  if (said.magic != kVdbMagic || (said.code != 0 && said.error[0] == 0)) return vdb_nonsense();
  if (said.code != 0)
    return fail(said.code == 2 ? Errc::resource_exhausted : Errc::invalid_argument, std::string(said.error));
  if (!sound(said.shape) || (reply.size() - kVdbBricksAt) / 2 > max_bytes / 2 + kVdbPadding / 2)
    return vdb_nonsense();
  VdbView grid{said.shape, {}};
  Rest rest(reply.subspan(kVdbBricksAt));
  for (int c = 0; c < said.shape.channels; ++c) {
    const auto found = bricks(said.shape, said.counts[c], rest);
    if (!found) return vdb_nonsense();
    grid.channels.push_back(*found);
  }
  return grid;
}

}  // namespace ls::render

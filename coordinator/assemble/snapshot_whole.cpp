#include "coordinator/assemble/snapshot_whole.h"

#include <bit>
#include <cstring>

#include "coordinator/store/files.h"

namespace ls::coordinator {
namespace {

static_assert(std::endian::native == std::endian::little);
constexpr std::string_view kNoHealth = "";
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 40;

std::optional<std::span<const std::byte>> take_part(std::span<const std::byte>& in) {
  std::uint64_t length = 0;
  if (in.size() < sizeof length) return std::nullopt;
  std::memcpy(&length, in.data(), sizeof length);
  in = in.subspan(sizeof length);
  if (length > in.size()) return std::nullopt;
  const std::optional part(in.first(static_cast<std::size_t>(length)));
  in = in.subspan(static_cast<std::size_t>(length));
  return part;
}

}  // namespace

std::optional<Assembly> load_whole_snapshot(const std::filesystem::path& path, const TileGrid& grid,
                                            bool keep_relative, std::string_view format, AovSet aovs) {
  constexpr std::size_t kSeal = 32;
  const auto read = read_file(path, kMostBytes);
  if (!read || read->size() < kWholeSnapshotMagic.size() + kSeal) return std::nullopt;
  const std::span<const std::byte> bytes = *read;
  const auto body = bytes.first(bytes.size() - kSeal);
  if (std::memcmp(sha256(body).bytes.data(), bytes.data() + body.size(), kSeal) != 0) return std::nullopt;
  auto rest = body.subspan(kWholeSnapshotMagic.size());
  const auto by = take_part(rest);
  const auto film_bytes = take_part(rest);
  const auto error_bytes = take_part(rest);
  // The first snapshots that were written had no health part.
  const std::optional<std::span<const std::byte>> health_bytes =
      rest.empty() ? std::as_bytes(std::span(kNoHealth)) : take_part(rest);
  if (!by || !film_bytes || !error_bytes || !health_bytes || !rest.empty()) return std::nullopt;
  if (std::string_view(reinterpret_cast<const char*>(by->data()), by->size()) != format) return std::nullopt;
  auto film = Film::load(*film_bytes);
  if (!film || film->grid() != grid || film->aovs() != aovs) return std::nullopt;
  auto errors = RoundErrors::load(*error_bytes, grid.count(), keep_relative);
  if (!errors) return std::nullopt;
  auto health =
      HealthTable::load({reinterpret_cast<const char*>(health_bytes->data()), health_bytes->size()});
  if (!health) return std::nullopt;
  return Assembly(std::move(*film), std::move(*errors), std::move(*health));
}

}  // namespace ls::coordinator

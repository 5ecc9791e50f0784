#include <bit>
#include <cstring>
#include <string_view>

#include "coordinator/assemble/assembly.h"

namespace ls::coordinator {
namespace {

static_assert(std::endian::native == std::endian::little);
constexpr std::string_view kMagic = "LSSNAP1\n", kNoHealth = "{}\n";

void put_part(std::vector<std::byte>& out, std::span<const std::byte> part) {
  const std::uint64_t length = part.size();
  const auto raw = std::as_bytes(std::span(&length, 1));
  out.insert(out.end(), raw.begin(), raw.end());
  out.insert(out.end(), part.begin(), part.end());
}

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

std::vector<std::byte> save_snapshot(const Film& film, const RoundErrors& errors, const HealthBook& health,
                                     std::string_view build) {
  std::vector<std::byte> out;
  const auto magic = std::as_bytes(std::span(kMagic));
  out.insert(out.end(), magic.begin(), magic.end());
  put_part(out, std::as_bytes(std::span(build)));
  put_part(out, film.save());
  put_part(out, errors.save());
  const std::string told = health.save();
  put_part(out, std::as_bytes(std::span(told)));
  const Digest digest = sha256(std::span<const std::byte>(out));
  const auto seal = std::as_bytes(std::span(digest.bytes));
  out.insert(out.end(), seal.begin(), seal.end());
  return out;
}

std::optional<Assembly> load_snapshot(std::span<const std::byte> bytes, const TileGrid& grid,
                                      bool keep_relative, std::string_view build, AovSet aovs) {
  constexpr std::size_t kSeal = 32;
  if (bytes.size() < kMagic.size() + kSeal) return std::nullopt;
  if (std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0) return std::nullopt;
  const auto body = bytes.first(bytes.size() - kSeal);
  if (std::memcmp(sha256(body).bytes.data(), bytes.data() + body.size(), kSeal) != 0) return std::nullopt;
  auto rest = body.subspan(kMagic.size());
  const auto by = take_part(rest);
  const auto film_bytes = take_part(rest);
  const auto error_bytes = take_part(rest);
  // Those of older programs have none.
  const std::optional<std::span<const std::byte>> health_bytes =
      rest.empty() ? std::as_bytes(std::span(kNoHealth)) : take_part(rest);
  if (!by || !film_bytes || !error_bytes || !health_bytes || !rest.empty()) return std::nullopt;
  if (std::string_view(reinterpret_cast<const char*>(by->data()), by->size()) != build) return std::nullopt;
  auto film = Film::load(*film_bytes);
  if (!film || film->grid() != grid || film->aovs() != aovs) return std::nullopt;
  auto errors = RoundErrors::load(*error_bytes, grid.count(), keep_relative);
  if (!errors) return std::nullopt;
  auto health = HealthBook::load({reinterpret_cast<const char*>(health_bytes->data()), health_bytes->size()});
  if (!health) return std::nullopt;
  return Assembly(std::move(*film), std::move(*errors), std::move(*health));
}

}  // namespace ls::coordinator

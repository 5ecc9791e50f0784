#include "coordinator/assemble/snapshot.h"

#include <fcntl.h>

#include <array>
#include <bit>
#include <cstring>

namespace ls::coordinator {
namespace {

static_assert(std::endian::native == std::endian::little);
constexpr std::string_view kMagic = "LSSNAP2\n";
constexpr std::uint32_t kEnd = ~std::uint32_t{0};
// A tile has three parts: film, errors and health. Each has at most this many bytes
constexpr std::uint64_t kMostPart = std::uint64_t{1} << 32;

// Lengths, in bytes, of the three parts of a tile: film, errors and health
using Lengths = std::array<std::uint64_t, 3>;

std::vector<std::byte> head_of(const TileGrid& grid, AovSet aovs, std::string_view format) {
  const auto magic = std::as_bytes(std::span(kMagic)), name = std::as_bytes(std::span(format));
  std::vector<std::byte> out(magic.begin(), magic.end());
  append_value(out, std::uint64_t{format.size()});
  out.insert(out.end(), name.begin(), name.end());
  for (const int side : {grid.frame.width, grid.frame.height, grid.tile}) append_value(out, side);
  // Names, because the numbers of AOVs change when one is added
  for (const std::string& plane : planes_of(aovs).names) {
    const auto bytes = std::as_bytes(std::span(plane));
    out.insert(out.end(), bytes.begin(), bytes.end());
    out.push_back(std::byte{'\n'});
  }
  return out;
}

// Reads a file from the front and hashes all bytes that it reads.
class Source {
 public:
  explicit Source(std::filesystem::path path) : path_(std::move(path)) {
    if (auto file = File::open(path_, O_RDONLY)) file_ = std::move(*file);
  }
  // Returns the next `bytes` bytes of the file; nullopt if fewer are left.
  std::optional<std::vector<std::byte>> take(std::uint64_t bytes) {
    if (!file_ || bytes > kMostPart) return std::nullopt;
    auto read = read_at(file_, at_, static_cast<std::size_t>(bytes), path_);
    if (!read) return std::nullopt;
    at_ += bytes;
    hash_.update(std::span<const std::byte>(*read));
    return std::move(*read);
  }
  template <class T>
  std::optional<T> value() {
    const auto raw = take(sizeof(T));
    if (!raw) return std::nullopt;
    T v{};
    std::memcpy(&v, raw->data(), sizeof v);
    return v;
  }
  // True if the rest of the file is exactly the seal: the SHA-256 of all bytes read before it.
  bool sealed() {
    const Digest read = hash_.finish();
    const auto seal = take(sizeof read.bytes);
    return seal && std::memcmp(seal->data(), read.bytes.data(), sizeof read.bytes) == 0 && !take(1);
  }

 private:
  std::filesystem::path path_;
  File file_;
  std::uint64_t at_ = 0;
  Sha256 hash_;
};

// Reads one tile into `film` and `errors`, and appends its health to the text `health`, which the caller
// passes to HealthTable::load() after the last tile. False: the file is damaged.
bool read_tile(Source& in, TileIndex tile, Film& film, RoundErrors& errors, std::string& health) {
  const auto lengths = in.value<Lengths>();
  if (!lengths) return false;
  const auto film_bytes = in.take((*lengths)[0]), error_bytes = in.take((*lengths)[1]),
             text = in.take((*lengths)[2]);
  if (!film_bytes || !error_bytes || !text || film_bytes->empty()) return false;
  health.append(reinterpret_cast<const char*>(text->data()), text->size());
  return film.load_tile(tile, *film_bytes).has_value() && errors.load_tile(tile, *error_bytes).has_value();
}

}  // namespace

TileSnapshot snapshot_of(const Film& film, const RoundErrors& errors, const HealthTable& health,
                         TileIndex tile) {
  return {tile, film.saver(tile), errors.save_tile(tile), health.save_tile(tile)};
}

Result<SnapshotFile> SnapshotFile::create(const std::filesystem::path& path, std::string_view suffix,
                                          const TileGrid& grid, AovSet aovs, std::string_view format) {
  auto file = AtomicFile::create(path, suffix);
  if (!file) return tl::unexpected(file.error());
  SnapshotFile snapshot(std::move(*file));
  if (auto written = snapshot.put(head_of(grid, aovs, format)); !written)
    return tl::unexpected(written.error());
  return snapshot;
}

Result<void> SnapshotFile::put(std::span<const std::byte> bytes) {
  hash_.update(bytes);
  return file_.write(bytes);
}

Result<void> SnapshotFile::add(const TileSnapshot& tile) {
  const auto film = tile.film();
  if (film.empty()) return {};
  std::vector<std::byte> head;
  append_value(head, tile.tile);
  append_value(head, Lengths{film.size(), tile.errors.size(), tile.health.size()});
  for (const std::span<const std::byte> part :
       {std::span<const std::byte>(head), std::span<const std::byte>(film),
        std::span<const std::byte>(tile.errors), std::as_bytes(std::span(tile.health))})
    if (auto written = put(part); !written) return written;
  return {};
}

Result<void> SnapshotFile::finish() {
  if (auto written = put(std::as_bytes(std::span(&kEnd, 1))); !written) return written;
  const Digest seal = hash_.finish();
  if (auto written = file_.write(std::as_bytes(std::span(seal.bytes))); !written) return written;
  return file_.sync();
}

Result<void> SnapshotFile::commit() { return file_.commit(); }

std::optional<Assembly> load_snapshot(const std::filesystem::path& path, const TileGrid& grid,
                                      bool keep_relative, std::string_view format, AovSet aovs) {
  Source in(path);
  const auto expected = head_of(grid, aovs, format);
  const auto head = in.take(expected.size());
  if (!head || *head != expected) return std::nullopt;
  Film film(grid, aovs);
  RoundErrors errors(grid.count(), keep_relative);
  std::string health;
  while (const auto tile = in.value<std::uint32_t>()) {
    if (*tile == kEnd) {
      auto health_table = HealthTable::load(health);
      if (!in.sealed() || !health_table) return std::nullopt;
      return Assembly(std::move(film), std::move(errors), std::move(*health_table));
    }
    if (*tile >= grid.count() || !read_tile(in, *tile, film, errors, health)) return std::nullopt;
  }
  return std::nullopt;
}

std::optional<SnapshotTiles> SnapshotTiles::open(const std::filesystem::path& path, const TileGrid& grid,
                                                 AovSet aovs, std::string_view format) {
  SnapshotTiles out;
  out.path_ = path;
  out.places_.resize(grid.count());
  auto file = File::open(path, O_RDONLY);
  if (!file) return std::nullopt;
  out.file_ = std::move(*file);
  const auto expected = head_of(grid, aovs, format);
  const auto head = read_at(out.file_, 0, expected.size(), path);
  if (!head || *head != expected) return std::nullopt;
  constexpr std::size_t kHead = sizeof(std::uint32_t) + sizeof(Lengths);
  for (std::uint64_t at = expected.size();;) {
    std::uint32_t tile = 0;
    const auto number = read_at(out.file_, at, sizeof tile, path);
    if (!number) return std::nullopt;
    std::memcpy(&tile, number->data(), sizeof tile);
    if (tile == kEnd) return out;
    const auto raw = read_at(out.file_, at, kHead, path);
    if (tile >= grid.count() || !raw) return std::nullopt;
    Lengths lengths{};
    std::memcpy(lengths.data(), raw->data() + sizeof tile, sizeof lengths);
    at += kHead;
    out.places_[tile] = {at, lengths[0]};
    for (const std::uint64_t length : lengths) {
      if (length > kMostPart) return std::nullopt;
      at += length;
    }
  }
}

Result<void> SnapshotTiles::load(TileIndex tile, Film& film) const {
  const Place& place = places_[tile];
  if (place.length == 0) return {};
  const auto bytes = read_at(file_, place.at, static_cast<std::size_t>(place.length), path_);
  if (!bytes) return tl::unexpected(bytes.error());
  return film.load_tile(tile, *bytes);
}

}  // namespace ls::coordinator

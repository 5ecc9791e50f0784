// A snapshot is a file with a job's image so far, tile by tile. Writing or reading it needs memory for one
// tile besides the film (the image in memory). Each tile is saved as it was when snapshot_of() was called, so
// folding (adding rounds of samples to the film) may continue meanwhile. After a restart, rounds that are not
// in the snapshot are folded again from the partials (the stored results). Layout:
//    "LSSNAP2\n", u64 length and characters of `format` (the caller's string; with another one the file is
//    rejected), i32 width, height and side of a tile, u32 AOVs; per tile u32 index, u64 lengths of its three
//    parts, and the parts: pixel sums (film_bytes.cpp), error sums (RoundErrors), counts of bad samples
//    (HealthTable); u32 2^32 - 1 as the end mark; SHA-256 of all preceding bytes
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/assemble/assembly.h"
#include "coordinator/store/files.h"
#include "core/base/digest.h"

namespace ls::coordinator {

struct TileSnapshot {
  TileIndex tile = 0;
  std::function<std::vector<std::byte>()> film;  // returns the bytes of the tile's pixels (Film::saver)
  std::vector<std::byte> errors;
  std::string health;
};
TileSnapshot snapshot_of(const Film& film, const RoundErrors& errors, const HealthTable& health,
                         TileIndex tile);

class SnapshotFile {
 public:
  // Creates the file under the name `path` followed by `suffix`; commit() gives it the name `path`.
  static Result<SnapshotFile> create(const std::filesystem::path& path, std::string_view suffix,
                                     const TileGrid& grid, AovSet aovs, std::string_view format);
  // Writes one tile; call it once for each tile. A tile without samples is left out
  Result<void> add(const TileSnapshot& tile);
  // Writes the SHA-256 and makes the file durable, still under its temporary name
  Result<void> finish();
  Result<void> commit();  // gives the file its final name; call after finish()

 private:
  explicit SnapshotFile(AtomicFile file) : file_(std::move(file)) {}
  Result<void> put(std::span<const std::byte> bytes);
  AtomicFile file_;
  Sha256 hash_;
};

// Reads a snapshot. nullopt: the file is missing or damaged, or has another grid, AOV set or format. The
// caller then makes the image again from the partials (the stored results).
std::optional<Assembly> load_snapshot(const std::filesystem::path& path, const TileGrid& grid,
                                      bool keep_relative, std::string_view format, AovSet aovs = {});

// Reads single tiles of a snapshot, without reading the whole file. So the SHA-256 of the file is not
// checked; but the pixel sums of each tile have their own checksum.
class SnapshotTiles {
 public:
  // Finds the tiles in the file. nullopt: as for load_snapshot()
  static std::optional<SnapshotTiles> open(const std::filesystem::path& path, const TileGrid& grid,
                                           AovSet aovs, std::string_view format);
  // Loads the tile's pixels into `film`; leaves `film` unchanged if the tile has no samples.
  Result<void> load(TileIndex tile, Film& film) const;

 private:
  struct Place {
    // Where the tile's pixel sums are in the file: position and length in bytes; length 0: the tile has no
    // samples
    std::uint64_t at = 0, length = 0;
  };
  std::filesystem::path path_;
  File file_;
  std::vector<Place> places_;
};

}  // namespace ls::coordinator

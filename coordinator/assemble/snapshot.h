// What is folded of a job, as a file, tile by tile: neither writing nor reading one takes more memory than a
// tile besides the film. Each tile stands as it was when it was added, so a film may go on being folded
// meanwhile; what it has more by then is folded again from the partials after a restart.
//   "LSSNAP2\n", u64 length and name of the format, i32 width, height, tile, u32 AOVs; per tile u32 tile, u64
//   lengths of its three parts, and these: film (film_bytes.cpp), error figures, health; u32 2^32 - 1;
//   SHA-256 of all before it
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "coordinator/assemble/assembly.h"
#include "coordinator/store/files.h"

namespace ls::coordinator {

struct TileSnapshot {
  TileIndex tile = 0;
  std::function<std::vector<std::byte>()> film;  // Film::saver
  std::vector<std::byte> errors;
  std::string health;
};
TileSnapshot snapshot_of(const Film& film, const RoundErrors& errors, const HealthBook& health,
                         TileIndex tile);

class SnapshotFile {
 public:
  // `suffix`: of the name that it has until commit().
  static Result<SnapshotFile> create(const std::filesystem::path& path, std::string_view suffix,
                                     const TileGrid& grid, AovSet aovs, std::string_view format);
  Result<void> add(const TileSnapshot& tile);  // each once; one that has nothing folded is left out
  Result<void> finish();                       // sealed and durable, but not at its place
  Result<void> commit();                       // after finish()

 private:
  explicit SnapshotFile(AtomicFile file) : file_(std::move(file)) {}
  Result<void> put(std::span<const std::byte> bytes);
  AtomicFile file_;
  Sha256 hash_;
};

// Nothing if it is missing, damaged, of another grid, other AOVs or another format: then everything is folded
// again from the partials. Files of earlier programs ("LSSNAP1\n", all in one piece) are read, too.
std::optional<Assembly> load_snapshot(const std::filesystem::path& path, const TileGrid& grid,
                                      bool keep_relative, std::string_view format, AovSet aovs = {});

}  // namespace ls::coordinator

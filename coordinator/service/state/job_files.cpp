#include "coordinator/service/state/job_files.h"

#include <fmt/format.h>

#include <functional>
#include <set>

#include "core/base/log.h"

namespace ls::coordinator {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRemovedExtension = ".removed";  // suffix of a removed job's folder

// Returns a text that is stored in every snapshot and changes with the size of TileError, which snapshots
// contain as raw bytes. A build of the coordinator reads only snapshots with the same text as its own.
std::string snapshot_format() { return fmt::format("1-{}", sizeof(TileError)); }

void remove_folders_if(const fs::path& in, const std::function<bool(const fs::path&)>& unwanted) {
  std::error_code error;
  std::vector<fs::path> found;
  for (fs::directory_iterator at(in, error), end; !error && at != end; at.increment(error))
    if (unwanted(at->path())) found.push_back(at->path());
  for (const auto& path : found) fs::remove_all(path, error);
}

}  // namespace

void JobFiles::remove_folder(const JobId& id) const {
  std::error_code error;
  if (on_disk()) fs::remove_all(folder(id), error);
}

void JobFiles::discard_folder(const JobId& id) const {
  if (!on_disk()) return;
  auto gone = folder(id);
  gone += kRemovedExtension;
  std::error_code error;
  fs::rename(folder(id), gone, error);
  if (!error) fs::remove_all(gone, error);
  if (error && error != std::errc::no_such_file_or_directory)
    log_warn(fmt::format("job={}", id.value), "its folder cannot be removed: " + error.message());
}

void JobFiles::remove_discarded() const {
  if (on_disk())
    remove_folders_if(data_ / "jobs",
                      [](const fs::path& path) { return path.extension() == kRemovedExtension; });
}

void JobFiles::remove_unknown(const std::vector<StoredJob>& jobs) const {
  if (!on_disk() || !shared_) return;
  std::set<std::string> known;
  for (const StoredJob& job : jobs) known.insert(job.id.value);
  remove_folders_if(data_ / "jobs", [&](const fs::path& path) {
    std::error_code none;
    return !known.contains(path.filename().string()) && !fs::exists(path / "image.exr", none);
  });
}

Result<SnapshotFile> JobFiles::create_snapshot(const StoredJob& job, const TileGrid& grid,
                                               std::string_view suffix) const {
  const auto where = folder(job.id);
  if (auto made = make_folder(where); !made) return tl::unexpected(made.error());
  return SnapshotFile::create(where / "film.snap", suffix, grid, aovs_of(job.settings), snapshot_format());
}

Assembly JobFiles::load_image(const StoredJob& job, const TileGrid& grid) const {
  const bool keep = job.spec.target_error.has_value();
  const AovSet aovs = aovs_of(job.settings);
  auto loaded = load_snapshot(folder(job.id) / "film.snap", grid, keep, snapshot_format(), aovs);
  return loaded ? std::move(*loaded) : Assembly(grid, keep, aovs);
}

std::optional<SnapshotTiles> JobFiles::tiles_of_image(const StoredJob& job, const TileGrid& grid) const {
  return SnapshotTiles::open(folder(job.id) / "film.snap", grid, aovs_of(job.settings), snapshot_format());
}

std::string JobFiles::image_version(const StoredJob& job) const {
  return fmt::format("{} {}", job.id.value, thumbnail_name(job));
}

std::string JobFiles::thumbnail_name(const StoredJob& job) const {
  std::error_code missing;
  const auto written = fs::last_write_time(folder(job.id) / "film.snap", missing);
  return fmt::format("thumbnail-{}.png", written.time_since_epoch().count());
}

bool JobFiles::image_is_lost(const StoredJob& job) const {
  // `unknown` is set if the folder cannot be read. The image then does not count as lost: it may still exist.
  std::error_code unknown;
  return on_disk() && !job.damaged && job.state == JobState::done &&
         !fs::exists(folder(job.id) / "image.exr", unknown) && !unknown;
}

}  // namespace ls::coordinator

// Writes the files of a job, on the writer thread: now and then a snapshot, and at the end the final image
// and the report.
#include <fmt/format.h>

#include <algorithm>

#include "common/base/failpoint.h"
#include "common/base/log.h"
#include "common/image/exr/final_image.h"
#include "common/scene/json/serialize.h"
#include "coordinator/admission/admission.h"
#include "coordinator/admission/cryptomatte_manifests.h"
#include "coordinator/assemble/snapshot.h"
#include "coordinator/service/service_impl.h"

namespace ls::coordinator {
namespace {

// Returns a name for the layout of TileError: a snapshot is read only by builds that have the same layout.
std::string snapshot_format() { return fmt::format("1-{}", sizeof(TileError)); }

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

constexpr TileIndex kTilesAtOnce = 64;  // tiles of a snapshot that are copied under one lock

class ImageFile final : public ByteSink {
 public:
  explicit ImageFile(AtomicFile& file) : file_(file) {}
  Result<void> write(std::uint64_t at, std::span<const std::byte> bytes) override {
    return file_.write_at(at, bytes);
  }

 private:
  AtomicFile& file_;
};

}  // namespace

// Call without the lock: cryptomattes need the scene's names.
Provenance Service::provenance_of(const ReportFacts& facts) const {
  const StoredJob& job = facts.job;
  const Health& health = job.totals.health;
  const std::string note = job.stopped ? note_on(*job.stopped) : "";
  std::string stopped = job.stopped ? std::string(to_string(*job.stopped)) : "";
  if (!note.empty()) stopped += "; " + note;
  return {job.scene,
          canonical_json(job.settings),
          job.build,
          job.numeric_class.value_or(Digest{}),
          job.settings.seed,
          job.totals.render_seconds,
          health.clean() ? "clean" : canonical_json(health),
          cryptomatte_manifests_of(job),
          job.totals.core_seconds,
          std::move(stopped),
          convergence_status_of(facts),
          header_figures(facts),
          header_notes(facts)};
}

CryptomatteManifests Service::cryptomatte_manifests_of(const StoredJob& job) const {
  if (!wants_labels(job.settings)) return {};
  const auto size = blobs_->size(job.scene);
  const auto json = size ? blobs_->read(job.scene, 0, *size)
                         : Result<std::vector<std::byte>>(fail(Errc::not_found, "its scene is not stored"));
  const auto scene = json ? deserialize_scene({reinterpret_cast<const char*>(json->data()), json->size()})
                          : Result<Scene>(tl::unexpected(json.error()));
  if (scene) return manifests_of(*scene, aovs_of(job.settings));
  log_warn(fmt::format("job={}", job.id.value), "mattes without names: " + scene.error().message);
  return {};
}

// Returns all facts for the report except the digest of the pixels, which takes time.
ReportFacts Service::facts_locked(const JobEntry& entry) const {
  ReportFacts facts;
  facts.job = entry.stored;
  facts.job.state = shown_state(entry);
  if (facts.job.state == JobState::cancelled) facts.job.stopped = StopReason::user;
  facts.convergence = entry.points;
  facts.replay = replay_of(entry.stored);
  facts.reference_noise = entry.reference_noise;
  if (!entry.assembly) return facts;
  const Film& film = entry.assembly->film();
  facts.job.totals.health = entry.assembly->health().total();
  if (entry.clock_zero) facts.job.totals.render_seconds = elapsed_locked(entry);
  put_film(facts, film);
  return facts;
}

void Service::snapshot_if_due_locked(const EntryPtr& entry) {
  if (!on_disk() || entry->snapshot_running || !entry->assembly) return;
  const std::uint64_t folds = entry->assembly->folds_since_snapshot;
  if (folds < limits::kSnapshotUnits && seconds(now() - entry->last_snapshot) < limits::kSnapshotSeconds)
    return;
  entry->snapshot_running = true;
  entry->assembly->folds_since_snapshot = 0;
  entry->last_snapshot = now();
  background_writes_.push([this, entry] { take_snapshot(entry); });
}

// Takes a snapshot while folding continues. What is folded into a tile after it was copied is folded again
// after a restart. The convergence points that the snapshot includes must be stored before it; they are in
// the writer's queue already, so the snapshot is queued behind them.
void Service::take_snapshot(const EntryPtr& entry) {
  const auto done = [this, entry](const Result<void>& written) {
    if (!written) log_warn(fmt::format("job={}", entry->stored.id.value), written.error().message);
    const std::lock_guard lock(mutex_);
    entry->snapshot_running = false;
  };
  auto file = copy_folded(entry);
  if (!file) return done(tl::unexpected(file.error()));
  background_writes_.push([this, entry, done, before = entry->snapshots,
                           file = std::make_shared<SnapshotFile>(std::move(*file))] {
    std::unique_lock lock(mutex_);
    // The snapshot is dropped if the job was removed or a later snapshot has been written meanwhile
    const bool wanted = entry->assembly && !entry->removed && entry->snapshots == before;
    lock.unlock();
    if (!wanted) return done({});
    ++entry->snapshots;
    const auto written = file->commit();
    failpoint("snapshot-written");
    done(written);
  });
}

Result<SnapshotFile> Service::copy_folded(const EntryPtr& entry) {
  const auto where = folder(entry->stored.id);
  // The snapshot may not have been written
  if (auto made = make_folder(where); !made) return tl::unexpected(made.error());
  auto file = SnapshotFile::create(where / "film.snap", ".new", entry->grid, aovs_of(entry->stored.settings),
                                   snapshot_format());
  if (!file) return file;
  for (TileIndex first = 0; first < entry->grid.count(); first += kTilesAtOnce) {
    std::vector<TileSnapshot> tiles;
    {
      const std::lock_guard lock(mutex_);
      if (!entry->assembly || entry->removed)
        return fail(Errc::failed_precondition, "it has ended: no snapshot is needed");
      for (TileIndex t = first; t < std::min(first + kTilesAtOnce, entry->grid.count()); ++t)
        tiles.push_back(
            snapshot_of(entry->assembly->film(), entry->assembly->errors(), entry->assembly->health(), t));
    }
    for (const TileSnapshot& tile : tiles)
      if (auto written = file->add(tile); !written) return tl::unexpected(written.error());
  }
  if (auto sealed = file->finish(); !sealed) return tl::unexpected(sealed.error());
  return file;
}

Service::Folded Service::folded_of(const JobEntry& entry) {
  return {entry.assembly->film(), entry.assembly->errors(), entry.assembly->health()};
}

// Writes a snapshot of a film that is no longer changing.
Result<void> Service::write_snapshot(const EntryPtr& entry, const Folded& folded) {
  const auto where = folder(entry->stored.id);
  if (auto made = make_folder(where); !made) return made;
  auto file =
      SnapshotFile::create(where / "film.snap", ".tmp", entry->grid, folded.film.aovs(), snapshot_format());
  if (!file) return tl::unexpected(file.error());
  for (TileIndex t = 0; t < entry->grid.count(); ++t)
    if (auto added = file->add(snapshot_of(folded.film, folded.errors, folded.health, t)); !added)
      return added;
  if (auto sealed = file->finish(); !sealed) return sealed;
  ++entry->snapshots;
  const auto written = file->commit();
  failpoint("snapshot-written");
  return written;
}

Result<void> Service::write_snapshot_now(const EntryPtr& entry) {
  std::unique_lock lock(mutex_);
  if (!entry->assembly || entry->removed) return {};
  const Folded folded = folded_of(*entry);
  lock.unlock();
  return write_snapshot(entry, folded);
}

// Returns the denoised image of a job that asks for one, and puts its figures into the facts. `made` is that
// image if it has been made already. Null if the job asks for none or has no samples. Call without the lock:
// it takes seconds.
std::shared_ptr<const Denoising::Denoised> Service::denoised(
    const Film& film, ReportFacts& facts, std::shared_ptr<const Denoising::Denoised> made) const {
  if (!facts.job.spec.denoise || facts.samples == 0) return nullptr;
  if (!made) made = denoising_.of(film);
  facts.denoised = made->figures;
  if (made->image.rgb.empty() || !facts.job.spec.reference || facts.job.reference_same_seed ||
      facts.pixels_without_samples > 0)
    return made;
  if (const auto reference = load_reference(facts.job.spec, facts.job.settings.size, *blobs_))
    facts.denoised->true_error = true_error(*reference, made->image.rgb);
  return made;
}

// Denoises the final image of a job ahead of finish(), on another thread than that of the writes.
void Service::denoise_final(const EntryPtr& entry, std::uint64_t number) {
  std::unique_lock lock(mutex_);
  if (entry->finishing != number || !entry->assembly) return;
  const Film film = entry->assembly->film();
  if (film.samples() == 0) return;
  lock.unlock();
  auto made = denoising_.of(film);
  lock.lock();
  if (entry->finishing == number) entry->denoised = std::move(made);
}

// Writes the final image. Returns how many values it cannot represent.
Result<std::uint64_t> Service::write_image(const Film& film, const ReportFacts& facts,
                                           std::span<const float> denoised) {
  auto file = AtomicFile::create(folder(facts.job.id) / "image.exr");
  if (!file) return tl::unexpected(file.error());
  ImageFile sink(*file);
  const auto clamped =
      write_final_exr(film, provenance_of(facts), facts.job.spec.float_output, sink, denoised);
  if (!clamped) return clamped;
  if (auto done = file->commit(); !done) return tl::unexpected(done.error());
  failpoint("image-written");
  return clamped;
}

void Service::load_folded(JobEntry& entry) const {
  const bool keep = entry.stored.spec.target_error.has_value();
  const AovSet aovs = aovs_of(entry.stored.settings);
  entry.assembly =
      load_snapshot(folder(entry.stored.id) / "film.snap", entry.grid, keep, snapshot_format(), aovs);
  if (!entry.assembly) entry.assembly.emplace(entry.grid, keep, aovs);
}

void Service::finish(const EntryPtr& entry, std::uint64_t number) {
  std::unique_lock lock(mutex_);
  if (entry->finishing != number || !entry->assembly) return;
  const Folded folded = folded_of(*entry);
  const Film& film = folded.film;
  ReportFacts facts = facts_locked(*entry);
  facts.job.state = JobState::done;
  const JobFigures figures = farm_.job(entry->stored.id).value_or(JobFigures{});
  facts.job.totals.units = figures.units_done;
  facts.job.totals.units_planned = figures.units_total;
  auto denoised_image = std::exchange(entry->denoised, nullptr);
  lock.unlock();

  if (on_disk()) {
    const auto written = [&]() -> Result<void> {
      const auto where = folder(facts.job.id);
      denoised_image = denoised(film, facts, std::move(denoised_image));
      if (facts.denoised && facts.denoised->by.empty())
        log_warn(fmt::format("job={}", facts.job.id.value), "no denoised layers: " + facts.denoised->trouble);
      const auto clamped = write_image(
          film, facts, denoised_image ? std::span(denoised_image->image.rgb) : std::span<const float>());
      if (!clamped) return tl::unexpected(clamped.error());
      facts.clamped_values = *clamped;
      facts.pixels = pixels_sha256(film);
      if (auto done = write_atomically(where / "report.json", bytes_of(coordinator::report_json(facts)));
          !done)
        return done;
      // The snapshot comes last and must succeed: an extension continues from it.
      return write_snapshot(entry, folded);
    }();
    if (!written) {
      lock.lock();
      if (entry->finishing != number) return;  // extended or removed meanwhile
      entry->trouble =
          "the final image cannot be written: " + written.error().message + "; then resume the job";
      log_error(fmt::format("job={}", facts.job.id.value), entry->trouble);
      publish_job_locked(*entry);
      return;
    }
  }
  lock.lock();
  if (entry->finishing != number) return;
  entry->finishing = 0;
  entry->trouble.clear();
  entry->stored.state = JobState::done;
  entry->stored.totals.spp_done = facts.job.totals.spp_done;
  entry->stored.totals.units = facts.job.totals.units;
  entry->stored.totals.units_planned = facts.job.totals.units_planned;
  persist_locked(*entry);
  failpoint("job-done");
  forget_locked(*entry);
  log_info(fmt::format("job={} state=done stopped={}", facts.job.id.value, to_string(*facts.job.stopped)),
           facts.job.name);
  publish_job_locked(*entry);
  ended_.notify_all();
}

// Writes the current image of a failed or cancelled job to disk and frees its memory.
void Service::retire(const EntryPtr& entry) {
  if (!on_disk()) return;
  const auto written = write_snapshot_now(entry);
  const std::lock_guard lock(mutex_);
  if (!entry->assembly || entry->removed) return;
  if (!written) {  // its image stays in memory
    log_warn(fmt::format("job={}", entry->stored.id.value), written.error().message);
    return;
  }
  entry->stored.totals.spp_done = facts_locked(*entry).job.totals.spp_done;
  const JobFigures figures = farm_.job(entry->stored.id).value_or(JobFigures{});
  entry->stored.totals.units = figures.units_done;
  entry->stored.totals.units_planned = figures.units_total;
  persist_locked(*entry);
  forget_locked(*entry);
}

// Unloads an ended job: what the farm knows of it and its film (the image in memory) are freed; only its
// files and its record remain. Results that still arrive for it are dropped.
void Service::forget_locked(JobEntry& entry) {
  const auto figures = farm_.job(entry.stored.id);
  if (!on_disk() || !figures || entry.unloaded) return;
  if (!is_terminal(figures->state)) return;
  entry.unloaded = true;
  entry.assembly.reset();
  entry.reference_tiles.reset();
  entry.log.reset();
  run_locked(JobForgotten{entry.stored.id});
}

}  // namespace ls::coordinator

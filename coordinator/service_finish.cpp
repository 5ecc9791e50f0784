// What is written of a job on the keeper thread: snapshots now and then, the final image and report at the
// end.
#include <fmt/format.h>

#include <algorithm>

#include "common/base/log.h"
#include "common/image/final_image.h"
#include "common/scene/serialize.h"
#include "coordinator/intake.h"
#include "coordinator/mattes.h"
#include "coordinator/service_impl.h"

namespace ls::coordinator {
namespace {

// Written and read by builds in which the figures have one layout.
std::string snapshot_format() { return fmt::format("1-{}", sizeof(TileError)); }

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

}  // namespace

// Not under the lock: mattes need the scene's names.
Provenance Service::provenance_of(const StoredJob& job) const {
  const Health& health = job.totals.health;
  return {job.scene,
          canonical_json(job.settings),
          job.build,
          job.numeric_class.value_or(Digest{}),
          job.settings.seed,
          job.totals.render_seconds,
          health.clean() ? "clean" : canonical_json(health),
          mattes_of(job)};
}

MatteManifests Service::mattes_of(const StoredJob& job) const {
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

// All but the digest of the pixels, which takes its time.
ReportFacts Service::facts_locked(const JobEntry& entry) const {
  ReportFacts facts;
  facts.job = entry.stored;
  facts.job.state = shown_state(entry);
  facts.convergence = entry.points;
  facts.replay = replay_of(entry.stored);
  facts.reference_noise = entry.reference_noise;
  if (!entry.assembly) return facts;
  const Film& film = entry.assembly->film();
  facts.job.totals.health = entry.assembly->health().total();
  facts.samples = film.samples();
  facts.job.totals.spp_done =
      static_cast<double>(facts.samples) /
      static_cast<double>(std::int64_t{entry.grid.frame.width} * entry.grid.frame.height);
  if (entry.clock_zero) facts.job.totals.render_seconds = elapsed_locked(entry);
  if (facts.samples > 0) facts.error = image_error(film.error());
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
  chores_.push([this, entry, folded = folded_of(*entry)] {
    if (const auto written = write_snapshot(entry, folded); !written)
      log_warn(fmt::format("job={}", entry->stored.id.value), written.error().message);
    const std::lock_guard lock(mutex_);
    entry->snapshot_running = false;
  });
}

Service::Folded Service::folded_of(const JobEntry& entry) {
  return {entry.assembly->film(), entry.assembly->errors(), entry.assembly->health()};
}

Result<void> Service::write_snapshot(const EntryPtr& entry, const Folded& folded) {
  if (auto made = make_folder(folder(entry->stored.id)); !made) return made;  // nothing may have come of it
  return write_atomically(folder(entry->stored.id) / "film.snap",
                          save_snapshot(folded.film, folded.errors, folded.health, snapshot_format()));
}

Result<void> Service::write_snapshot_now(const EntryPtr& entry) {
  std::unique_lock lock(mutex_);
  if (!entry->assembly || entry->removed) return {};
  const Folded folded = folded_of(*entry);
  lock.unlock();
  return write_snapshot(entry, folded);
}

void Service::load_folded(JobEntry& entry) const {
  const bool keep = entry.stored.spec.target_error.has_value();
  const auto bytes = read_file(folder(entry.stored.id) / "film.snap", std::uint64_t{1} << 40);
  const AovSet aovs = aovs_of(entry.stored.settings);
  if (bytes) entry.assembly = load_snapshot(*bytes, entry.grid, keep, snapshot_format(), aovs);
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
  lock.unlock();

  if (on_disk()) {
    const auto written = [&]() -> Result<void> {
      const auto where = folder(facts.job.id);
      const auto image = final_exr(film, provenance_of(facts.job), facts.job.spec.float_output);
      if (!image) return tl::unexpected(image.error());
      facts.clamped_values = image->clamped;
      facts.pixels = pixels_sha256(film);
      if (auto done = write_atomically(where / "image.exr", image->exr); !done) return done;
      if (auto done = write_atomically(where / "report.json", bytes_of(coordinator::report_json(facts)));
          !done)
        return done;
      // Last and not to be missed: an extension goes on from it.
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
  forget_locked(*entry);
  log_info(fmt::format("job={} state=done stopped={}", facts.job.id.value, to_string(*facts.job.stopped)),
           facts.job.name);
  publish_job_locked(*entry);
  ended_.notify_all();
}

// A job that failed or was cancelled: what there is of it goes to the disk and out of memory.
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

// From here on the job is its files and its record; the farm's books and the film go. Results that still come
// for it are dropped.
void Service::forget_locked(JobEntry& entry) {
  const auto figures = farm_.job(entry.stored.id);
  if (!on_disk() || !figures || entry.dormant) return;
  if (figures->state != JobState::done && figures->state != JobState::failed &&
      figures->state != JobState::cancelled)
    return;
  entry.dormant = true;
  entry.assembly.reset();
  entry.truths.reset();
  entry.log.reset();
  run_locked(JobForgotten{entry.stored.id});
}

}  // namespace ls::coordinator

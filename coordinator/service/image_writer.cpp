// ImageWriter: writes the files of jobs. A snapshot is a file with a job's image so far, from which a restart
// or an extension of the job continues.
#include "coordinator/service/image_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <type_traits>

#include "coordinator/admission/layer_names.h"
#include "coordinator/base/limits.h"
#include "coordinator/service/core.h"
#include "coordinator/store/log/audit_file.h"
#include "core/base/failpoint.h"
#include "core/base/log.h"
#include "core/image/exr/final_image.h"
#include "core/scene/json/serialize.h"

namespace ls::coordinator {
namespace {

// Tiles of a snapshot are copied under the lock in groups of this many; between two groups the lock is
// released for other threads.
constexpr TileIndex kTilesAtOnce = 64;

// Returns the Result of write(), or an error if memory runs out meanwhile.
template <class Write>
std::invoke_result_t<Write> within_memory(const Write& write) {
  try {
    return write();
  } catch (const std::bad_alloc&) {
    return fail(Errc::resource_exhausted, "the coordinator has not enough memory for it now");
  }
}

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

class ImageFile final : public ByteSink {
 public:
  explicit ImageFile(AtomicFile& file) : file_(file) {}
  Result<void> write(std::uint64_t at, std::span<const std::byte> bytes) override {
    return file_.write_at(at, bytes);
  }

 private:
  AtomicFile& file_;
};

// Writes the final image. Returns how many values had to be clamped, because they are larger than the file's
// number format can hold.
Result<std::uint64_t> write_image(const std::filesystem::path& path, const Film& film,
                                  const ReportFacts& facts, const BlobStore& blobs,
                                  const Denoised* denoised) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  ImageFile sink(*file);
  const auto clamped = write_final_exr(film, provenance_of(facts, blobs), form_of(facts.job.spec), sink,
                                       denoised ? std::span(denoised->image.rgb) : std::span<const float>());
  if (!clamped) return clamped;
  if (auto done = file->commit(); !done) return tl::unexpected(done.error());
  failpoint("image-written");
  return clamped;
}

Result<void> write_deep(const std::filesystem::path& path, const Film& film, const ReportFacts& facts,
                        const BlobStore& blobs) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  ImageFile sink(*file);
  if (auto written = write_deep_image(film, provenance_of(facts, blobs), form_of(facts.job.spec), sink);
      !written)
    return written;
  return file->commit();
}

void count_units(JobTotals& totals, const Farm& farm, const JobId& id) {
  const JobFigures figures = farm.job(id).value_or(JobFigures{});
  totals.units = figures.units_done;
  totals.units_planned = figures.units_total;
}

}  // namespace

void ImageWriter::keep_audits(Core&, const EntryPtr& entry, const std::vector<JobRestored::Audit>& audits) {
  if (!files_.on_disk() || entry->removed) return;
  std::string text = audits_text(audits);
  if (text == entry->audits) return;
  entry->audits = text;
  writes_.push([this, entry, text = std::move(text)] {
    {
      const auto core = core_.lock();
      if (entry->removed) return;
    }
    if (const auto written = write_audits(files_.folder(entry->stored.id), text); !written)
      log_warn(fmt::format("job={}", entry->stored.id.value), "audits: " + written.error().message);
  });
}

void ImageWriter::snapshot_if_due(Core&, const EntryPtr& entry) {
  if (!files_.on_disk() || entry->snapshots.running || !entry->assembly) return;
  const std::uint64_t folds = entry->assembly->folds_since_snapshot;
  if (folds < limits::kSnapshotUnits &&
      seconds(clock_.now() - entry->snapshots.last) < limits::kSnapshotSeconds)
    return;
  entry->snapshots.running = true;
  entry->assembly->folds_since_snapshot = 0;
  entry->snapshots.last = clock_.now();
  writes_.push([this, entry] { take_snapshot(entry); });
}

// Takes a snapshot while other threads still add results to the image. Results that are added to a tile after
// the tile was copied are not in the snapshot; a restart adds them again, from the job's log. The points of
// the convergence curve up to the snapshot must be stored before it. They are queued for writing already, so
// the function writes the file under another name and queues its renaming behind them.
void ImageWriter::take_snapshot(const EntryPtr& entry) {
  const auto done = [this, entry](const Result<void>& written) {
    if (!written) log_warn(fmt::format("job={}", entry->stored.id.value), written.error().message);
    const auto core = core_.lock();
    entry->snapshots.running = false;
  };
  auto file = within_memory([&] { return copy_folded(entry); });
  if (!file) return done(tl::unexpected(file.error()));
  writes_.push([this, entry, done, before = entry->snapshots.committed,
                file = std::make_shared<SnapshotFile>(std::move(*file))] {
    auto core = core_.lock();
    // The snapshot is dropped if the job was removed or a later snapshot has been written meanwhile
    const bool wanted = entry->assembly && !entry->removed && entry->snapshots.committed == before;
    core.unlock();
    if (!wanted) return done({});
    ++entry->snapshots.committed;
    const auto written = file->commit();
    failpoint("snapshot-written");
    done(written);
  });
}

Result<SnapshotFile> ImageWriter::copy_folded(const EntryPtr& entry) {
  auto file = files_.create_snapshot(entry->stored, entry->grid, ".new");
  if (!file) return file;
  for (TileIndex first = 0; first < entry->grid.count(); first += kTilesAtOnce) {
    std::vector<TileSnapshot> tiles;
    {
      const auto core = core_.lock();
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

// Writes a snapshot of a film (an image in memory) that no longer changes.
Result<void> ImageWriter::write_snapshot(const EntryPtr& entry, const Folded& folded) {
  auto file = files_.create_snapshot(entry->stored, entry->grid, ".tmp");
  if (!file) return tl::unexpected(file.error());
  for (TileIndex t = 0; t < entry->grid.count(); ++t)
    if (auto added = file->add(snapshot_of(folded.film, folded.errors, folded.health, t)); !added)
      return added;
  if (auto sealed = file->finish(); !sealed) return sealed;
  ++entry->snapshots.committed;
  const auto written = file->commit();
  failpoint("snapshot-written");
  return written;
}

void ImageWriter::check_denoised(Core&, const EntryPtr& entry, double spp) {
  comparer_.run_afterwards([this, entry, spp, curve = entry->curve, film = entry->assembly->film()] {
    note_check(entry, curve, spp, *denoising_.of(film));
  });
}

void ImageWriter::note_check(const EntryPtr& entry, std::uint64_t curve, double spp, const Denoised& made) {
  const auto core = core_.lock();
  StoredJob& job = entry->stored;
  if (entry->removed || entry->unloaded || entry->curve != curve) return;
  if (made.image.rgb.empty()) {
    // The check is not needed any more if the job has ended, or if its target error no longer applies to the
    // denoised layers.
    if (job.state != JobState::running || job.spec.target_layer != TargetLayer::denoised) return;
    entry->trouble = fmt::format(
        "its target is the error of the denoised layers, which cannot be made: {}; then resume the job",
        made.figures.trouble);
    log_error(fmt::format("job={}", job.id.value), entry->trouble);
    core->records.log(job.id, entry->trouble);
    core->driver.run(JobPaused{job.id});
    return;
  }
  const DenoisedCheck check{spp, made.figures.error.relmse, made.figures.error.relmse_at_most()};
  const bool known = std::any_of(job.denoised_checks.begin(), job.denoised_checks.end(),
                                 [&](const DenoisedCheck& c) { return c.spp == spp; });
  if (!known) job.denoised_checks.push_back(check);
  core->records.put(entry);
  core->driver.run(DenoisedChecked{job.id, check});
  core->publisher.job(*entry);
}

void ImageWriter::finish(Core&, const EntryPtr& entry) {
  const std::uint64_t number = entry->finishing = ++last_final_;
  entry->denoised = nullptr;
  const auto write = [this, entry, number] { write_final(entry, number); };
  const bool denoised = entry->stored.spec.denoise && files_.on_disk();
  if (!entry->reference_tiles && !denoised) return writes_.push(write);
  if (denoised) comparer_.run_afterwards([this, entry, number] { denoise(entry, number); });
  comparer_.run_afterwards([this, write] { writes_.push(write); });
}

void ImageWriter::finish_again(Core&, const EntryPtr& entry) {
  entry->finishing = ++last_final_;
  writes_.push([this, entry, number = last_final_] { write_final(entry, number); });
}

// Denoises the final image of a job before it is written. Runs on the ReferenceComparer's thread, so that the
// writer thread need not wait for it.
void ImageWriter::denoise(const EntryPtr& entry, std::uint64_t number) {
  auto core = core_.lock();
  if (entry->finishing != number || !entry->assembly) return;
  const Film film = entry->assembly->film();
  if (film.samples() == 0) return;
  core.unlock();
  const TimePoint begin = clock_.now();
  auto made = denoising_.of(film);
  core.lock();
  if (entry->trace) entry->trace->step("denoise", begin, clock_.now(), {}, made->image.rgb.empty());
  if (entry->finishing == number) entry->denoised = std::move(made);
}

void ImageWriter::write_final(const EntryPtr& entry, std::uint64_t number) {
  auto core = core_.lock();
  if (entry->finishing != number || !entry->assembly) return;
  const Folded folded{entry->assembly->film(), entry->assembly->errors(), entry->assembly->health()};
  ReportFacts facts = facts_of(*entry, clock_.now());
  facts.job.state = JobState::done;
  count_units(facts.job.totals, core->driver.farm(), entry->stored.id);
  auto denoised = std::exchange(entry->denoised, nullptr);
  core.unlock();

  const TimePoint begin = clock_.now();
  const auto written = within_memory(
      [&] { return files_.on_disk() ? write_files(entry, folded, facts, denoised) : Result<void>(); });

  core.lock();
  if (entry->trace) entry->trace->step("write image", begin, clock_.now(), {}, !written);
  if (entry->finishing != number) return;  // the job was extended or removed meanwhile
  if (!written) {
    entry->denoised = std::move(denoised);  // denoising takes longer than writing
    entry->trouble = fmt::format(
        "the final image cannot be written: {}; this is tried again every {:.0f} s, and at once when the job "
        "is resumed",
        written.error().message, seconds(limits::kWriteAgain));
    unwritten_.push_back({entry, number, clock_.now() + limits::kWriteAgain});
    log_error(fmt::format("job={}", facts.job.id.value), entry->trouble);
    core->publisher.job(*entry);
    return;
  }
  entry->finishing = 0;
  entry->trouble.clear();
  entry->stored.state = JobState::done;
  core->jobs.count_state(*entry);
  entry->stored.totals.ended_unix = entry->ended_unix;
  entry->stored.totals.spp_done = facts.job.totals.spp_done;
  entry->stored.totals.units = facts.job.totals.units;
  entry->stored.totals.units_planned = facts.job.totals.units_planned;
  entry->stored.denoised.reset();
  if (facts.denoised && !facts.denoised->by.empty()) {
    const DenoisedError& e = facts.denoised->error;
    entry->stored.denoised = {
        std::max(0.0, e.relmse),
        e.relmse_interval ? std::optional(std::pair(e.relmse_lo, e.relmse_hi)) : std::nullopt};
  }
  core->records.put(entry);
  failpoint("job-done");
  if (entry->trace) {
    entry->trace->event("done", clock_.now());
    entry->trace->end(entry->stored, clock_.now());
  }
  core->driver.unload(*entry);
  log_info(fmt::format("job={} state=done stopped={}", facts.job.id.value, to_string(*facts.job.stopped)),
           facts.job.name);
  core->publisher.job(*entry);
  core->driver.notify_jobs_after(facts.job.id);
  core->ended.notify_all();
}

Result<void> ImageWriter::write_files(const EntryPtr& entry, const Folded& folded, ReportFacts& facts,
                                      std::shared_ptr<const Denoised>& denoised) {
  const auto where = files_.folder(facts.job.id);
  denoised = denoising_.of_job(folded.film, facts, std::move(denoised));
  if (facts.denoised && facts.denoised->by.empty())
    log_warn(fmt::format("job={}", facts.job.id.value), "no denoised layers: " + facts.denoised->trouble);
  // The deep image comes first: once image.exr is there, the job has all its images.
  if (facts.job.settings.deep > 0)
    if (auto deep = write_deep(where / "deep.exr", folded.film, facts, blobs_); !deep) return deep;
  const auto clamped = write_image(where / "image.exr", folded.film, facts, blobs_, denoised.get());
  if (!clamped) return tl::unexpected(clamped.error());
  facts.clamped_values = *clamped;
  facts.pixels = pixels_sha256(folded.film);
  facts.meters = meter_values(folded.film, facts.job.meters);
  if (auto done = write_atomically(where / "report.json", bytes_of(report_json(facts))); !done) return done;
  // The files count as written only if the snapshot is written too, since an extension of the job continues
  // from the snapshot.
  return write_snapshot(entry, folded);
}

void ImageWriter::retire(Core&, const EntryPtr& entry) {
  if (files_.on_disk()) writes_.push([this, entry] { write_retired(entry); });
}

void ImageWriter::write_retired(const EntryPtr& entry) {
  auto core = core_.lock();
  if (!entry->assembly || entry->removed) return;
  const Folded folded{entry->assembly->film(), entry->assembly->errors(), entry->assembly->health()};
  core.unlock();
  const auto written = within_memory([&] { return write_snapshot(entry, folded); });
  core.lock();
  if (!entry->assembly || entry->removed) return;
  if (!written) {  // the image stays in memory until it is written
    log_warn(fmt::format("job={}", entry->stored.id.value), written.error().message);
    unwritten_.push_back({entry, 0, clock_.now() + limits::kWriteAgain});
    return;
  }
  entry->stored.totals.spp_done = facts_of(*entry, clock_.now()).job.totals.spp_done;
  count_units(entry->stored.totals, core->driver.farm(), entry->stored.id);
  core->records.put(entry);
  core->driver.unload(*entry);
}

void ImageWriter::write_again_if_due(Core& core) {
  std::vector<Unwritten> due;
  std::erase_if(unwritten_, [&](Unwritten& one) {
    if (clock_.now() < one.again) return false;
    due.push_back(std::move(one));
    return true;
  });
  for (const Unwritten& one : due) {
    // A job that was extended, removed or resumed meanwhile has another number.
    if (one.final_number == 0)
      retire(core, one.entry);
    else if (one.entry->finishing == one.final_number)
      finish_again(core, one.entry);
  }
}

LayerNames layer_names_of(const StoredJob& job, const BlobStore& blobs) {
  const LayerNames groups{.light_groups = job.settings.light_groups};
  if (!wants_labels(job.settings)) return groups;
  const auto size = blobs.size(job.scene);
  const auto json = size ? blobs.read(job.scene, 0, *size)
                         : Result<std::vector<std::byte>>(fail(Errc::not_found, "its scene is not stored"));
  const auto scene = json ? deserialize_scene({reinterpret_cast<const char*>(json->data()), json->size()})
                          : Result<Scene>(tl::unexpected(json.error()));
  if (scene) return layer_names_of(*scene, job.settings);
  log_warn(fmt::format("job={}", job.id.value), "mattes without names: " + scene.error().message);
  return groups;
}

Provenance provenance_of(const ReportFacts& facts, const BlobStore& blobs) {
  const StoredJob& job = facts.job;
  const Health& health = job.totals.health;
  const std::string note = job.stopped ? note_on(*job.stopped, job.spec.target_layer) : "";
  std::string stopped = job.stopped ? std::string(to_string(*job.stopped)) : "";
  if (!note.empty()) stopped += "; " + note;
  return {job.scene,
          canonical_json(job.settings),
          job.build,
          job.numeric_class.value_or(Digest{}),
          job.settings.seed,
          job.totals.render_seconds,
          health.clean() ? "clean" : canonical_json(health),
          layer_names_of(job, blobs),
          job.totals.core_seconds,
          std::move(stopped),
          convergence_status_of(facts),
          header_figures(facts),
          header_notes(facts),
          job.camera,
          job.spec.fps,
          job.owner};
}

}  // namespace ls::coordinator

// Carries out the farm's effects (domain/effect.h), in order.
#include <fmt/format.h>

#include <algorithm>

#include "common/base/failpoint.h"
#include "common/base/log.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/store/log/audit_file.h"
#include "coordinator/views/views.h"

namespace ls::coordinator {

void Service::run_locked(Event first) {
  Todo todo;
  todo.push_back(std::move(first));
  while (!todo.empty()) {
    const Event event = std::move(todo.front());
    todo.pop_front();
    for (const Effect& effect : farm_.handle(event, now())) carry_out(effect, todo);
  }
  // Snapshots are taken only when all events are handled. A snapshot includes convergence points, and these
  // must precede it in the writer's queue.
  for (const EntryPtr& entry : std::exchange(folded_, {})) snapshot_if_due_locked(entry);
  for (const JobId& id : farm_.take_changed_audits()) keep_audits_locked(id);
}

void Service::keep_audits_locked(const JobId& id) {
  const auto entry = find_locked(id);
  if (!on_disk() || !entry || entry->removed) return;
  std::string text = audits_text(farm_.open_audits(id));
  if (text == entry->audits) return;
  entry->audits = text;
  background_writes_.push([this, entry, text = std::move(text)] {
    {
      const std::lock_guard lock(mutex_);
      if (entry->removed) return;
    }
    if (const auto written = write_audits(folder(entry->stored.id), text); !written)
      log_warn(fmt::format("job={}", entry->stored.id.value), "audits: " + written.error().message);
  });
}

void Service::carry_out(const Effect& effect, Todo& todo) {
  std::visit([&](const auto& e) { on(e, todo); }, effect);
}

void Service::on(const UnitsFreed& e, Todo&) {
  const auto entry = find_locked(e.job);
  if (!entry) return;
  figures_.units_freed[e.cause] += e.units.size();
  for (const UnitKey& unit : e.units) {
    const auto held = entry->leased.find({unit.tile, unit.round});
    if (held != entry->leased.end() && std::erase(held->second, e.worker) > 0 && held->second.empty())
      entry->leased.erase(held);
    hub_->publish("tile",
                  tile_event_json(e.job, unit.tile, entry->grid.rect(unit.tile), "free",
                                  round_range(unit.round).s0, e.worker.value),
                  e.job.value, entry->stored.owner);
  }
}

// The result is in the job's log already, so nothing is written here: this only starts the job's clock.
void Service::on(const RecordUnit& e, Todo&) {
  const auto entry = find_locked(e.unit.job);
  if (!entry) return;
  entry->leased.erase({e.unit.tile, e.unit.round});
  if (entry->clock_zero) return;
  const auto figures = farm_.job(e.unit.job);
  entry->clock_zero = figures && figures->first_ray ? *figures->first_ray : now();
  if (entry->stored.totals.began_unix == 0)
    entry->stored.totals.began_unix = unix_now() - elapsed_locked(*entry);
}

// Returns the accepted partial (the encoded pixel sums of one unit) that is to be folded. It is read from the
// log if it is no longer in memory: it arrived before a restart, or too many partials are waiting.
Result<WaitingPartial> Service::partial_for_locked(JobEntry& entry, const Fold& e) {
  auto waiting = entry.assembly->take(e.unit.tile, e.unit.round, e.samples);
  if (!waiting) return fail(Errc::internal, "an accepted partial is not at hand");
  if (waiting->partial) return std::move(*waiting);
  if (!waiting->place || !entry.log) return fail(Errc::internal, "an accepted partial has no place");
  const auto exr = entry.log->read(*waiting->place);
  if (!exr) return tl::unexpected(exr.error());
  const UnitHeader expected{entry.stored.scene, entry.settings_digest,
                            entry.stored.numeric_class.value_or(Digest{}), entry.grid.rect(e.unit.tile),
                            e.samples};
  auto partial = decode_partial(*exr, expected, entry.grid.frame, aovs_of(entry.stored.settings));
  if (!partial) return tl::unexpected(partial.error());
  waiting->partial = std::move(*partial);
  return std::move(*waiting);
}

void Service::on(const Fold& e, Todo& todo) {
  const auto entry = find_locked(e.unit.job);
  if (!entry || !entry->assembly) return;
  const TimePoint begin = now();
  const auto waiting = partial_for_locked(*entry, e);
  const auto error =
      waiting ? entry->assembly->fold(e.unit.tile, e.unit.round, *waiting) : tl::unexpected(waiting.error());
  if (!error) {
    // A wrong pixel must never be folded: the tile stops and the job waits.
    entry->trouble =
        fmt::format("tile {} round {} cannot be folded: {}; restart the coordinator to render it again",
                    e.unit.tile, e.unit.round, error.error().message);
    log_error(fmt::format("job={} tile={} round={}", e.unit.job.value, e.unit.tile, e.unit.round),
              entry->trouble);
    log_job(e.unit.job, entry->trouble);
    todo.push_back(JobPaused{e.unit.job});
    return;
  }
  if (entry->reference_tiles)
    entry->reference_tiles->folded(e.unit.tile, e.unit.round, entry->assembly->film());
  if (const auto at = entry->replay_at.find({e.unit.tile, e.unit.round}); at != entry->replay_at.end())
    entry->fold_seconds = std::max(entry->fold_seconds, at->second);
  else
    entry->fold_seconds = elapsed_locked(*entry);
  todo.push_back(UnitFolded{e.unit, e.samples, error->relative.squares});
  entry->stored.totals.time.merge += seconds(now() - begin);
  if (restoring_) return;
  failpoint("result-folded");
  ++figures_.folded;
  if (waiting->arrived != TimePoint{}) figures_.fold_lag_seconds += seconds(now() - waiting->arrived);
  hub_->publish(
      "tile",
      tile_event_json(e.unit.job, e.unit.tile, entry->grid.rect(e.unit.tile), "folded", e.samples.s1, ""),
      e.unit.job.value, entry->stored.owner);
  publish_progress_locked(*entry);
  if (folded_.empty() || folded_.back() != entry) folded_.push_back(entry);
}

void Service::on(const DropUnwanted& e, Todo&) {
  ++figures_.unwanted;
  log_debug(fmt::format("job={} tile={} round={} worker={}", e.unit.job.value, e.unit.tile, e.unit.round,
                        e.worker.value),
            "result dropped: " + e.why);
}

void Service::on(const DigestMismatch& e, Todo&) {
  ++figures_.differing;
  const std::string text = fmt::format(
      "tile {} round {}: {} rendered {}, {} rendered {}: one of them has bad memory or lies", e.unit.tile,
      e.unit.round, e.first_worker.value, e.first.hex(), e.second_worker.value, e.second.hex());
  log_error(fmt::format("job={}", e.unit.job.value), text);
  log_job(e.unit.job, text);
}

void Service::on(const JobPinned& e, Todo& todo) {
  const auto entry = find_locked(e.job);
  if (!entry) return;
  entry->stored.numeric_class = e.numeric_class;
  for (const auto& [id, worker] : workers_)
    if (worker.hello.numeric_class == e.numeric_class) {
      entry->stored.build = worker.hello.build;
      entry->stored.fake |= worker.hello.fake;
    }
  entry->pin_unsaved = true;
  if (!save_pin_locked(*entry)) todo.push_back(JobPaused{e.job});
}

// Stores the numeric class that the job is pinned to, if it is not stored yet. After a restart a class that
// was not stored would be forgotten, and the job could be pinned to another one. So until it is stored, the
// job waits and none of its results is accepted.
Result<void> Service::save_pin_locked(JobEntry& entry) {
  if (!entry.pin_unsaved || persist_locked(entry)) return {};
  entry.trouble =
      fmt::format("the job's numeric class cannot be stored: {}; then resume the job", store_trouble_);
  return fail(Errc::unavailable, entry.trouble);
}

// The state `done` is published and stored only when the final image is written: see finish().
void Service::on(const JobStateChanged& e, Todo&) {
  const auto entry = find_locked(e.job);
  // A job that is removed here continues at another coordinator or not at all.
  if (!entry || entry->removed || e.to == JobState::done) return;
  entry->stored.state = e.to;
  entry->stored.stopped.reset();
  if (e.to != JobState::paused) entry->stored.missing_blobs.clear();
  log_info(fmt::format("job={} state={}", e.job.value, to_string(e.to)), entry->stored.name);
  log_job(e.job, fmt::format("{}", to_string(e.to)));
  if (e.to == JobState::running && !entry->pin_unsaved) entry->trouble.clear();
  if (e.to == JobState::paused) entry->still_since = now();
  if (e.from == JobState::paused) {
    if (const auto since = std::exchange(entry->still_since, std::nullopt); since && entry->clock_zero)
      *entry->clock_zero += now() - std::max(*since, *entry->clock_zero);
  }
  if (e.to == JobState::cancelled || e.to == JobState::failed) {
    entry->stored.totals.render_seconds = entry->fold_seconds;
    entry->stored.totals.ended_unix = unix_now();
    if (entry->assembly) entry->stored.totals.health = entry->assembly->health().total();
    entry->clock_zero.reset();
    entry->leased.clear();
    if (entry->assembly) entry->assembly->forget_waiting();
    end_curve_locked(entry);
    compare_last_locked(entry);
    background_writes_.push([this, entry] { retire(entry); });
  }
  persist_locked(*entry);
  publish_job_locked(*entry);
  ended_.notify_all();
}

void Service::on(const Checkpoint& e, Todo&) {
  const auto entry = find_locked(e.job);
  if (!entry || !entry->assembly) return;
  const bool exact = entry->assembly->errors().knows(e.rounds);
  const ImageError error = image_error(entry->assembly->errors().at(e.rounds));
  entry->assembly->checkpoint_taken(e.rounds);
  entry->stored.totals.doubt = error.verdict;
  entry->stored.totals.few_hits = error.few_hits;
  if (!entry->points.empty() && entry->points.back().spp >= error.spp) {  // known from before the restart
    const bool compared = std::none_of(entry->points.begin(), entry->points.end(), [&](const auto& p) {
      return p.spp == error.spp && !p.reference_error;
    });
    if (!compared) compare_locked(entry, e.rounds, error.spp);
    return;
  }
  // If the errors are not exact, some tile is being rendered again, and earlier errors of the other tiles are
  // no longer kept: this checkpoint gets no point.
  if (!exact) return;
  add_point_locked(
      entry, {entry->fold_seconds, entry->assembly->costs().until(e.rounds), error.spp, figures_of(error)});
  compare_locked(entry, e.rounds, error.spp);
}

// If a job ends by time or is cancelled, its final image may have more samples than its last checkpoint. The
// curve then gets a last point for that image, so that all views agree.
void Service::end_curve_locked(const EntryPtr& entry) {
  if (!entry->assembly || entry->assembly->film().pixels_without_samples() > 0) return;
  const ImageError error = image_error(entry->assembly->film().error());
  if (!entry->points.empty() && entry->points.back().spp >= error.spp) return;
  entry->stored.totals.doubt = error.verdict;
  entry->stored.totals.few_hits = error.few_hits;
  add_point_locked(entry,
                   {entry->fold_seconds, entry->stored.totals.core_seconds, error.spp, figures_of(error)});
}

void Service::add_point_locked(const EntryPtr& entry, const ConvergencePoint& point) {
  entry->points.push_back(point);
  background_writes_.push([this, id = entry->stored.id, point] {
    if (const auto added = store_->add_point(id, point); !added)
      log_error(fmt::format("job={}", id.value), added.error().message);
    failpoint("checkpoint-stored");
  });
}

// Drops the curve's points, which are of wrong or lost pixels. Checkpoints are taken again as tiles are
// folded again.
void Service::forget_curve_locked(JobEntry& entry) {
  ++entry.curve;
  entry.stored.totals.doubt.clear();
  entry.stored.totals.few_hits.reset();
  if (entry.points.empty()) return;
  entry.points.clear();
  background_writes_.push([this, id = entry.stored.id] {
    if (const auto removed = store_->remove_points(id); !removed)
      log_error(fmt::format("job={}", id.value), removed.error().message);
  });
}

void Service::on(const ReopenRound& e, Todo&) {
  const auto entry = find_locked(e.job);
  if (entry && entry->assembly) entry->assembly->forget_round(e.round);
}

void Service::on(const JobFinished& e, Todo&) {
  const auto entry = find_locked(e.job);
  if (!entry) return;
  entry->stored.stopped = e.stopped;
  entry->stored.totals.render_seconds = entry->fold_seconds;
  entry->stored.totals.ended_unix = unix_now();
  if (entry->assembly) entry->stored.totals.health = entry->assembly->health().total();
  entry->clock_zero.reset();
  end_curve_locked(entry);
  compare_last_locked(entry);
  if (e.unaudited > 0)
    log_job(e.job,
            fmt::format("{} results were to be rendered again by another worker, but nobody else of their "
                        "numeric class was there: who rendered them is believed",
                        e.unaudited));
  entry->finishing = ++last_final_;
  entry->leased.clear();
  if (entry->assembly) entry->assembly->forget_waiting();
  after_comparisons(entry, [this, entry, number = entry->finishing] { finish(entry, number); });
}

void Service::on(const JobFailed& e, Todo&) {
  const auto entry = find_locked(e.job);
  if (!entry) return;
  entry->stored.error = e.error;
  log_error(fmt::format("job={}", e.job.value), e.error);
  log_job(e.job, "failed: " + e.error);
  persist_locked(*entry);
  publish_job_locked(*entry);
}

bool Service::persist_locked(JobEntry& entry) {
  if (entry.removed) return true;
  if (unsaved_ && !entry.pin_unsaved) {
    unsaved_->insert(entries_.at(entry.stored.id));
    return true;
  }
  if (const auto put = store_->put_job(entry.stored); !put) {
    store_trouble_ = put.error().message;
    log_error(fmt::format("job={}", entry.stored.id.value), put.error().message);
    return false;
  }
  entry.pin_unsaved = false;
  return true;
}

void Service::log_job(const JobId& id, std::string text) {
  if (!entries_.contains(id)) return;
  if (background_writes_.size() >= kMaxLogWrites) {  // slow disk, or too many messages
    ++log_lines_left_out_;
    return;
  }
  if (const auto lost = std::exchange(log_lines_left_out_, 0))
    text += fmt::format(" (before it {} lines of this and other logs were left out: the disk is slow)", lost);
  background_writes_.push([this, id, line = LogLine{unix_now(), std::move(text)}] {
    if (const auto added = store_->add_log(id, line); !added)
      log_warn(fmt::format("job={}", id.value), added.error().message);
  });
}

double Service::elapsed_locked(const JobEntry& entry) const {
  const TimePoint until = entry.still_since.value_or(now());
  return entry.clock_zero ? std::max(0.0, seconds(until - *entry.clock_zero)) : entry.fold_seconds;
}

void Service::publish_job_locked(JobEntry& entry) {
  entry.progress_due = false;
  entry.last_progress = now();
  if (restoring_) return;
  const JobView view = view_locked(entry);
  hub_->publish("job", job_json(view), entry.stored.id.value, entry.stored.owner);
  if (const auto frame = frame_of(entry.stored.id)) {
    const bool changed = std::exchange(entry.last_state, view.state) != view.state;
    publish_sequence_locked(frame->sequence, changed && !unsaved_);
  }
}

void Service::publish_progress_locked(JobEntry& entry) {
  entry.progress_due = seconds(now() - entry.last_progress) < limits::kProgressSeconds;
  if (!entry.progress_due) publish_job_locked(entry);
}

}  // namespace ls::coordinator

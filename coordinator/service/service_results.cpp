// The path of a result: each is verified by itself, made durable together with others, then reported to the
// farm and acknowledged to its worker.
#include <fmt/format.h>

#include <set>
#include <utility>

#include "common/base/failpoint.h"
#include "common/base/log.h"
#include "common/base/overloaded.h"
#include "coordinator/service/service_impl.h"

namespace ls::coordinator {

namespace {
// Sets implausible times that the worker reports to 0: their sums go into records that must stay readable.
// Values that are not numbers are rejected with the result (verify_result).
void drop_impossible_times(UnitResult& result) {
  if (result.cpu_seconds > kMostUnitSeconds) result.cpu_seconds = 0;
  for (double* part : {&result.times.load, &result.times.build, &result.times.transfer, &result.times.idle,
                       &result.times.wait})
    *part = plausible_seconds(*part);
}
}  // namespace

// Takes a result. Calls `next` when the worker's next message may come: when this result was dropped, or when
// there is room for it.
void Service::receive_result(const std::shared_ptr<Connection>& from, UnitResult result,
                             std::function<void()> next) {
  failpoint("result-arrived");
  Arrived arrived{from, std::move(result), nullptr, {}};
  arrived.at = now();
  drop_impossible_times(arrived.result);
  {
    const std::lock_guard lock(mutex_);
    figures_.result_bytes += arrived.result.exr.size();
    if (!from->open) return next();  // the worker sends it again over its newer stream
    const UnitKey& unit = arrived.result.unit;
    arrived.job = find_locked(unit.job);
    const Wanted wanted = farm_.wanted(unit);
    if (!arrived.job || wanted.verdict == Wanted::Verdict::no)
      return acknowledge_locked(arrived, std::nullopt), next();
    if (!wanted.numeric_class && !farm_.may_pin(unit.job, from->worker))
      return acknowledge_locked(arrived, std::nullopt), next();
    const Digest numeric_class = wanted.numeric_class.value_or(from->numeric_class);
    if (numeric_class != from->numeric_class)
      return acknowledge_locked(arrived,
                                Error{Errc::failed_precondition,
                                      "the job is pinned to another numeric class than this worker's"}),
             next();
    arrived.expected = {arrived.job->stored.scene, arrived.job->settings_digest, numeric_class, wanted.rect,
                        wanted.samples};
    arrived.duplicate = wanted.verdict == Wanted::Verdict::duplicate;
  }
  // The bytes of the message and of the floats decoded from it. If there is no room for them, only this
  // worker's stream is held back; no thread blocks.
  arrived.bytes = 2 * arrived.result.exr.size();
  const std::size_t bytes = arrived.bytes;
  arrived.from->held_back = true;
  budget_.ask(bytes, [this, waiting = std::make_shared<Arrived>(std::move(arrived)), next = std::move(next)] {
    waiting->from->held_back = false;
    arrived_.push(std::move(*waiting));
    next();
  });
}

void Service::verify_loop(const std::stop_token& token) {
  while (!token.stop_requested())
    for (Arrived& a : arrived_.pop(1, token)) {
      const TimePoint begin = now();
      Verified verified =
          verify_result(a.result, a.expected, a.job->grid.frame, aovs_of(a.job->stored.settings));
      failpoint("result-checked");
      checked_.push({std::move(a), std::move(verified), seconds(now() - begin)});
    }
}

void Service::commit_loop(const std::stop_token& token) {
  while (!token.stop_requested()) {
    if (!background_writes_.wait_for_room(kMaxBackgroundWrites, token)) return;
    auto batch = checked_.pop(limits::kMaxCommitBatch, token);
    if (!batch.empty()) commit(std::move(batch));
  }
}

// Makes a batch of results durable, with one sync for each log file. Under load a batch grows while the disk
// works on the one before, so a result waits for at most two syncs.
void Service::commit(std::vector<Checked> batch) {
  struct Stored {
    std::optional<PartialLog::Place> place;
    std::optional<Error> error;
    std::uint64_t resumes = 0;  // of its job, when storing began
  };
  std::vector<Stored> stored(batch.size());
  std::set<std::shared_ptr<PartialLog>> written;
  std::vector<std::shared_ptr<PartialLog>> logs(batch.size());
  std::vector<double> at(batch.size());
  {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const Arrived& a = batch[i].arrived;
      // If the unit has an accepted result meanwhile, this further one need not be stored; the farm compares
      // its digest.
      batch[i].arrived.duplicate = farm_.wanted(a.result.unit).verdict != Wanted::Verdict::yes;
      batch[i].arrived.quarantined = farm_.quarantined(a.from->worker);
      // Pinning to a fake worker's class marks the job as fake; this does so whatever class the worker names.
      if (a.from->fake && !a.duplicate && !std::exchange(a.job->stored.fake, true)) a.job->pin_unsaved = true;
      at[i] = elapsed_locked(*a.job);
      logs[i] = a.job->log;
      stored[i].resumes = a.job->resumes;
      if (const auto saved = save_pin_locked(*a.job); !saved) stored[i].error = saved.error();
      if (const auto saved = save_quarantined_locked(); !saved) stored[i].error = saved.error();
    }
  }
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const Arrived& a = batch[i].arrived;
    if (a.duplicate || a.quarantined || !logs[i] || stored[i].error ||
        !std::holds_alternative<Partial>(batch[i].verified))
      continue;
    const UnitResult& r = a.result;
    auto place = logs[i]->append({r.unit.tile, r.unit.round, a.expected.samples, r.digest, a.from->worker,
                                  r.cpu_seconds, at[i], r.health},
                                 r.exr);
    if (place)
      stored[i].place = *place, written.insert(logs[i]);
    else
      stored[i].error = place.error();
    failpoint("result-appended");
  }
  for (const auto& log : written)
    if (const auto synced = log->sync(); !synced)
      for (std::size_t i = 0; i < batch.size(); ++i)
        if (logs[i] == log && stored[i].place) stored[i].error = synced.error();

  if (!written.empty()) failpoint("result-durable");
  std::unique_lock lock(mutex_);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    Checked& item = batch[i];
    if (farm_.quarantined(item.arrived.from->worker))
      acknowledge_locked(item.arrived,
                         Error{Errc::failed_precondition, "this worker is barred: it rendered wrong pixels"});
    else if (stored[i].error)
      cannot_store_locked(item.arrived, *stored[i].error, stored[i].resumes);
    else if (const auto* bad = std::get_if<BadResult>(&item.verified))
      refuse_locked(item.arrived, bad->error);
    else if (std::holds_alternative<OtherRange>(item.verified))
      acknowledge_locked(item.arrived, std::nullopt);
    else
      accept_locked(item, stored[i].place);
  }
  lock.unlock();  // requests that release() grants may continue on this thread, before it returns
  for (const Checked& item : batch) budget_.release(item.arrived.bytes);
}

void Service::accept_locked(Checked& item, std::optional<PartialLog::Place> place) {
  const Arrived& a = item.arrived;
  const UnitResult& r = a.result;
  JobEntry& entry = *a.job;
  store_trouble_.clear();
  const Wanted wanted = farm_.wanted(r.unit);
  if (wanted.verdict == Wanted::Verdict::yes && wanted.samples == a.expected.samples &&
      (!entry.log || place)) {
    ++figures_.accepted;
    entry.stored.totals.core_seconds += r.cpu_seconds;
    entry.stored.totals.time.add(
        {r.times.load, r.times.build, 0, r.times.transfer, item.seconds, r.times.idle});
    if (entry.assembly) {
      entry.assembly->costs().add(r.unit.tile, r.unit.round, r.cpu_seconds);
      entry.assembly->hold(
          r.unit.tile, r.unit.round,
          {std::move(std::get<Partial>(item.verified)), place, a.expected.samples, r.digest, r.health, a.at});
    }
  }
  // The farm compares duplicates it knows about. If a race left this copy unstored, just return the lease:
  // the stored copy stands, and a further copy would be equal or evidence.
  if (wanted.verdict == Wanted::Verdict::yes && entry.log && !place)
    run_locked(LeaseCameBack{a.from->worker, {r.lease, {r.unit}}});
  else
    run_locked(
        UnitAccepted{r.unit, a.expected.samples, r.digest, a.from->worker, r.cpu_seconds, r.times.wait});
  acknowledge_locked(a, std::nullopt);
}

// Handles a result that failed verification. This is presumably the worker's fault: it counts as a failure of
// the unit and the worker.
void Service::refuse_locked(const Arrived& a, const Error& error) {
  const UnitKey& unit = a.result.unit;
  ++figures_.refused;
  log_warn(fmt::format("job={} tile={} round={} worker={}", unit.job.value, unit.tile, unit.round,
                       a.from->worker.value),
           error.message);
  log_job(unit.job, fmt::format("{} (worker {})", error.message, a.from->worker.value));
  UnitFailure failure;
  failure.unit = unit;
  failure.lease = a.result.lease;
  failure.reason = error.message;
  run_locked(UnitFailed{a.from->worker, std::move(failure)});
  acknowledge_locked(a, error);
}

// Handles a result that could not be stored. This is the coordinator's fault: the unit waits again, and the
// job is paused until a person resumes it. Otherwise workers would render for a full disk. If a person has
// resumed it since storing began, the error may be of what that person mended: the job is not paused again,
// and the next result shows whether it is.
void Service::cannot_store_locked(const Arrived& a, const Error& error, std::uint64_t resumes) {
  const UnitKey& unit = a.result.unit;
  ++figures_.not_stored;
  log_error(fmt::format("job={} tile={} round={}", unit.job.value, unit.tile, unit.round), error.message);
  store_trouble_ = error.message;
  if (a.job->resumes == resumes) {
    log_job(unit.job, "paused: " + error.message);
    a.job->trouble = error.message + "; then resume the job";
    run_locked(JobPaused{unit.job});
  }
  run_locked(LeaseCameBack{a.from->worker, {a.result.lease, {unit}}});
  acknowledge_locked(a, error);
}

void Service::acknowledge_locked(const Arrived& a, std::optional<Error> refused) {
  if (a.from->open) a.from->sink->send(ResultAck{a.result.unit, std::move(refused)});
  failpoint("result-acknowledged");
}

}  // namespace ls::coordinator

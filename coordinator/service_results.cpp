// The way of a result: checked on its own, made durable together with others, then told to the farm and
// acknowledged.
#include <fmt/format.h>

#include <set>
#include <utility>

#include "common/base/log.h"
#include "common/base/overloaded.h"
#include "common/base/step.h"
#include "coordinator/service_impl.h"

namespace ls::coordinator {

namespace {
// Sums of what workers say go into records that must be read again: an absurd figure counts for nothing. What
// is no number at all is refused with the result (verify_result).
void believe(UnitResult& result) {
  if (result.cpu_seconds > kMostUnitSeconds) result.cpu_seconds = 0;
  for (double* part : {&result.times.load, &result.times.build, &result.times.transfer, &result.times.idle,
                       &result.times.wait})
    *part = believed_seconds(*part);
}
}  // namespace

// `next` is called where another message may come: this one was dropped, or there is room for it.
void Service::receive_result(const std::shared_ptr<Connection>& from, UnitResult result,
                             std::function<void()> next) {
  step("result-arrived");
  Arrived arrived{from, std::move(result), nullptr, {}};
  arrived.at = now();
  believe(arrived.result);
  {
    const std::lock_guard lock(mutex_);
    figures_.result_bytes += arrived.result.exr.size();
    if (!from->open) return next();  // it comes again over the newer stream
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
  // Bytes of the message and of its decoded floats. Without room this one stream is held back, no thread.
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
      step("result-checked");
      checked_.push({std::move(a), std::move(verified), seconds(now() - begin)});
    }
}

void Service::commit_loop(const std::stop_token& token) {
  while (!token.stop_requested()) {
    if (!chores_.wait_for_room(kMaxChores, token)) return;
    auto batch = checked_.pop(limits::kMaxCommitBatch, token);
    if (!batch.empty()) commit(std::move(batch));
  }
}

// Everything that waits shares one sync per file: under load a batch grows while the disk works, so a result
// waits for two syncs at most.
void Service::commit(std::vector<Checked> batch) {
  struct Stored {
    std::optional<PartialLog::Place> place;
    std::optional<Error> error;
  };
  std::vector<Stored> stored(batch.size());
  std::set<std::shared_ptr<PartialLog>> touched;
  std::vector<std::shared_ptr<PartialLog>> logs(batch.size());
  std::vector<double> at(batch.size());
  {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const Arrived& a = batch[i].arrived;
      // A copy that has been accepted since it arrived need not be stored again; the farm compares it.
      batch[i].arrived.duplicate = farm_.wanted(a.result.unit).verdict != Wanted::Verdict::yes;
      batch[i].arrived.barred = farm_.barred(a.from->worker);
      // Its class says so when the job is pinned; whatever a worker calls its class, none is hidden.
      if (a.from->fake && !a.duplicate && !std::exchange(a.job->stored.fake, true)) a.job->pin_unsaved = true;
      at[i] = elapsed_locked(*a.job);
      logs[i] = a.job->log;
      if (const auto saved = save_pin_locked(*a.job); !saved) stored[i].error = saved.error();
      if (const auto saved = save_barred_locked(); !saved) stored[i].error = saved.error();
    }
  }
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const Arrived& a = batch[i].arrived;
    if (a.duplicate || a.barred || !logs[i] || stored[i].error ||
        !std::holds_alternative<Partial>(batch[i].verified))
      continue;
    const UnitResult& r = a.result;
    auto place = logs[i]->append({r.unit.tile, r.unit.round, a.expected.samples, r.digest, a.from->worker,
                                  r.cpu_seconds, at[i], r.health},
                                 r.exr);
    if (place)
      stored[i].place = *place, touched.insert(logs[i]);
    else
      stored[i].error = place.error();
    step("result-appended");
  }
  for (const auto& log : touched)
    if (const auto synced = log->sync(); !synced)
      for (std::size_t i = 0; i < batch.size(); ++i)
        if (logs[i] == log && stored[i].place) stored[i].error = synced.error();

  if (!touched.empty()) step("result-durable");
  std::unique_lock lock(mutex_);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    Checked& item = batch[i];
    if (farm_.barred(item.arrived.from->worker))
      acknowledge_locked(item.arrived,
                         Error{Errc::failed_precondition, "this worker is barred: it rendered wrong pixels"});
    else if (stored[i].error)
      cannot_store_locked(item.arrived, *stored[i].error);
    else if (const auto* bad = std::get_if<BadResult>(&item.verified))
      refuse_locked(item.arrived, bad->error);
    else if (std::holds_alternative<OtherRange>(item.verified))
      acknowledge_locked(item.arrived, std::nullopt);
    else
      accept_locked(item, stored[i].place);
  }
  lock.unlock();  // what is granted now may go on at once, on this thread
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
  // A duplicate by the farm's book is compared there; a race that made one unstored is told as nothing: the
  // copy that was stored stands, and this one is equal or evidence the next time.
  if (wanted.verdict == Wanted::Verdict::yes && entry.log && !place)
    run_locked(LeaseCameBack{a.from->worker, {r.lease, {r.unit}}});
  else
    run_locked(
        UnitAccepted{r.unit, a.expected.samples, r.digest, a.from->worker, r.cpu_seconds, r.times.wait});
  acknowledge_locked(a, std::nullopt);
}

// The worker's fault, as far as anyone can tell: it counts against the unit and the worker.
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

// Our fault: the unit goes back and the job waits for a person, rather than render for a full disk.
void Service::cannot_store_locked(const Arrived& a, const Error& error) {
  const UnitKey& unit = a.result.unit;
  ++figures_.not_stored;
  log_error(fmt::format("job={} tile={} round={}", unit.job.value, unit.tile, unit.round), error.message);
  log_job(unit.job, "paused: " + error.message);
  store_trouble_ = error.message;
  a.job->trouble = error.message + "; then resume the job";
  run_locked(JobPaused{unit.job});
  run_locked(LeaseCameBack{a.from->worker, {a.result.lease, {unit}}});
  acknowledge_locked(a, error);
}

void Service::acknowledge_locked(const Arrived& a, std::optional<Error> refused) {
  if (a.from->open) a.from->sink->send(ResultAck{a.result.unit, std::move(refused)});
  step("result-acknowledged");
}

}  // namespace ls::coordinator
